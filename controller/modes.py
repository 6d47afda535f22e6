"""Modes of the robot, what comes of what it is asked to do, and what must be measured for that."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from go2_wbc.brief import brief
from go2_wbc.geometry import support_margin
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.state import Snapshot


class Mode(StrEnum):
    """What the robot is doing between calls; equal to its name in lower case."""

    LYING = "lying"
    STANDING = "standing"
    SITTING = "sitting"
    WALKING = "walking"
    MOVING = "moving"
    FALLEN = "fallen"
    DAMPED = "damped"
    CLOSED = "closed"

    @property
    def is_upright(self) -> bool:
        """Whether the robot is on its feet."""
        return self in (Mode.STANDING, Mode.SITTING, Mode.WALKING, Mode.MOVING)


Measurements = Mapping[str, float]  #: Measured quantities by name with unit
Procedure = Callable[[], Measurements]  #: What a call does
Limited = Mapping[str, tuple[float, float | None]]
"""What was measured, by name with unit: the value, and what it must stay below, if anything."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Why the loop took the robot out of its behaviour."""

    reason: str  #: in plain words
    is_fall: bool = False  #: whether the robot has fallen
    may_fall: bool = False
    """Whether it went limp in the middle of balancing, so that it may yet fall."""


@dataclass(frozen=True, slots=True)
class Asked:
    """How things were when a call was asked for, which may have to plan or load first."""

    fault: Fault | None  #: of the loop
    cancelled: int  #: how often motions had been cancelled


@dataclass(frozen=True, slots=True, eq=False)
class Call:
    """A call that runs."""

    name: str
    start: float  #: when [s] it began
    asked: Asked | None = None
    """How things were before it was planned, or what it needs was loaded; None if nothing was."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a blocking call, or of a job.

    Attributes:
        ok: whether the measured state shows that it was done.
        reason: why, in plain words.
        duration: robot time [s] that it took.
        measured: the measured quantities that the verdict rests on, by name with unit.
        cancelled: whether a job ended early because it was called off.
        is_refused: whether a job was never begun.
        error: what a job raised, if anything.
    """

    ok: bool
    reason: str
    duration: float = 0.0
    measured: Measurements = field(default_factory=dict)
    cancelled: bool = field(default=False, repr=False)
    is_refused: bool = field(default=False, repr=False)
    error: Exception | None = field(default=None, repr=False)

    __repr__ = brief

    def __bool__(self) -> bool:
        return self.ok


class Aborted(Exception):
    """A procedure did not reach its end; the message says why, ``measured`` what was measured."""

    def __init__(self, reason: str, measured: Measurements | None = None) -> None:
        super().__init__(reason)
        self.measured = dict(measured or {})


def are_within(measured: Limited) -> bool:
    """Whether every value is below its limit."""
    return not _beyond(measured)


def told(measured: Limited) -> str:
    """What of it is not below its limit, each with the limit, in one line."""
    return ", ".join(
        f"{name} {value:.3g}, limit {limit:.3g}" for name, value, limit in _beyond(measured)
    )


def _beyond(measured: Limited) -> list[tuple[str, float, float]]:
    return [
        (name, value, limit)
        for name, (value, limit) in measured.items()
        if limit is not None and not value < limit
    ]


def listed(measured: Measurements) -> str:
    """``measured`` in one line."""
    return ", ".join(f"{name} {value:.3g}" for name, value in measured.items())


STILL_SPEED = 0.05  #: Speed [m/s] of the base below which it counts as still
CALM_SPEED = 0.012
"""Speed [m/s] of the CoM below which a robot that has walked counts as at rest: it shifts its trunk
by 0.01 (``planning.rest``), and its sensors may be off by the difference to 0.02."""
STILL_JOINTS = 0.5  #: Joint speed [rad/s] below which a leg counts as still
HEIGHT_TOLERANCE = 0.02  #: Distance [m] from the asked height that still counts as there
ANGLE_TOLERANCE = 0.1  #: Angle [rad] from the asked attitude that still counts as there
LYING_HEIGHT = 0.13  #: Height [m] of the base above the lowest foot below which the robot is down
SETTLED = 0.015
"""Height [m] of the base above where it goes limp below which the belly is down: that of a file
with other hulls lies 1 cm higher."""
LYING_TILT = 0.5  #: Angle [rad] from the vertical below which a robot lies on its belly
LEANING = 0.4
"""Tilt [rad] beyond which a robot sits, or tips over, and does not stand: twice a steep slope's."""
MOVING_SPEED = 0.3
"""Speed [m/s] of the base beyond which a robot moves: one that stood sinks as fast after 0.1 s."""
FOLD_TOLERANCE = 0.5  #: Angle [rad] from the tucked legs' joints that still counts as folded


def unfolded_legs(snapshot: Snapshot) -> list[Leg]:
    """The legs that are not folded below the trunk, so that the robot must not rise on them."""
    off = np.abs(snapshot.state.joint_positions - snapshot.profile.tucked_joints)
    return [leg for leg in LEGS if off[leg.joints].max() > FOLD_TOLERANCE]


