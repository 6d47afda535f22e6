"""Faults, put by seed into the library's motions, and an oracle for the limits they break.

The oracle reads the compiled plan with Pinocchio and plane geometry. It shares no code with the
feasibility check, so that the two can be set against each other.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.errors import Go2WbcError, TimelineError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline, load_motion, motion_names
from motions.language.keys import (
    ON_GROUND,
    BalanceShift,
    BodyKey,
    Frame,
    Key,
    LegKey,
    LegTarget,
    PhaseKey,
    StepKey,
)

Mutator = Callable[[Timeline, np.random.Generator], Timeline]
_KeyType = TypeVar("_KeyType", BodyKey, LegKey, BalanceShift)

STEP = 0.004  # s, between the instants that the oracle looks at
JUMP = 0.6  # m/s or rad/s from one instant to the next: 150 m/s^2
AWAY = 0.035  # m or rad off a posture at the end
OUTSIDE = -0.005  # m; a CoM this near to the edge of its feet cannot be held up
LONGEST = 0.445  # m, from the hip's centre to a foot: thigh, calf and the width of the hip
STANDING = tuple(
    name
    for name in motion_names()
    if not any(isinstance(key, StepKey | PhaseKey) for key in load_motion(name).keys)
)
"""Motions of the library that stay on three feet or four: what the oracle knows the rules of."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A motion of the library with one thing broken."""

    mutator: str  #: what was done to it
    line: Timeline  #: the result
    broken: str  #: what the oracle sees, in words


def faults(model: RobotModel, count: int) -> list[Fault]:
    """``count`` motions that break a limit: every mutator in turn, on motions drawn by seed."""
    rng = np.random.default_rng(2026)
    found: list[Fault] = []
    for name, mutate in _in_turn():
        if len(found) == count:
            return found
        line = _mutated(mutate, rng)
        broken = line and limit_broken(line, model)
        if line and broken:
            found.append(Fault(name, line, broken))
    raise AssertionError("unreachable")


def _in_turn() -> Iterator[tuple[str, Mutator]]:
    while True:
        yield from MUTATORS.items()


def _mutated(mutate: Mutator, rng: np.random.Generator) -> Timeline | None:
    line = load_motion(str(rng.choice(STANDING)))
    try:
        return mutate(line, rng)
    except Go2WbcError:  # nothing fits, or the language itself refuses it: nothing is left to check
        return None


def _larger(line: Timeline, rng: np.random.Generator) -> Timeline:
    """One move of the trunk several times as large."""
    key = _one(line, BodyKey, rng, lambda key: key.value != 0.0)
    value = float(np.clip(key.value * rng.uniform(3.0, 6.0), -1.4, 1.4))
    return _with(line, key, replace(key, value=value))


def _hurried(line: Timeline, rng: np.random.Generator) -> Timeline:
    """Everything many times as fast."""
    share = float(rng.uniform(0.04, 0.12))
    keys = tuple(replace(key, start=share * key.start, end=share * key.end) for key in line.keys)
    return replace(line, keys=keys, cursor=share * line.cursor)


def _without_balance(line: Timeline, rng: np.random.Generator) -> Timeline:
    """Feet are raised, and the trunk stays where it is."""
    _one(line, BalanceShift, rng, lambda _: True)
    return replace(line, keys=tuple(key for key in line.keys if not isinstance(key, BalanceShift)))


def _second_foot(line: Timeline, rng: np.random.Generator) -> Timeline:
    """Another foot leaves the ground while one is up."""
    raised = {key.leg for key in line.in_order(LegKey)}
    key = _one(line, LegKey, rng, _is_up)
    leg = rng.choice(np.array([leg for leg in LEGS if leg not in raised], dtype=object))
    up = LegTarget(Frame.GROUND, (0.0, 0.0, float(rng.uniform(0.05, 0.12))))
    middle = key.start + 0.3
    moves = (
        LegKey(key.start, middle, Ease.MINIMUM_JERK, leg, up),
        LegKey(middle, line.end, Ease.MINIMUM_JERK, leg, ON_GROUND),
    )
    return replace(line, keys=(*line.keys, *moves))


def _out_of_reach(line: Timeline, rng: np.random.Generator) -> Timeline:
    """A foot is sent half a metre farther."""
    key = _one(line, LegKey, rng, _is_up)
    ahead, up = (float(rng.uniform(0.45, 0.8)) for _ in range(2))
    return _with(line, key, replace(key, target=LegTarget(Frame.GROUND, (ahead, 0.0, up))))


def _jumping(line: Timeline, rng: np.random.Generator) -> Timeline:
    """A move of the trunk happens all at once."""
    key = _one(line, BodyKey, rng, lambda key: abs(key.value) > 0.03)
    return _with(line, key, replace(key, ease=Ease.HOLD))


def _mislabelled(line: Timeline, rng: np.random.Generator) -> Timeline:
    """It says that it ends in another posture."""
    others = [posture for posture in Posture if posture is not line.exit]
    return replace(line, exit=others[int(rng.integers(len(others)))])


