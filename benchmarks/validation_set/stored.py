"""What the exam keeps in files: borders, and outcomes as a cache of what physics gave."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.store import ROOT, settings_header
from controller.motion_failures import MotionFailures
from go2_wbc.errors import ConfigError
from go2_wbc.files import write_atomically
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.reference import Target

FOLDER = Path(__file__).parent
BORDERS_FILE, OUTCOMES_FILE = FOLDER / "borders.json", FOLDER / "outcomes.json"
DECIDES = ("go2_wbc", "controller", "benchmarks/validation_set/physics.py")
"""Code that decides what physics makes of a plan. What makes plans is not among it: each outcome is
kept under a digest of its plan."""
INSTANTS = 80
"""Of a plan that its digest holds: own choice."""


def physics_header() -> dict[str, str]:
    """What outcomes depend on besides the plans; stored ones hold only where it agrees."""
    code = hashlib.sha256()
    roots = [ROOT / name for name in DECIDES]
    files = [file for root in roots for file in ([root] if root.is_file() else root.rglob("*.py"))]
    for file in sorted(files):
        code.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes())
    header = settings_header()
    kept = {key: header[key] for key in ("libraries", "settings")}
    return {**kept, "code": code.hexdigest()[:12]}


def digest(plan: MotionPlan) -> str:
    """A short hash of where trunk, joints and feet shall be: of plans that are played alike."""
    instants = np.linspace(0.0, plan.duration, INSTANTS).tolist()
    targets = [Target.of(plan.row_at(t)) for t in instants]
    names = ("p_world", "R_world_base", "q_joints", "p_world_feet", "legs")
    values = [np.ravel(getattr(target, name)) for target in targets for name in names]
    rounded = np.round(np.concatenate([*values, [plan.duration]]), 4) + 0.0  # no negative zeros
    return hashlib.sha256(rounded.tobytes()).hexdigest()[:12]


def read_borders(path: Path = BORDERS_FILE) -> dict[str, float | None]:
    """The amplitudes at which physics changes its mind, by draw.

    Raises:
        ConfigError: if the file is missing or damaged.
    """
    kept = _read(path, "--borders")
    return {name: None if flip is None else float(flip) for name, flip in kept.items()}


def borders_version(path: Path = BORDERS_FILE) -> str:
    """A short hash of the file of borders: with others, the exam asks other questions."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:8] if path.exists() else "none"


def write_borders(borders: Mapping[str, float | None], path: Path = BORDERS_FILE) -> None:
    """Keep borders, one a line."""
    _write(path, {name: value and round(value, 4) for name, value in borders.items()})


def read_outcomes(path: Path = OUTCOMES_FILE) -> tuple[dict[str, MotionFailures], str]:
    """Stored outcomes by name and digest of the plan, and why none of them hold; or "".

    Raises:
        ConfigError: if the file is damaged.
    """
    if not path.exists():
        return {}, "no outcomes are stored"
    stored = _read(path, "--remake")
    was, now = stored.pop("header", {}), physics_header()
    other = [f"{key} {was.get(key)}, now {now[key]}" for key in now if was.get(key) != now[key]]
    if other:
        return {}, f"stored outcomes are of other settings ({'; '.join(other)})"
    return {key: MotionFailures(*map(tuple, row)) for key, row in stored.items()}, ""


def write_outcomes(outcomes: Mapping[str, MotionFailures], path: Path = OUTCOMES_FILE) -> None:
    """Keep outcomes, one a line, below what they depend on."""
    rows = {key: list(asdict(outcome).values()) for key, outcome in outcomes.items()}
    _write(path, {"header": physics_header(), **rows})


def _read(path: Path, option: str) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}; make it anew with {option}") from error


def _write(path: Path, rows: Mapping[str, object]) -> None:
    lines: Iterable[str] = (f"{json.dumps(k)}: {json.dumps(v)}" for k, v in rows.items())
    write_atomically(path, ("{\n" + ",\n".join(lines) + "\n}\n").encode())
