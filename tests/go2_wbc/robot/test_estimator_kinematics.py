"""The state estimator on a motion that is known exactly: readings without noise or simulation.

The trunk sways and turns every way at once while three feet roll on the ground; the fourth is in
the air and kicks. The joints' rates follow from the feet's Jacobians, and nothing of the filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.estimator import IMU_FRAME, EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from go2_wbc.robot.state import RobotState
from tests.engine_helpers import state_of

TICK, COUNT = 0.002, 700  # s; of readings
STANDING = 0.4  # s
NUDGE = 1e-4  # s; of differences
# m/s and m. The filter takes the acceleration as constant over a tick.
SPEED_ERROR, PLACE_ERROR = 3e-3, 2e-3
TURNING_ERROR, TILT_ERROR = 2e-3, 2e-3  # rad/s, rad
IN_THE_AIR = Leg.FL
CONTACT_FORCE = EstimatorConfig().touch


@dataclass(frozen=True, slots=True)
class Motion:
    """What was measured, and what was true."""

    readings: list[SensorReading]
    states: list[RobotState]


def pose(t: float) -> tuple[np.ndarray, np.ndarray]:
    """Place [m] and rotation of a trunk that is at rest first, by which gravity is known."""
    phase = np.array([0.7, 1.0, 1.3]) * 2.0 * np.pi * max(t - STANDING, 0.0)
    place = np.array([0.03, -0.02, 0.015]) * (1.0 - np.cos(phase)) + [0.0, 0.0, 0.27]
    rpy = np.array([0.10, 0.08, 0.15]) * (1.0 - np.cos(phase[::-1]))
    return place, rotation_from_rpy(*rpy)


def twist(t: float) -> np.ndarray:
    """Velocity (6,) of the trunk in its own frame."""
    (p0, R0), (_, R), (p1, R1) = pose(t - NUDGE), pose(t), pose(t + NUDGE)
    return np.concatenate([R.T @ (p1 - p0), log_rotation(R0.T @ R1)]) / (2.0 * NUDGE)


def imu_acceleration(t: float, p_base_imu: np.ndarray) -> np.ndarray:
    """Specific force [m/s^2] at the IMU in the base frame."""
    before, now, after = (p + R @ p_base_imu for p, R in map(pose, (t - NUDGE, t, t + NUDGE)))
    return pose(t)[1].T @ ((before - 2.0 * now + after) / NUDGE**2 + [0.0, 0.0, 9.81])


def state_at(t: float, joints: np.ndarray, model: RobotModel) -> RobotState:
    """The state in which the contact points of the standing feet do not move."""
    p, R = pose(t)
    q = np.concatenate([p, pin.Quaternion(R).coeffs(), joints])
    v = np.concatenate([twist(t), np.zeros(12)])
    J_contacts = model.snapshot(state_of(q)).J_contacts
    for leg in LEGS:
        columns = slice(6 + leg.joints.start, 6 + leg.joints.stop)
        J = J_contacts[leg]
        v[columns] = -np.linalg.solve(J[:, columns], J[:, :6] @ v[:6])
    v[6:][IN_THE_AIR.joints] = 2.0 * np.sin(9.0 * t) * np.array([1.0, -1.0, 1.0])
    return state_of(q, v, t)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def motion(model: RobotModel) -> Motion:
    data = model.pin_model.createData()
    pin.forwardKinematics(model.pin_model, data, pin.neutral(model.pin_model))
    frame = model.pin_model.getFrameId(IMU_FRAME)
    p_base_imu = np.array(pin.updateFramePlacement(model.pin_model, data, frame).translation)
    p_feet = model.p_base_feet_nominal.copy()
    p_feet[:, 2] = model.foot_radius - pose(0.0)[0][2]
    places = [leg_angles(LegGeometry.of(model, leg), p_feet[leg][None]).q[0] for leg in LEGS]
    joints, readings, states = np.concatenate(places), [], []
    for t in TICK * np.arange(COUNT):
        state = state_at(t, joints, model)
        halfway = state_at(t + TICK / 2, joints + TICK / 2 * state.joint_velocities, model)
        forces = np.full(4, 50.0)
        forces[IN_THE_AIR] = 0.0
        readings.append(
            SensorReading(
                time=t,
                gyro=state.v[3:6],
                accelerometer=imu_acceleration(t, p_base_imu),
                q_joints=joints,
                v_joints=state.joint_velocities,
                tau=np.arange(12.0),
                foot_forces=forces,
            )
        )
        states.append(state)
        joints = joints + TICK * halfway.joint_velocities
    return Motion(readings, states)


def test_place_and_speed_of_an_exactly_known_motion_are_found(
    motion: Motion, model: RobotModel
) -> None:
    estimator = StateEstimator(model, EstimatorConfig(compliance=1e-9))
    found = [estimator.update(reading) for reading in motion.readings]
    off_v = np.array([a.v - b.v for a, b in zip(found, motion.states, strict=True)])
    off_q = np.array([a.q - b.q for a, b in zip(found, motion.states, strict=True)])
    assert np.abs(off_v[50:, :3]).max() < SPEED_ERROR
    assert np.abs(off_q[:, :3]).max() < PLACE_ERROR
    assert np.abs(off_v[:, 3:6]).max() < TURNING_ERROR
    assert np.abs(off_q[:, 3:7]).max() < TILT_ERROR
    assert np.abs(off_v[:, 6:]).max() < 1e-12
    assert np.abs(off_q[:, 7:]).max() < 1e-12


def test_what_needs_no_estimate_is_passed_on(motion: Motion, model: RobotModel) -> None:
    reading = motion.readings[7]
    forces = np.array([0.0, CONTACT_FORCE, CONTACT_FORCE + 0.01, 40.0])
    scaled = replace(reading, foot_forces=forces)
    state = StateEstimator(model).update(scaled)
    assert state.time == reading.time
    assert state.tau.tolist() == reading.tau.tolist()
    assert state.foot_forces.tolist() == forces.tolist()
    assert state.feet_in_contact.tolist() == [False, False, True, True]
