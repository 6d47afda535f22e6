"""Identifies the friction of every joint of a robot that lies on its belly.

The legs are turned over the back, where they touch nothing. Then each joint in turn, of all four
legs at once, is moved back and forth by its servo at several constant speeds. The motor's torque
beyond gravity and inertia is friction: with the joint rows of the bias h (the trunk's contacts act
on the rows of the base only),

    tau - h = dry * sign(v) + viscous * v + offset.

Half the difference of the means of both directions is free of the offset, which contains the errors
of the model (Swevers, Verdonck & De Schutter, Dynamic model identification for industrial robots,
2007). A least-squares line through these values over the speeds gives dry and viscous.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Curve
from go2_wbc.errors import PlantError, PlantTimeout
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.plant.base import Plant
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.state import JointCommand, RobotState

SPEEDS = (0.25, 0.5, 1.0, 1.5)
"""Joint speeds [rad/s]; the dry part shows at the low ones, the viscous part at the high ones."""
CYCLES = (1, 1, 2, 3)  #: How often a joint goes to and fro at each
AMPLITUDE = 0.4  #: Half the way [rad] of a joint
STEADY = 0.5  #: Share of each way, around its middle, in which the servo has settled on the speed
OVER_THE_BACK = (0.5, 2.6, -1.75)
"""Angles [rad] of a left leg's joints amid their ways: thigh backwards and up, foot in the air."""
OUTWARDS = 0.6  #: Hip angle [rad] of a left leg at which it swings past trunk and ground
FOLDED = (0.3, 1.30, -2.66)
"""Angles [rad] of a left leg's joints in the end: folded beside the trunk."""
TILT, HEIGHT = 0.35, 0.13
"""Tilt [rad], and height [m] of the base over the lowest foot, below which the robot lies."""
DAMPING, LIMP_TIME = 3.0, 0.3
"""Damping [N m s/rad] of the limp robot, and for how long [s] it is sent in the end."""
VISCOUS_SHARE = 0.75
"""Share of the viscous friction that is fed forward: too much of it puts power into the joint."""
CERTAIN = 2.0  #: Standard errors by which the viscous friction might be less than was measured
KP, KD = 80.0, 3.0
"""Stiffness [N m/rad] and damping [N m s/rad] of the servo: dry friction of 1.4 N m holds it off by
1 deg."""
SPEED_TOLERANCE = 0.2  #: Share by which a joint may miss the speed that it shall have
MISFIT = 0.1
"""Difference [N m] between the measured friction and the straight line, root mean square, beyond
which the line says nothing."""


@dataclass(frozen=True, slots=True)
class FrictionEstimate:
    """What was identified: FL hip, thigh, calf, then FR, RL, RR."""

    dry: Float[np.ndarray, "12"]  #: friction [N m]
    viscous: Float[np.ndarray, "12"]  #: friction [N m s/rad]
    dry_error: Float[np.ndarray, "12"]  #: standard error of the dry one
    viscous_error: Float[np.ndarray, "12"]  #: standard error of the viscous one

    @property
    def feed_forward(self) -> JointFriction:
        """What to feed forward: the dry friction, and of the viscous one what cannot harm."""
        certain = np.maximum(self.viscous - CERTAIN * self.viscous_error, 0.0)
        viscous = np.round(VISCOUS_SHARE * certain, 3)
        return JointFriction(tuple(np.round(self.dry, 3).tolist()), tuple(viscous.tolist()))

    def toml(self) -> str:
        """``feed_forward`` for the configuration file."""
        friction = self.feed_forward
        rows = [
            f"{name} = [{', '.join(f'{value:g}' for value in values)}]"
            for name, values in (("dry", friction.dry), ("viscous", friction.viscous))
        ]
        return "\n".join(["[wbc.joint_friction]", *rows]) + "\n"


