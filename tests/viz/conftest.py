"""Shared recordings."""

import pytest

from go2_wbc.recording import Recording
from tests.viz.synthetic import synthetic_recording

_SHORT_SCRIPT = (("stand", 0.4), ("walk", 1.0), ("high_five", 1.2), ("sit", 0.8))


@pytest.fixture(scope="session")
def recording() -> Recording:
    """Stand, walk, high five, crouch in 3.4 s, at 100 Hz, starting at t = 1 s."""
    return synthetic_recording(script=_SHORT_SCRIPT)
