"""Recordings that cannot be drawn are refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from viz.content import check_recording


def _first(recording: Recording, count: int) -> Recording:
    fields = {name: getattr(recording, name)[:count] for name in Recording.__slots__}
    return Recording(**fields)


def test_a_recording_with_one_sample_is_refused(recording: Recording) -> None:
    with pytest.raises(ConfigError, match="1 samples; at least 2"):
        check_recording(_first(recording, 1))


def test_times_that_do_not_increase_are_refused(recording: Recording) -> None:
    time = recording.time.copy()
    time[5] = time[4]
    with pytest.raises(ConfigError, match="must increase"):
        check_recording(replace(recording, time=time))


def test_a_configuration_that_is_not_finite_is_refused_with_its_time(recording: Recording) -> None:
    q = recording.q.copy()
    q[7, 9] = np.nan
    with pytest.raises(ConfigError, match=r"t=1\.070 s"):
        check_recording(replace(recording, q=q))


def test_labels_of_another_length_are_refused(recording: Recording) -> None:
    with pytest.raises(ConfigError, match=r"labels has 1 samples"):
        check_recording(replace(recording, labels=("stand",)))
