"""Bars, and what is done with them, as the page needs them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields

from controller.studio import worlds
from controller.studio.certifying import RUNS
from controller.studio.edits import PALETTE
from controller.studio.exports import EXPORTS
from controller.studio.grounds import PlayedGround
from controller.studio.orders import Answer, Bar
from controller.studio.project import Project
from controller.studio.songs import songs_beside
from controller.studio.source import Slot, parameters
from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture
from go2_wbc.world import World
from motions.language.body_and_feet import POSES
from motions.language.steps import STEP_GAITS

WORDS: Mapping[str, Sequence[str]] = {
    "leg": [leg.name for leg in LEGS],
    "ease": [ease.value for ease in Ease],
    "frame": ["ground", "body"],
    "gait": list(STEP_GAITS),
    "pose.name": list(POSES),
    "joint": ["hip", "thigh", "calf"],
    "posture.stance": [posture.name for posture in Posture],
}
"""Words that arguments may be, of all calls or of one; others can be written in the file."""

_BAR = tuple(field.name for field in fields(Bar))
_SLOT = tuple(field.name for field in fields(Slot) if field.name != "is_choice")
_DRAFT = ("name", "number", "span", "parts", "broken", "values", "is_idle")
"""What a drag changes of a bar."""


def editor(
    shown: Answer, project: Project, world: World, ground: PlayedGround
) -> dict[str, object]:
    """What the page shows of a file that is saved, and what may be asked for."""
    return {
        "bars": [saved(bar) for bar in shown.bars],
        "file": project.path.name,
        "motion": shown.title,
        "motions": shown.motions,
        "base": project.base,
        "undo": project.can_undo,
        "redo": project.can_redo,
        "palette": list(PALETTE),
        "songs": songs_beside(project.path),
        "exports": EXPORTS,
        "runs": RUNS,
        "notes": shown.notes,
        "world": worlds.shown(world, ground),
        "words": WORDS,
        "lanes": ["trunk", *(leg.name for leg in LEGS), "robot", "time"],
    }


def saved(bar: Bar) -> dict[str, object]:
    """All of a bar, with the arguments that could be added by a name."""
    given = {slot.of for slot in bar.slots}
    more = [name for name in parameters(bar.name) if name not in {*given, "others"}]
    slots = [_picked(slot, _SLOT) for slot in bar.slots]
    return {**_picked(bar, _BAR), "slots": slots, "more": more}


def draft(bar: Bar) -> dict[str, object]:
    """What a drag changes of it."""
    return _picked(bar, _DRAFT)


def _picked(one: Bar | Slot, names: Sequence[str]) -> dict[str, object]:
    return {name: getattr(one, name) for name in names}
