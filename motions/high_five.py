"""High five: shift onto three legs, raise a front paw, hold it, tap, and come back to standing.

The poses are found by inverse kinematics with the CoM kept well inside the three supporting feet.
The raised leg is tracked in joint space, since a Cartesian paw task crosses a singularity of the
leg at hip height; it goes up knee first. The numbers come from a search over trunk attitude, height
and paw position for large margins at once: CoM to the edges of the support triangle, load of the
lightest foot, static torque, distance of every joint to its limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import ContactSchedule
from go2_wbc.curves import keyframes
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Stance, TrackedPoint
from go2_wbc.robot.inverse_kinematics import PoseSolution, PoseTargets, solve_pose
from go2_wbc.robot.model import RobotModel
from motions.plan import KeyframePlan
from motions.postures import STAND_HEIGHT, STAND_POSE

SHIFT_TIME, UNLOAD_TIME, LIFT_TIME, TAP_TIME = 1.2, 0.4, 1.2, 0.35
"""Duration [s] of each phase; coming back takes the same."""
TAPS = 2
"""How often the held paw taps."""


@dataclass(frozen=True, slots=True)
class KeyPose:
    """A pose of the right high five; the left one mirrors it.

    Attributes:
        rpy: roll, pitch, yaw [rad] of the trunk.
        height: of the base [m].
        com_margin: least distance [m] of the CoM to the edges of the support triangle.
        paw: foot centre [m] of the raised leg from the middle of the feet, or
        joints: its joint angles [rad]; neither: the foot stands.
    """

    rpy: tuple[float, float, float]
    height: float
    com_margin: float
    paw: tuple[float, float, float] | None = None
    joints: tuple[float, float, float] | None = None


SHIFTED = KeyPose((-0.02, -0.07, -0.015), 0.315, 0.08)
FOLDED = KeyPose((-0.04, -0.16, -0.03), 0.325, 0.085, joints=(-0.10, -0.30, -2.0))
HELD = KeyPose((-0.07, -0.30, -0.05), 0.335, 0.085, paw=(0.37, -0.06, 0.64))
TAP = (0.0, 0.06, 0.12)
"""Change of the raised leg's joint angles [rad] in a tap: 3.4 cm ahead, 2.6 cm down."""


@dataclass(frozen=True, slots=True)
class HighFivePlan(KeyframePlan):
    """The plan of a high five.

    Attributes:
        leg: the front leg that is raised.
        hold_start, hold_end: when the paw is held still [s].
        paw_height: planned height [m] of the held paw's centre above the ground.
    """

    leg: Leg = Leg.FR
    hold_start: float = 0.0
    hold_end: float = 0.0
    paw_height: float = 0.0


@dataclass(frozen=True, slots=True)
class _Key:
    """One keyframe: when, the body's CoM position and attitude (6,), and the joints (12,)."""

    time: float
    body: Float[np.ndarray, "6"]
    joints: Float[np.ndarray, "12"]

    def later(self, seconds: float) -> _Key:
        return _Key(self.time + seconds, self.body, self.joints)


def high_five_plan(model: RobotModel, leg: Leg, hold: float = 2.0) -> HighFivePlan:
    """The high five of a front leg, with the paw held for ``hold`` seconds.

    Raises:
        IkError: if a pose is out of reach.
    """
    stand, shifted, folded, held, tapped = _poses(model, leg)
    keys = [stand, _at(SHIFT_TIME, shifted, stand)]
    keys.append(keys[-1].later(UNLOAD_TIME))
    lifted = keys[-1].time
    keys += [_at(LIFT_TIME / 2, folded, keys[-1]), _at(LIFT_TIME, held, keys[-1])]
    hold_start = keys[-1].time
    keys.append(keys[-1].later(hold))
    for _ in range(TAPS):
        keys.append(_at(TAP_TIME, tapped, keys[-1]))
        keys.append(_at(TAP_TIME, held, keys[-1]))
    keys += [_at(LIFT_TIME / 2, folded, keys[-1]), _at(LIFT_TIME, shifted, keys[-1])]
    landed = keys[-1].time
    keys.append(keys[-1].later(UNLOAD_TIME))
    keys.append(_at(SHIFT_TIME, stand, keys[-1]))
    modes = np.ones((3, 4), dtype=bool)
    modes[1, leg] = False
    times = [key.time for key in keys]
    return HighFivePlan(
        name="high five",
        entry=Stance.STAND,
        exit=Stance.STAND,
        point=TrackedPoint.COM,
        body=keyframes(times, [key.body for key in keys]),
        joints=keyframes(times, [key.joints for key in keys]),
        contacts=ContactSchedule((0.0, lifted, landed), modes),
        ramp=UNLOAD_TIME,
        leg=leg,
        hold_start=hold_start,
        hold_end=hold_start + hold,
        paw_height=HELD.paw[2] if HELD.paw else 0.0,
    )


def _at(duration: float, pose: _Key, previous: _Key) -> _Key:
    return _Key(previous.time + duration, pose.body, pose.joints)


def _poses(model: RobotModel, leg: Leg) -> tuple[_Key, _Key, _Key, _Key, _Key]:
    feet = model.p_base_feet_nominal.copy()
    feet[:, 2] = model.foot_radius
    start = _standing_guess()
    stand = _Key(0.0, STAND_POSE, start[7:])
    shifted, folded, held = (
        solve_pose(model, _targets(pose, leg, feet), start) for pose in (SHIFTED, FOLDED, HELD)
    )
    joints = held.q[7:].copy()
    joints[leg.joints] += _mirrored(TAP, leg)
    tapped = _Key(0.0, _body(held, HELD, leg), joints)
    return (
        stand,
        _Key(0.0, _body(shifted, SHIFTED, leg), shifted.q[7:]),
        _Key(0.0, _body(folded, FOLDED, leg), folded.q[7:]),
        _Key(0.0, _body(held, HELD, leg), held.q[7:]),
        tapped,
    )


def _targets(pose: KeyPose, leg: Leg, feet: Float[np.ndarray, "4 3"]) -> PoseTargets:
    roll, pitch, yaw = pose.rpy
    mirror = -leg.side
    is_raised = pose.paw is not None or pose.joints is not None
    paw = pose.paw and (pose.paw[0], mirror * pose.paw[1], pose.paw[2])
    joints = pose.joints and (mirror * pose.joints[0], pose.joints[1], pose.joints[2])
    return PoseTargets(
        p_world_feet=feet,
        rpy=(mirror * roll, pitch, mirror * yaw),
        height=pose.height,
        raised=leg if is_raised else None,
        p_world_paw=paw,
        q_raised=joints,
        support=tuple(other for other in LEGS if other is not leg),
        com_margin=pose.com_margin,
    )


def _mirrored(joints: tuple[float, float, float], leg: Leg) -> Float[np.ndarray, "3"]:
    return np.array([-leg.side * joints[0], joints[1], joints[2]])


def _body(solution: PoseSolution, pose: KeyPose, leg: Leg) -> Float[np.ndarray, "6"]:
    roll, pitch, yaw = pose.rpy
    mirror = -leg.side
    return np.array([*solution.p_world_com, mirror * roll, pitch, mirror * yaw])


def _standing_guess() -> Float[np.ndarray, "19"]:
    q = np.zeros(19)
    q[2], q[6] = STAND_HEIGHT + 0.01, 1.0
    q[7:] = np.tile([0.0, 0.8, -1.6], 4)
    return q