def _joint_beyond(line: Timeline, rng: np.random.Generator) -> Timeline:
    """A raised leg's joints are sent beyond their limits."""
    key = _one(line, LegKey, rng, _is_up)
    hip, thigh, calf = (0.0, 0.8, -1.6)
    worse = [(1.3, thigh, calf), (hip, -2.0, calf), (hip, thigh, -0.4), (hip, thigh, -3.0)]
    angles = worse[int(rng.integers(len(worse)))]
    return _with(line, key, replace(key, target=LegTarget(Frame.JOINTS, angles)))


MUTATORS: Mapping[str, Mutator] = {
    "larger": _larger,
    "hurried": _hurried,
    "without balance": _without_balance,
    "second foot": _second_foot,
    "never down": lambda line, rng: _without(
        line, _one(line, LegKey, rng, lambda key: key.target.is_on_ground)
    ),
    "never home": lambda line, rng: _without(
        line, _one(line, BodyKey, rng, lambda key: key.value == 0.0 and key.end == line.end)
    ),
    "out of reach": _out_of_reach,
    "jumping": _jumping,
    "mislabelled": _mislabelled,
    "joint beyond": _joint_beyond,
}


def _is_up(key: LegKey) -> bool:
    return not key.target.is_on_ground


def _one(
    line: Timeline, kind: type[_KeyType], rng: np.random.Generator, fits: Callable[[_KeyType], bool]
) -> _KeyType:
    """One of the keys that fit; TimelineError if there is none."""
    keys = [key for key in line.in_order(kind) if fits(key)]
    if not keys:
        raise TimelineError("nothing fits")
    return keys[int(rng.integers(len(keys)))]


def _with(line: Timeline, old: Key, new: Key) -> Timeline:
    return replace(line, keys=tuple(new if key is old else key for key in line.keys))


def _without(line: Timeline, old: Key) -> Timeline:
    return replace(line, keys=tuple(key for key in line.keys if key is not old), cursor=line.end)


def limit_broken(line: Timeline, model: RobotModel) -> str:
    """The first limit that the plan of ``line`` breaks, in words; empty if it breaks none."""
    plan = compile_timeline(line, model)
    times = np.arange(0.0, plan.duration + STEP / 2, STEP)
    values = plan.curves(np.minimum(times, plan.duration))
    joints = values[:, 6:18]
    speed = np.abs(np.diff(joints, axis=0)) / STEP
    trunk = np.diff(values[:, :6], axis=0) / STEP
    stance = np.array([plan.contacts.at(float(t)).stance for t in times])
    seen = {
        "a joint beyond its limit": _beyond(joints, model),
        "a joint too fast": bool((speed > model.speed_limits).any()),
        "a jump of the trunk": bool((np.abs(np.diff(trunk, axis=0)) > JUMP).any()),
        "fewer than three feet on the ground": bool((stance.sum(axis=1) < 3).any()),
        "a foot in the air at the end": not stance[-1].all(),
        "not in its posture at the end": _ends_elsewhere(plan, values),
        "the CoM outside of its feet": _falls_over(values, stance, model),
        "a foot out of reach": _unreachable(line, model),
    }
    return next((what for what, is_so in seen.items() if is_so), "")


def _beyond(joints: np.ndarray, model: RobotModel) -> bool:
    return bool(((joints < model.q_lower - 1e-3) | (joints > model.q_upper + 1e-3)).any())


def _ends_elsewhere(plan: CompiledPlan, values: np.ndarray) -> bool:
    sits_or_lies = bool(values[-1, 2] < 0.24)
    if sits_or_lies is not (plan.exit is not Posture.STAND):
        return True
    start, end = values[0, :6], values[-1, :6]
    return plan.entry is plan.exit and bool(np.abs(end - start).max() > AWAY)


def _falls_over(values: np.ndarray, stance: np.ndarray, model: RobotModel) -> bool:
    feet = model.p_base_feet_nominal[:, :2]
    return any(
        _outside(feet[stands], com) > OUTSIDE
        for com, stands in zip(values[:, :2], stance, strict=True)
        if stands.sum() >= 3
    )


def _outside(points: np.ndarray, p: np.ndarray) -> float:
    """How far [m] ``p`` is outside of the convex hull of three or four ``points``."""
    middle = points.mean(axis=0)
    around = points[np.argsort(np.arctan2(*(points - middle).T[::-1]))]
    edges = np.roll(around, -1, axis=0) - around
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return float(np.einsum("ij,ij->i", normals, p - around).max())


def _unreachable(line: Timeline, model: RobotModel) -> bool:
    """Whether a foot's place is farther from every place that its hip may take than a leg."""
    for key in line.in_order(LegKey):
        if key.target.frame is Frame.GROUND:
            up = key.target.values[2]
            ahead = abs(key.target.values[0])
            if np.hypot(max(ahead - 0.15, 0.0), max(up - 0.35, 0.0)) > LONGEST:
                return True
    return False