def identify_friction(
    plant: Plant, on_progress: Callable[[float], None] = lambda _: None
) -> FrictionEstimate:
    """Move every joint of a robot that lies, and say what friction it has.

    Takes about a minute of the plant's time and ends with folded legs, limp. Drives ``plant`` by
    itself: no controller may drive it meanwhile.

    Args:
        plant: lies on its belly with room of 0.5 m around it.
        on_progress: is called with the share that is done, 0 to 1.

    Raises:
        PlantError: if the robot does not lie, a joint does not follow, a foot meets something, or
            the friction is no sum of a dry and a viscous part; or the plant's own.
    """
    sweep = _Sweep(plant)
    sweep.require_lying()
    measured = np.zeros((12, len(SPEEDS), 2))
    try:
        sweep.go_to(1.0, _all_legs((OUTWARDS, FOLDED[1], FOLDED[2])))
        sweep.go_to(1.5, _all_legs((OUTWARDS, *OVER_THE_BACK[1:])))
        sweep.go_to(1.0, _all_legs(OVER_THE_BACK))
        for part in range(3):
            for index, (speed, cycles) in enumerate(zip(SPEEDS, CYCLES, strict=True)):
                measured[part::3, index] = sweep.to_and_fro(part, speed, cycles)
                on_progress((part * len(SPEEDS) + index + 1) / (3 * len(SPEEDS)))
        sweep.go_to(1.0, _all_legs((OUTWARDS, *OVER_THE_BACK[1:])))
        sweep.go_to(1.5, _all_legs((OUTWARDS, FOLDED[1], FOLDED[2])))
        sweep.go_to(0.5, _all_legs(FOLDED))
    finally:
        sweep.go_limp()
    return fitted(measured[:, :, 0], measured[:, :, 1])


def fitted(
    speeds: Float[np.ndarray, "12 n"], frictions: Float[np.ndarray, "12 n"]
) -> FrictionEstimate:
    """Dry and viscous friction of each joint, by least squares.

    Args:
        speeds: measured [rad/s], at least three for each joint.
        frictions: measured there [N m].

    Raises:
        PlantError: if the measurements of a joint lie on no line, or it has negative friction.
    """
    values, errors = np.zeros((2, 12)), np.zeros((2, 12))
    for joint, (speed, friction) in enumerate(zip(speeds, frictions, strict=True)):
        A = np.column_stack([np.ones_like(speed), speed])
        values[:, joint] = np.linalg.lstsq(A, friction, rcond=None)[0]
        left = friction - A @ values[:, joint]
        off = float(np.sqrt(np.mean(left * left)))
        if not off <= MISFIT:
            raise PlantError(
                f"the friction of {JOINT_NAMES[joint]} is no sum of a dry and a viscous part: off "
                f"by {off:.3f} N m, at most {MISFIT:g}; does the leg touch anything?"
            )
        variance = float(left @ left) / (len(speed) - 2)
        errors[:, joint] = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    for name, row, error in zip(("dry", "viscous"), values, errors, strict=True):
        joint = int(np.argmin(row + CERTAIN * error))
        if row[joint] < -CERTAIN * error[joint] - MISFIT:
            raise PlantError(
                f"the {name} friction of {JOINT_NAMES[joint]} came out as {row[joint]:.3f}, below "
                "0: are the signs of the plant's torques and speeds right?"
            )
    dry, viscous = np.maximum(values, 0.0)
    return FrictionEstimate(dry, viscous, *errors)


