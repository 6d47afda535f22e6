"""What every export asks of a recording."""

from __future__ import annotations

import numpy as np

from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from viz.content import ReplayContent

_LEAST_SAMPLES = 2


def checked_content(shown: Recording | ReplayContent) -> ReplayContent:
    """What to show, once it is known that it can be drawn.

    Raises:
        ConfigError: for a recording that cannot be drawn.
    """
    content = ReplayContent(shown) if isinstance(shown, Recording) else shown
    check_recording(content.recording)
    if content.ghost is not None:
        check_recording(content.ghost)
    return content


def check_recording(recording: Recording) -> None:
    """Refuse a recording that cannot be drawn.

    Raises:
        ConfigError: with too few samples, times that do not increase, fields of other lengths, or
            a configuration that is not finite.
    """
    samples = len(recording.time)
    if samples < _LEAST_SAMPLES:
        raise ConfigError(f"the recording has {samples} samples; at least {_LEAST_SAMPLES} needed")
    if not np.all(np.diff(recording.time) > 0):
        raise ConfigError("the times of the recording must increase")
    for name in ("q", "tau", "foot_forces", "stance", "p_world_com", "support_margin", "labels"):
        length = len(getattr(recording, name))
        if length != samples:
            raise ConfigError(f"recording.{name} has {length} samples, recording.time {samples}")
    if not np.all(np.isfinite(recording.q)):
        first = int(np.flatnonzero(~np.isfinite(recording.q).all(axis=1))[0])
        raise ConfigError(
            f"the configuration is not finite at t={recording.time[first]:.3f} s; cannot draw it"
        )
