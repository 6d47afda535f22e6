"""What a dynamic plan keeps and what it breaks, measured on the plan itself.

Nothing here trusts the solver: the defects are those of the equations of motion at every knot, by
Pinocchio's inverse dynamics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory

_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, slots=True)
class Reading:
    """The worst of one quantity over a plan.

    Attributes:
        name: of the quantity.
        value: the worst.
        limit: what it must not exceed; for what must not fall below, both are negative.
        unit: of both.
        subject: whose it is.
        time: when [s].
    """

    name: str
    value: float
    limit: float
    unit: str
    subject: str
    time: float

    @property
    def is_kept(self) -> bool:
        """Whether the limit is kept."""
        return self.value <= self.limit

    def __str__(self) -> str:
        sign = "" if self.limit >= 0.0 else "-"
        value, limit = (abs(number) for number in (self.value, self.limit))
        if self.limit < 0.0 < self.value:
            sign, value = "+", self.value
        word = "at most" if self.limit >= 0.0 else "at least"
        shown = f"{value:.3g}" if sign != "+" else f"-{value:.3g}"
        return (
            f"{self.name} of {self.subject} at {self.time:.2f} s: {shown} {self.unit}, "
            f"{word} {limit:.3g}"
        )


DEFECT = 1e-3
"""What is left of the equations of motion [N, N m], at most."""
FRICTION = 0.55
"""Tangential over normal force."""
PULL = 1.0
"""Of the ground [N]."""
PENETRATION = 0.005
"""Of a foot in the air into the ground [m]."""
SLIP = 0.02
"""Of a standing foot, from where it touched down [m]."""
TOUCHDOWN = 1.0
"""Speed of a foot [m/s]."""
ROTATION = 0.2
"""Difference [rad] between the integrated rate and the change of attitude."""


def audit(trajectory: DynamicTrajectory, model: RobotModel) -> tuple[Reading, ...]:
    """The worst of everything that a plan must keep."""
    return _Audit(trajectory, model).readings()


class _Audit:
    def __init__(self, trajectory: DynamicTrajectory, model: RobotModel) -> None:
        self._plan, self._model = trajectory, model

    def readings(self) -> tuple[Reading, ...]:
        plan, model = self._plan, self._model
        ends = plan.v[:-1, 6:], plan.v[1:, 6:]  # a torque holds through its step
        tau_share = np.max([model.motor.share(plan.tau, v) for v in ends], axis=0)
        speed = np.abs(plan.v[:, 6:]) / model.speed_limits
        joints = plan.q[:, 7:]
        beyond = np.maximum(model.q_lower - joints, joints - model.q_upper)
        normal = plan.forces[:, :, 2]
        tangential = np.hypot(plan.forces[:, :, 0], plan.forces[:, :, 1])
        ratio = np.where(normal > 1.0, tangential / np.maximum(normal, 1.0), 0.0)
        feet, names = FOOT_NAMES, JOINT_NAMES
        return (
            self._worst("defect", defects(plan, model), DEFECT, "N or N m", _ROWS),
            self._worst("friction", ratio, FRICTION, "", feet),
            self._worst("pull of the ground", -normal, PULL, "N", feet),
            self._worst("torque share", tau_share, 1.0, "", names),
            self._worst("speed share", speed, 1.0, "", names),
            self._worst("angle beyond its limit", beyond, 0.0, "rad", names),
            self._worst("depth under ground", self._depth(), PENETRATION, "m", feet),
            self._worst("slip", self._slip(), SLIP, "m", feet),
            self._worst("touchdown speed", self._touchdown(), TOUCHDOWN, "m/s", feet),
            self._rotation(),
        )

    def _worst(
        self, name: str, values: Float[np.ndarray, "n k"], limit: float, unit: str,
        subjects: tuple[str, ...],
    ) -> Reading:  # fmt: skip
        row, column = np.unravel_index(int(np.argmax(values)), values.shape)
        time = float(self._plan.times[row])
        return Reading(name, float(values[row, column]), limit, unit, subjects[column], time)

    def _depth(self) -> Float[np.ndarray, "n1 4"]:
        """Of the feet in the air; one that stands in a step does so until the step's end."""
        stance = self._plan.stance
        stands = np.vstack([stance, stance[-1:]]) | np.vstack([stance[:1], stance])
        depth = self._model.foot_radius - self._plan.p_feet[:, :, 2]
        return np.where(stands, 0.0, depth)

    def _slip(self) -> Float[np.ndarray, "n1 4"]:
        """Distance of each standing foot from where it began to stand."""
        plan = self._plan
        slip = np.zeros((len(plan.times), 4))
        for leg in LEGS:
            place = plan.p_feet[0, leg]
            for row, stands in enumerate(plan.stance[:, leg]):
                if not stands:
                    place = plan.p_feet[row + 1, leg]
                else:
                    slip[row + 1, leg] = np.linalg.norm(plan.p_feet[row + 1, leg] - place)
        return slip

    def _touchdown(self) -> Float[np.ndarray, "n 4"]:
        plan, model = self._plan, self._model
        pin_model, data = model.pin_model, model.pin_model.createData()
        frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
        speeds = np.zeros((len(plan.stance), 4))
        for row in range(1, len(plan.stance)):
            lands = plan.stance[row] & ~plan.stance[row - 1]
            if lands.any():
                pin.forwardKinematics(pin_model, data, plan.q[row], plan.v[row])
            for leg in np.flatnonzero(lands).tolist():
                velocity = pin.getFrameVelocity(pin_model, data, frames[leg], _ALIGNED)
                speeds[row, leg] = np.linalg.norm(velocity.linear)
        return speeds

    def _rotation(self) -> Reading:
        """A turn by 360 deg looks like none; the integrated yaw and tilt rates tell them apart."""
        plan = self._plan
        R = np.eye(3) if not len(plan.q) else pin.Quaternion(plan.q[0, 3:7]).toRotationMatrix()
        worst = 0.0
        for row, dt in enumerate(np.diff(plan.times)):
            step = plan.v[row + 1, 3:6] * dt
            R = R @ pin.exp3(step)
            measured = pin.Quaternion(plan.q[row + 1, 3:7]).toRotationMatrix()
            worst = max(worst, float(np.linalg.norm(pin.log3(R.T @ measured))))
        return Reading("integrated rotation", worst, ROTATION, "rad", "trunk", plan.duration)


_ROWS = (*(f"trunk {axis}" for axis in ("x", "y", "z", "roll", "pitch", "yaw")), *JOINT_NAMES)


def defects(trajectory: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n 18"]:
    """|M a + h - S' tau - J' f| of every knot [N, N m], with a from the velocities of its ends."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
    plan = trajectory
    found = np.empty((len(plan.tau), 18))
    for row, dt in enumerate(np.diff(plan.times).tolist()):
        q, v = plan.q[row], plan.v[row]
        wanted = pin.rnea(pin_model, data, q, v, (plan.v[row + 1] - v) / dt)
        wanted[6:] -= plan.tau[row]
        pin.computeJointJacobians(pin_model, data, q)
        for leg, frame in enumerate(frames):
            J = pin.getFrameJacobian(pin_model, data, frame, _ALIGNED)[:3]
            wanted -= J.T @ plan.forces[row, leg]
        found[row] = np.abs(wanted)
    return found
