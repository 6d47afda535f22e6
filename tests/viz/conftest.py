"""Shared recordings, and what happens to the browser tests on a machine without a browser."""

from __future__ import annotations

import pytest

from go2_wbc.recording import Recording
from tests.viz.chromium import find_chromium
from tests.viz.synthetic import synthetic_recording

_SHORT_SCRIPT = (("stand", 0.4), ("walk", 1.0), ("high_five", 1.2), ("sit", 0.8))


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "browser: needs a Chromium on this machine")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the browser tests where there is no browser; the report says so."""
    if find_chromium() is not None:
        return
    without = [item for item in items if item.get_closest_marker("browser")]
    if without:
        config.hook.pytest_deselected(items=without)
        items[:] = [item for item in items if not item.get_closest_marker("browser")]


@pytest.fixture(scope="session")
def recording() -> Recording:
    """Stand, walk, high five, crouch in 3.4 s, at 100 Hz, starting at t = 1 s."""
    return synthetic_recording(script=_SHORT_SCRIPT)
