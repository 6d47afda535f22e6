"""Recordings that cannot be drawn are refused with the reason."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from viz.content import check_recording


def _changed(recording: Recording, name: str, row: int, value: float) -> Recording:
    values = getattr(recording, name).copy()
    values[row] = value
    return replace(recording, **{name: values})


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            lambda r: Recording(*(getattr(r, n)[:1] for n in Recording.__slots__)),
            "1 samples; at least 2",
        ),
        (lambda r: _changed(r, "time", 5, r.time[4]), "must increase"),
        (lambda r: _changed(r, "q", 7, np.nan), r"not finite at t=1\.070 s"),
        (lambda r: replace(r, labels=("stand",)), r"labels has 1 samples"),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    recording: Recording, change: Callable[[Recording], Recording], why: str
) -> None:
    with pytest.raises(ConfigError, match=why):
        check_recording(change(recording))
