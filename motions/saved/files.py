"""A timeline as a JSON file that can be read and edited: one key a line, SI units, radians.

And a compiled plan as a NumPy archive with the arrays, and JSON with all the rest.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from go2_wbc.arguments import typed
from go2_wbc.errors import MotionFileError, TimelineError, unknown_name
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.robot.model import RobotModel, fingerprint
from motions.authoring import Motion
from motions.dynamics.dynamic_trajectory import UNREADABLE
from motions.language.keys import (
    BODY_CHANNELS,
    BalanceShift,
    BodyKey,
    BodyPathKey,
    FootHold,
    Frame,
    JointKey,
    Key,
    LegKey,
    Mark,
    PhaseKey,
    PostureKey,
    StepKey,
)
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME, BeatClock
from motions.plan.compiled_plan import CompiledPlan
from motions.saved.values import Decoder, Encoder, Format, content_of, fields_of, required

MOTION_FORMAT: Final = Format("go2_wbc.motion", 1, "a saved motion", ".json")
KINDS: Final[Mapping[str, type[Key]]] = {
    "body": BodyKey,
    "body_path": BodyPathKey,
    "posture": PostureKey,
    "leg": LegKey,
    "joint": JointKey,
    "step": StepKey,
    "balance": BalanceShift,
    "phases": PhaseKey,
    "mark": Mark,
    "foot_hold": FootHold,
}
"""The kinds of keys by the words that files have for them: a new kind needs a line here."""
_WORDS: Final[Mapping[type[Key], str]] = {kind: word for word, kind in KINDS.items()}
_KEYS: Final = "keys"
_JOINTS: Final = 3  #: Of a leg


@typed("path")
def save_motion(motion: object, path: Path | str) -> Path:
    """Write what was authored to a ``.json`` file; ``load_motion(path)`` reads it.

    An older file of this name is replaced, or untouched if anything goes wrong.

    Args:
        motion: a ``Timeline``, or a ``Motion`` with its default parameters; others are refused.
        path: where; ends in ``.json``.

    Returns:
        The absolute path.

    Raises:
        MotionFileError: for what is no timeline, or has what a file cannot hold: a function.
        ConfigError: for another ending, a folder in the way, or a place without write access.
    """
    line = motion() if isinstance(motion, Motion) else motion
    if not isinstance(line, Timeline):
        raise MotionFileError(f"save_motion needs a Timeline or a motion, got {motion!r:.60}")
    target = checked_output(path, [MOTION_FORMAT.suffix])
    return write_atomically(target, _text(line).encode())


def read_motion(path: Path | str) -> Timeline:
    """The timeline that ``save_motion`` wrote.

    Raises:
        MotionFileError: if there is no such file, or it is damaged, of another kind or a newer
            version, or says what no timeline can; names the place in the file.
    """
    file = Path(path)
    given = MOTION_FORMAT.without_header(fields_of(content_of(file), file), file)
    try:
        listed = required(given.pop(_KEYS, None), list, _KEYS)
        keys = tuple(_key(item, f"{_KEYS}[{i}]") for i, item in enumerate(listed))
        line = Decoder().fields(given, Timeline, "the motion", {_KEYS: keys})
        BeatClock.of(line.clock.instants)
        return line
    except (MotionFileError, TimelineError, OverflowError) as error:
        raise MotionFileError(f"{file}: {error}") from error


def _text(line: Timeline) -> str:
    """JSON with a line for each field and each key."""
    names = [field.name for field in fields(line) if field.init and field.name != _KEYS]
    rest = MOTION_FORMAT.header()
    rest |= {name: Encoder().encoded(getattr(line, name), name) for name in names}
    rows = [json.dumps(_fields(key, f"{_KEYS}[{i}]")) for i, key in enumerate(line.keys)]
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}," for name, value in rest.items()]
    listed = ",\n".join(f"    {row}" for row in rows)
    listed = f"\n{listed}\n  " if rows else ""
    return "\n".join(["{", *lines, f'  "{_KEYS}": [{listed}]', "}", ""])


def _fields(key: Key, where: str) -> dict[str, Any]:
    if type(key) not in _WORDS:
        raise MotionFileError(f"{where}: a file cannot hold a {type(key).__name__}")
    return {"key": _WORDS[type(key)], **Encoder().encoded(key, f"{where} ({key.track})")}


def _key(value: object, where: str) -> Key:
    given = dict(required(value, dict, where))
    word = given.pop("key", None)
    if not isinstance(word, str) or word not in KINDS:
        raise MotionFileError(f"{where}: {unknown_name('key', str(word), KINDS)}")
    key = Decoder().fields(given, KINDS[word], where)
    try:
        _require_sane(key)
    except TimelineError as error:
        raise MotionFileError(f"{where}: {error}") from error
    return key


def _require_sane(key: Key) -> None:
    """Raise TimelineError for what no call writes; what is too far is for the check to say."""
    if not 0.0 <= key.start <= key.end:
        raise TimelineError(f"must start at 0 s or later and end later, got {key.start} {key.end}")
    if isinstance(key, BodyKey) and key.channel not in BODY_CHANNELS:
        raise TimelineError(unknown_name("channel", key.channel, BODY_CHANNELS))
    if isinstance(key, BodyPathKey):
        _require_way(key)
    if isinstance(key, StepKey) and not (
        0.0 <= key.since <= key.start < key.end and key.height > 0.0 and key.lead >= 0.0
    ):
        raise TimelineError("a step needs since <= start < end, height above 0 and lead from 0 on")
    if isinstance(key, JointKey) and key.joint not in range(_JOINTS):
        raise TimelineError(f"joint must be 0, 1 or 2, got {key.joint}")
    if isinstance(key, LegKey) and key.target.frame is Frame.GROUND and key.target.values[2] < 0.0:
        raise TimelineError(f"a foot cannot go below the ground: z is {key.target.values[2]}")


def _require_way(key: BodyPathKey) -> None:
    shares = (0.0, *key.shares, 1.0)
    is_rising = all(a < b for a, b in pairwise(shares))
    if not is_rising or len(key.shares) != len(key.through):
        raise TimelineError(
            "shares must be as many as the places in through, and rise between 0 and 1, got "
            f"{list(key.shares)}"
        )


PLAN_FORMAT: Final = Format("go2_wbc.plan", 2, "a saved plan", ".plan")
_DESCRIPTION: Final = "description"  #: Name of the JSON text in the archive
_ROBOT, _PLAN = "robot", "plan"


@typed("path", "model")
def save_plan(plan: object, path: Path | str, *, model: RobotModel | None = None) -> Path:
    """Write a compiled plan to a ``.plan`` file; ``load_plan(path)`` reads it.

    It then plays as it did, number by number, without being compiled again. An older file of this
    name is replaced, or untouched if anything goes wrong.

    Args:
        plan: a ``CompiledPlan``; others are refused.
        path: where; ends in ``.plan``.
        model: the robot that it was compiled for, by default the installed Go2.

    Returns:
        The absolute path.

    Raises:
        MotionFileError: for what is no compiled plan, or is not finite.
        ConfigError: for another ending, a folder in the way, or a place without write access.
    """
    if not isinstance(plan, CompiledPlan):
        raise MotionFileError(
            f"save_plan needs a CompiledPlan, got {plan!r:.60}; compile_timeline makes one"
        )
    target = checked_output(path, [PLAN_FORMAT.suffix])
    arrays: dict[str, np.ndarray] = {}
    description = {
        **PLAN_FORMAT.header(),
        _ROBOT: fingerprint(model or RobotModel()),
        _PLAN: Encoder(arrays).encoded(plan, _PLAN),
    }
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise MotionFileError(f"{name} of {plan.name!r} has a value that is not finite")
    stream = io.BytesIO()
    contents: dict[str, Any] = {_DESCRIPTION: np.array(json.dumps(description)), **arrays}
    np.savez_compressed(stream, **contents)
    return write_atomically(target, stream.getvalue())


@typed()
def load_plan(path: Path | str, *, model: RobotModel | None = None) -> CompiledPlan:
    """The plan that ``save_plan`` wrote.

    Args:
        path: the file.
        model: the robot that shall play it, by default the installed Go2.

    Raises:
        MotionFileError: if there is no such file, or it is damaged, of another kind or a newer
            version, or the plan was compiled for another robot.
    """
    file = Path(path)
    arrays = _arrays_of(file)
    text = arrays.pop(_DESCRIPTION, np.array(""))
    given = PLAN_FORMAT.without_header(fields_of(str(text).encode(), file), file)
    own = fingerprint(model or RobotModel())
    if given.get(_ROBOT) != own:
        raise MotionFileError(
            f"{file} was compiled for another robot ({given.get(_ROBOT)!s:.20}; this one is "
            f"{own}): compile the motion for this one"
        )
    try:
        plan = Decoder(arrays).fields(given.get(_PLAN), CompiledPlan, _PLAN)
        _require_plan(plan)
    except (MotionFileError, OverflowError) as error:
        raise MotionFileError(f"{file}: {error}") from error
    return plan


def is_saved_plan(name: str | Path) -> bool:
    """Whether ``name`` is that of a file from ``save_plan``, by its ending."""
    return str(name).endswith(PLAN_FORMAT.suffix)


def is_saved(name: str | Path) -> bool:
    """Whether ``name`` is that of a saved motion or plan, by its ending."""
    return str(name).endswith((MOTION_FORMAT.suffix, PLAN_FORMAT.suffix))


def _arrays_of(file: Path) -> dict[str, np.ndarray]:
    content = content_of(file)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (*UNREADABLE, KeyError):  # NumPy's advice would be to unpickle it: say nothing of that
        raise MotionFileError(f"{file} is damaged, cut short, or no saved plan") from None


def _require_plan(plan: CompiledPlan) -> None:
    curves, contacts = plan.curves, plan.contacts
    if contacts.period is not None:
        raise MotionFileError(f"plan.contacts must not repeat, got a period of {contacts.period}")
    ends = (0.0, *plan.beats, curves.x[-1])
    if not (np.diff(ends) > -SAME).all():
        raise MotionFileError(f"plan.beats must rise from 0 s to {curves.x[-1]:g} s")
    if unknown := plan.held.keys() - plan.spans.keys():
        raise MotionFileError(f"plan.held names {min(unknown)!r:.60}, which is none of its spans")
    if not plan.ramp > 0.0:
        raise MotionFileError(f"plan.ramp must be above 0 s, got {plan.ramp}")
