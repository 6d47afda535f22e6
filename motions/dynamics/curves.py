"""Dynamic plans as piecewise polynomials that can be looked at at any time.

The solver integrates by semi-implicit Euler, q[k+1] = q[k] + dt v[k+1]: its velocities belong to
the middle of its configurations (the leapfrog scheme; Hairer, Lubich & Wanner 2003). Taken half a
step back, configurations and velocities fit each other to second order, and the cubic through two
knots with their rates is the parabola of the plan's own acceleration, constant from one knot to the
next. Through configurations as they stand it would swing between 4 and -2 times that, and a spline
over several knots would smear a touchdown over its neighbours; both invent torques.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline, PPoly

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory

COM, ATTITUDE, JOINTS, FEET = slice(0, 3), slice(3, 6), slice(6, 18), slice(18, 30)
"""Columns of ``pieces``: CoM [m], roll, pitch, yaw [rad], joints [rad], feet's centres [m]."""
_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def pieces(trajectory: DynamicTrajectory, model: RobotModel) -> PPoly:
    """Cubics from knot to knot of CoM, attitude, joints and feet: (30,), in the plan's frame.

    Positions and rates are continuous, accelerations change at knots only. Roll, pitch and yaw
    pass through all angles; they are not to be used within a few degrees of a vertical trunk.
    """
    cubics = CubicHermiteSpline(trajectory.times, *sampled(trajectory, model))
    return PPoly(cubics.c, cubics.x)


def sampled(
    trajectory: DynamicTrajectory, model: RobotModel
) -> tuple[Float[np.ndarray, "n1 30"], Float[np.ndarray, "n1 30"]]:
    """Values and rates of what ``pieces`` gives, at the knots; whole turns add up."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    q, v = centred(trajectory, model), trajectory.v
    values, rates = np.empty((len(q), 30)), np.empty((len(q), 30))
    for row in range(len(q)):
        pin.centerOfMass(pin_model, data, q[row], v[row])
        values[row, COM], rates[row, COM] = data.com[0], data.vcom[0]
        R = pin.Quaternion(q[row, 3:7]).toRotationMatrix()
        values[row, ATTITUDE] = rpy = pin.rpy.matrixToRpy(R)
        rates[row, ATTITUDE] = pin.rpy.computeRpyJacobianInverse(rpy) @ v[row, 3:6]
    values[:, ATTITUDE] = np.unwrap(values[:, ATTITUDE], axis=0)
    values[:, JOINTS], rates[:, JOINTS] = q[:, 7:], v[:, 6:]
    places, velocities = feet_at(q, v, model)
    values[:, FEET], rates[:, FEET] = places.reshape(-1, 12), velocities.reshape(-1, 12)
    return values, rates


def feet_at(
    q: Float[np.ndarray, "n 19"], v: Float[np.ndarray, "n 18"], model: RobotModel
) -> tuple[Float[np.ndarray, "n 4 3"], Float[np.ndarray, "n 4 3"]]:
    """Places [m] and velocities [m/s] of the feet's centres, in the frame in which ``q`` is."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
    places, velocities = np.empty((len(q), 4, 3)), np.empty((len(q), 4, 3))
    for row in range(len(q)):
        pin.forwardKinematics(pin_model, data, q[row], v[row])
        pin.updateFramePlacements(pin_model, data)
        for leg, frame in enumerate(frames):
            velocity = pin.getFrameVelocity(pin_model, data, frame, _ALIGNED)
            places[row, leg], velocities[row, leg] = data.oMf[frame].translation, velocity.linear
    return places, velocities


def centred(trajectory: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n1 19"]:
    """Configurations to which the knots' velocities belong: half a step back from the solver's."""
    q = trajectory.q.copy()
    for row, dt in enumerate(np.diff(trajectory.times).tolist(), start=1):
        q[row] = pin.integrate(model.pin_model, q[row], -0.5 * dt * trajectory.v[row])
    return q