def ground_height(snapshot: Snapshot) -> float:
    """Height [m] of the ground below the lowest foot."""
    return float(snapshot.p_world_feet[:, 2].min() - snapshot.foot_radius)


def base_height(snapshot: Snapshot) -> float:
    """Height [m] of the base above the ground."""
    return float(snapshot.state.q[2]) - ground_height(snapshot)


def com_height(snapshot: Snapshot) -> float:
    """Height [m] of the centre of mass above the plane through the feet, straight below it.

    On a slope or with feet on steps the lowest foot says little.
    """
    return _over_feet(snapshot, snapshot.p_world_com)


def _over_feet(snapshot: Snapshot, p_world: Float[np.ndarray, "3"]) -> float:
    """Height [m] of a point above the plane through the feet, straight below it."""
    feet = snapshot.p_world_feet - p_world
    plane = np.column_stack([np.ones(4), feet[:, :2]])
    below = np.linalg.lstsq(plane, feet[:, 2], rcond=None)[0]
    return float(snapshot.foot_radius) - float(below[0])


def calm(snapshot: Snapshot) -> Limited:
    """What is asked of a robot that has walked and rests: of its CoM."""
    return {"CoM speed [m/s]": (float(np.linalg.norm(snapshot.v_world_com)), CALM_SPEED)}


def _still(snapshot: Snapshot) -> Limited:
    """What is asked of a robot at rest: of base and joints."""
    v = snapshot.state.v
    return {
        "base speed along an axis [m/s]": (float(np.abs(v[:3]).max()), STILL_SPEED),
        "joint speed [rad/s]": (float(np.abs(v[6:]).max()), STILL_JOINTS),
    }


def _on_its_feet(snapshot: Snapshot, height_error: float, pitch: float) -> Limited:
    roll, measured_pitch, _ = snapshot.state.rpy
    angle = np.degrees(max(abs(roll), abs(measured_pitch - pitch)))
    return {
        "height error [m]": (abs(height_error), HEIGHT_TOLERANCE),
        "attitude error [deg]": (float(angle), np.degrees(ANGLE_TOLERANCE)),
        "feet in the air": (float((~snapshot.state.feet_in_contact).sum()), 1.0),
        **_still(snapshot),
    }


def standing(snapshot: Snapshot) -> Limited:
    """What is asked of a robot that stands: still, on four feet, level, at its height."""
    return _on_its_feet(snapshot, com_height(snapshot) - snapshot.profile.stand_height, 0.0)


def sitting(snapshot: Snapshot) -> Limited:
    """What is asked of a robot that sits: still, rump down, trunk up, four feet on the ground."""
    height, pitch = snapshot.profile.sit
    over = _over_feet(snapshot, snapshot.state.p_world_base)
    return _on_its_feet(snapshot, over - height, pitch)


def lying(snapshot: Snapshot) -> Limited:
    """What is asked of a robot that lies: still, on its belly."""
    return {
        "base height [m]": (base_height(snapshot), snapshot.profile.lie_height + SETTLED),
        "tilt [deg]": (float(np.degrees(snapshot.state.tilt)), np.degrees(LYING_TILT)),
        **_still(snapshot),
    }


def is_standing(snapshot: Snapshot) -> bool:
    """Whether the robot stands still on four feet, level, at the standing height."""
    return are_within(standing(snapshot))


def why_not_standing(snapshot: Snapshot) -> str:
    """Why a robot that nobody balances does not stand on its feet; empty if it does."""
    state, feet, p_com = snapshot.state, snapshot.p_world_feet[:, :2], snapshot.p_world_com[:2]
    height, speed = base_height(snapshot), float(np.linalg.norm(state.v[:3]))
    if height < LYING_HEIGHT:
        return f"it lies, its base {height:.2f} m above its feet"
    if state.tilt > LEANING:
        return f"its trunk is tilted by {np.degrees(state.tilt):.0f} deg"
    if raised := [leg.name for leg in LEGS if not state.feet_in_contact[leg]]:
        return f"{' and '.join(raised)} in the air"
    if speed > MOVING_SPEED:
        return f"it moves at {speed:.2f} m/s"
    return "" if support_margin(feet, p_com) > 0.0 else "its CoM is not above its feet"


def posture_measurements(snapshot: Snapshot) -> dict[str, float]:
    """The measured quantities behind the verdicts above, by name with unit."""
    roll, pitch, yaw = np.degrees(snapshot.state.rpy).tolist()
    return {
        "base height [m]": base_height(snapshot),
        "CoM height [m]": com_height(snapshot),
        "roll [deg]": roll,
        "pitch [deg]": pitch,
        "yaw [deg]": yaw,
        "feet in contact": float(snapshot.state.feet_in_contact.sum()),
        "base speed [m/s]": float(np.linalg.norm(snapshot.state.v[:3])),
    }
