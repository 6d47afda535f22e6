"""What a page, a film or a plot shows: a movement, perhaps a ghost beside it, and a verdict on it.

Plain values: whoever checks motions translates its report into a ``Verdict``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording

CENTRE_OF_MASS = "com"  #: Stands in ``Annotation.parts`` for the centre of mass
_LEAST_SAMPLES = 2


@typed()
@dataclass(frozen=True, slots=True)
class MarginCurve:
    """What is left to one limit over time: the least of all its subjects."""

    name: str  #: of the limit
    unit: str  #: of the margin
    time: Float[np.ndarray, " n"]  #: (n,) seconds after the start
    margin: Float[np.ndarray, " n"]
    """(n,) negative where the limit is broken, nan where there is nothing to judge."""
    subjects: tuple[str, ...]  #: what is judged
    worst: Int[np.ndarray, " n"]  #: (n,) which subject has the least margin, a row of ``subjects``
    tight: float | int = 0.0  #: a margin below it deserves a warning

    __repr__ = brief

    @property
    def least(self) -> float:
        """The least margin; inf if there was nothing to judge."""
        known = self.margin[~np.isnan(self.margin)]
        return float(known.min()) if len(known) else np.inf

    @property
    def is_broken(self) -> bool:
        """Whether the limit is broken at any time."""
        return self.least < 0.0


@typed()
@dataclass(frozen=True, slots=True)
class Annotation:
    """A limit that one subject breaks, or nearly does."""

    limit: str  #: its name
    subject: str  #: joint, foot or part of the body
    time: float  #: when [s] it is worst
    text: str  #: value and limit in words
    is_broken: bool  #: otherwise the margin is only tight
    spans: tuple[tuple[float, float], ...]  #: start and end [s] of each stretch in which it is so
    parts: tuple[str, ...]  #: links that are concerned, such as ``FL_calf``, or ``CENTRE_OF_MASS``


@dataclass(frozen=True, slots=True)
class CertifiedRun:
    """One randomised run."""

    seed: int  #: that it can be repeated with
    conditions: str  #: what the seed has drawn, in words
    is_done: bool  #: whether the movement was done
    text: str  #: what went wrong, or came nearest to it


@dataclass(frozen=True, slots=True)
class CertifiedRate:
    """How often a movement was done in randomised runs."""

    n: int  #: runs
    done: int  #: those in which it was done
    interval: tuple[float, float]  #: of the true rate, 0 to 1
    confidence: float  #: of the interval, 0 to 1
    world: str  #: in which it holds, in words
    worst: tuple[CertifiedRun, ...]  #: the worst runs, the worst first
    versions: Mapping[str, str]  #: what else it holds for, by name
    outdated: str = ""  #: why it does not hold for what is shown; empty if it does
    why: str = ""  #: why runs failed: the commonest reason; empty if none did


@typed()
@dataclass(frozen=True, slots=True)
class Verdict:
    """What a check says of a movement."""

    ok: bool  #: no limit is broken
    text: str  #: the verdict in a few words
    annotations: tuple[Annotation, ...]  #: the broken limits, then the tight ones
    curves: tuple[MarginCurve, ...]  #: the margin of every limit
    chance: float | None = None  #: that the movement is done, 0 to 1; None if nothing is said of it
    world: str = ""  #: in which all this holds, in words
    coarse: str = ""  #: why it is only a first answer, in words; empty if it is exact
    certified: CertifiedRate | None = None  #: how often it was done in randomised runs

    __repr__ = brief

    def ranked(self) -> tuple[MarginCurve, ...]:
        """The curves: broken ones first, then the tight ones, then the others as they come."""
        return tuple(sorted(self.curves, key=lambda c: (not c.is_broken, c.least >= c.tight)))


@typed()
@dataclass(frozen=True, slots=True)
class Slider:
    """A parameter that can be chosen on a live page."""

    name: str  #: of the parameter
    value: float | str  #: what is chosen now: a number, or one of ``words``
    low: float = 0.0  #: what is valid, at the least
    high: float = 1.0  #: at the most
    is_whole: bool = False  #: only whole numbers are
    unit: str = ""  #: of the number
    words: tuple[str, ...] = ()  #: what is valid instead of a number


@typed()
@dataclass(frozen=True, slots=True)
class ReplayContent:
    """What to show."""

    recording: Recording  #: the movement of the solid robot
    is_plan: bool = False  #: it is a plan; otherwise it was measured
    verdict: Verdict | None = None  #: what to say about the motion
    ghost: Recording | None = None
    """The plan of what was measured, shown translucent; its clock starts with the recording's, and
    the verdict is on it."""
    proposal: Verdict | None = None
    """The verdict on the ghost, where that is another motion, proposed in its place."""
    written: Recording | None = None
    """What was written, where the plan is only the nearest to it; shown translucent in another
    colour. Of its forces, torques and margins nothing is shown."""
    beats: tuple[float, ...] = ()  #: instants [s] that the motion counts in, drawn as a ruler
    sliders: tuple[Slider, ...] = ()  #: parameters that a live page lets one choose
    sound: bytes = b""
    """An MP3 file that starts with the recording, played in step with it; empty for none."""
    end_pose: tuple[float, float, float] | None = None
    """Where the movement shall end: x, y [m] and yaw [rad] of the frame of the feet."""
    bar: tuple[int, int] = (4, 0)
    """Beats of a bar, and the number of the beat on which the first begins."""
    editor: Mapping[str, object] | None = None
    """What a page that edits the motion's file shows of it, as for JSON; see
    ``controller.studio``."""

    __repr__ = brief


def checked_content(shown: Recording | ReplayContent) -> ReplayContent:
    """What to show, once it is known that it can be drawn.

    Raises:
        ConfigError: for a recording that cannot be drawn.
    """
    content = ReplayContent(shown) if isinstance(shown, Recording) else shown
    for recording in (content.recording, content.ghost, content.written):
        if recording is not None:
            check_recording(recording)
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
