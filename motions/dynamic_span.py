"""A solved dynamic block in a plan: where and when it takes place, and its curves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline, PPoly

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation, yaw_rotation
from motions.dynamics.trajectory import DynamicTrajectory

_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, slots=True)
class DynamicSpan:
    """Part of a plan that obeys the whole robot's dynamics.

    Attributes:
        start: when [s] it starts in the plan.
        trajectory: states, torques, forces, gains and deviation; in the plan's frame.
    """

    start: float
    trajectory: DynamicTrajectory

    @property
    def end(self) -> float:
        """When [s] it ends in the plan."""
        return self.start + self.trajectory.duration


def placed(trajectory: DynamicTrajectory, anchor: Anchor) -> DynamicTrajectory:
    """``trajectory`` with the frame of its problem put at ``anchor``."""
    R, turn = yaw_rotation(anchor.yaw), pin.Quaternion(yaw_rotation(anchor.yaw))
    q = trajectory.q.copy()
    q[:, :3] = anchor.p_world + q[:, :3] @ R.T
    q[:, 3:7] = [(turn * pin.Quaternion(xyzw)).coeffs() for xyzw in q[:, 3:7]]
    return replace(
        trajectory,
        q=q,
        forces=trajectory.forces @ R.T,
        p_feet=anchor.p_world + trajectory.p_feet @ R.T,
    )


def curves_of(
    trajectory: DynamicTrajectory, model: RobotModel, end: Float[np.ndarray, "30"]
) -> PPoly:
    """The curves of ``CompiledPlan`` that play ``trajectory``, from its start to rest at ``end``.

    The solver steps by semi-implicit Euler, q_k+1 = q_k + dt v_k+1: its q leads its v by half a
    step. A robot with its constant accelerations from knot to knot has the mean of both speeds on
    the way; the curves go where that robot goes, so that places, speeds and accelerations are each
    other's derivatives and change where the contacts do. What is left to ``end``, some millimetres,
    is made up for while the last phase stands.
    """
    times, v = trajectory.times, trajectory.v
    q = followed(trajectory, model)
    values, rates = _values_and_rates(q, v, model)
    moves = ~trajectory.stance.all(axis=1)
    first = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
    values[:, 5] += 2.0 * np.pi * np.round((end[5] - values[-1, 5]) / (2.0 * np.pi))
    _lead_to(end, times, values, rates, first)
    return CubicHermiteSpline(times, values, rates)


def followed(trajectory: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n1 19"]:
    """Where the robot comes by the speeds of ``trajectory``, each step with the mean of both."""
    q = trajectory.q.copy()
    steps = np.diff(trajectory.times)[:, None] * 0.5 * (trajectory.v[1:] + trajectory.v[:-1])
    for row, step in enumerate(steps):
        q[row + 1] = pin.integrate(model.pin_model, q[row], step)
    return q


def _values_and_rates(
    q: Float[np.ndarray, "n 19"], v: Float[np.ndarray, "n 18"], model: RobotModel
) -> tuple[Float[np.ndarray, "n 30"], Float[np.ndarray, "n 30"]]:
    pin_model, data = model.pin_model, model.pin_model.createData()
    frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
    values, rates = np.empty((len(q), 30)), np.empty((len(q), 30))
    for row in range(len(q)):
        com = pin.centerOfMass(pin_model, data, q[row], v[row])
        pin.updateFramePlacements(pin_model, data)
        rpy = rpy_from_rotation(pin.Quaternion(q[row, 3:7]).toRotationMatrix())
        places = [data.oMf[frame].translation for frame in frames]
        speeds = [pin.getFrameVelocity(pin_model, data, frame, _ALIGNED).linear for frame in frames]
        values[row] = np.concatenate([com, rpy, q[row, 7:], *places])
        turning = _rpy_rates(rpy, v[row, 3:6])
        rates[row] = np.concatenate([data.vcom[0], turning, v[row, 6:], *speeds])
    values[:, 3:6] = np.unwrap(values[:, 3:6], axis=0)
    return values, rates


def _rpy_rates(
    rpy: Float[np.ndarray, "3"], w_base: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """Rates of roll, pitch, yaw [rad/s] from the angular velocity in the base frame.

    Craig, Introduction to Robotics, 3rd ed., eq. 5.44, in the base frame and solved for the rates.
    """
    roll, pitch, _ = rpy
    sr, cr, cp, tp = np.sin(roll), np.cos(roll), np.cos(pitch), np.tan(pitch)
    x, y, z = w_base
    return np.array([x + tp * (sr * y + cr * z), cr * y - sr * z, (sr * y + cr * z) / cp])


def _lead_to(
    end: Float[np.ndarray, "30"],
    times: Float[np.ndarray, " n"],
    values: Float[np.ndarray, "n 30"],
    rates: Float[np.ndarray, "n 30"],
    first: int,
) -> None:
    """Add cubics from nothing at knot ``first`` to what is left to ``end`` at the last one."""
    length = times[-1] - times[first]
    s = ((times[first:] - times[first]) / length)[:, None]
    off, slope = end - values[-1], -rates[-1] * length
    values[first:] += (3.0 * off - slope) * s**2 + (slope - 2.0 * off) * s**3
    rates[first:] += (2.0 * (3.0 * off - slope) * s + 3.0 * (slope - 2.0 * off) * s**2) / length
