"""A timeline as a JSON file that can be read and edited: one key a line, SI units, radians."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from go2_wbc.arguments import typed
from go2_wbc.errors import MotionFileError, TimelineError, unknown_name
from go2_wbc.files import checked_output, write_atomically
from motions.authoring import Motion
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
from motions.language.timeline_data import BeatClock
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
    rest = {name: Encoder().encoded(getattr(line, name), name) for name in names}
    rows = [json.dumps(_fields(key, f"{_KEYS}[{i}]")) for i, key in enumerate(line.keys)]
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}," for name, value in rest.items()]
    header = [
        f"  {json.dumps(name)}: {json.dumps(value)},"
        for name, value in MOTION_FORMAT.header().items()
    ]
    listed = ",\n".join(f"    {row}" for row in rows)
    listed = f"\n{listed}\n  " if rows else ""
    return "\n".join(["{", *header, *lines, f'  "{_KEYS}": [{listed}]', "}", ""])


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
