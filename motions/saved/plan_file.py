"""A compiled plan as one file: a NumPy archive with the arrays, and JSON with all the rest."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from go2_wbc.arguments import typed
from go2_wbc.errors import MotionFileError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.robot.model import RobotModel, fingerprint
from motions.dynamics.dynamic_trajectory import UNREADABLE
from motions.language.timeline_data import SAME
from motions.plan.compiled_plan import CompiledPlan
from motions.saved.values import Decoder, Encoder, Format, content_of, fields_of

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
        _require_sane(plan)
    except (MotionFileError, OverflowError) as error:
        raise MotionFileError(f"{file}: {error}") from error
    return plan


def is_saved_plan(name: str | Path) -> bool:
    """Whether ``name`` is that of a file from ``save_plan``, by its ending."""
    return str(name).endswith(PLAN_FORMAT.suffix)


def _arrays_of(file: Path) -> dict[str, np.ndarray]:
    content = content_of(file)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (*UNREADABLE, KeyError):  # NumPy's advice would be to unpickle it: say nothing of that
        raise MotionFileError(f"{file} is damaged, cut short, or no saved plan") from None


def _require_sane(plan: CompiledPlan) -> None:
    """Raise MotionFileError for numbers that fit no plan."""
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