class _Sweep:
    """Moves the joints of one plant, tick by tick."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._model = RobotModel(find_description(robot=plant.robot))
        self._state: RobotState = plant.read()
        self._target = self._state.joint_positions.copy()

    def require_lying(self) -> None:
        """Raise PlantError unless the robot lies on its belly."""
        snapshot = self._model.snapshot(self._state)
        height = float(self._state.q[2] - snapshot.p_world_feet[:, 2].min())
        if self._state.tilt > TILT or height > HEIGHT:
            raise PlantError(
                f"lay the robot on its belly: it is tilted by {np.degrees(self._state.tilt):.0f} "
                f"deg, its base {height:.2f} m above its lowest foot"
            )

    def go_to(self, duration: float, target: Float[np.ndarray, "12"]) -> None:
        """Move all joints to ``target`` within ``duration`` seconds."""
        curve = Curve((0.0, duration), (self._target, target))
        for t in self._ticks(duration):
            point = curve.at(t)
            self._servo(point.value, point.rate)
        self._target = target

    def to_and_fro(self, part: int, speed: float, cycles: int) -> Float[np.ndarray, "4 2"]:
        """Mean speed [rad/s] and friction [N m] of each leg's joint ``part``."""
        centre, joints = self._target, np.arange(part, 12, 3)
        way = 2 * AMPLITUDE / speed
        samples: dict[bool, list[Float[np.ndarray, "2 4"]]] = {True: [], False: []}
        self._shift(centre, joints, -AMPLITUDE)
        for t in self._ticks(2 * way * cycles):
            u = t / way % 2.0
            is_forward = u < 1.0
            offset = AMPLITUDE * (2 * u - 1 if is_forward else 3 - 2 * u)
            q, v = centre.copy(), np.zeros(12)
            q[joints] += offset
            v[joints] = speed if is_forward else -speed
            self._servo(q, v)
            if abs(offset) < STEADY * AMPLITUDE:
                samples[is_forward].append(self._sample(joints))
        self._shift(centre, joints, 0.0)
        forth, back = (np.mean(samples[way_], axis=0) for way_ in (True, False))
        v, friction = (forth - back) / 2
        self._require_followed(joints, v, speed)
        return np.column_stack([v, friction])

    def _shift(self, centre: Float[np.ndarray, "12"], joints: np.ndarray, offset: float) -> None:
        target = centre.copy()
        target[joints] += offset
        self.go_to(0.4, target)

    def _sample(self, joints: np.ndarray) -> Float[np.ndarray, "2 4"]:
        """Speed, and what the motors give beyond the bias."""
        state = self._state
        if state.feet_in_contact.any():
            names = ", ".join(leg.foot for leg in LEGS if state.feet_in_contact[leg])
            raise PlantError(f"{names} must be in the air to identify friction, but touches")
        if not state.tau.any():
            raise PlantError("the plant does not say what torques its motors give")
        snapshot = self._model.snapshot(state)
        beyond = state.tau - snapshot.bias[6:]
        return np.array([state.joint_velocities[joints], beyond[joints]])

    def _require_followed(
        self, joints: np.ndarray, v: Float[np.ndarray, "4"], speed: float
    ) -> None:
        worst = int(np.abs(v - speed).argmax())
        if abs(v[worst] - speed) > SPEED_TOLERANCE * speed:
            raise PlantError(
                f"{JOINT_NAMES[joints[worst]]} moved at {v[worst]:.2f} rad/s instead of "
                f"{speed:g}: is it free to move?"
            )

    def _ticks(self, duration: float) -> Iterator[float]:
        """Times from now on; after each, one control period must be let pass."""
        start = self._state.time
        for _ in range(2 * math.ceil(duration / self._plant.control_period)):
            t = self._state.time - start
            if t >= duration:
                return
            yield t
        raise PlantTimeout(f"the plant's clock stands still at t={self._state.time:.3f} s")

    def _servo(self, q: Float[np.ndarray, "12"], v: Float[np.ndarray, "12"]) -> None:
        self._plant.write(JointCommand.servo(q, v, KP, KD))
        self._state = self._plant.read()

    def go_limp(self) -> None:
        """Damp the joints, as far as the plant still obeys."""
        with suppress(PlantError):
            for _ in range(round(LIMP_TIME / self._plant.control_period)):
                self._plant.write(JointCommand.damping(DAMPING))


def _all_legs(left: tuple[float, float, float]) -> Float[np.ndarray, "12"]:
    """A left leg's angles for all legs; the hips of the right ones mirrored."""
    return np.concatenate([np.array(left) * (leg.side, 1.0, 1.0) for leg in LEGS])
