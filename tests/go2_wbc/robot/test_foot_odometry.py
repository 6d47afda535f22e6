"""What legs tell, against Pinocchio and decision tables, and of a motion that is known exactly.

In the last the readings are without noise or simulation.
The trunk sways and turns every way at once while three feet roll on the ground; the fourth is in
the air and kicks. The joints' rates follow from the feet's Jacobians, and nothing of the filter.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.foot_odometry import (
    LEAST_TRUST,
    Foot,
    Level,
    follow_foot,
    height_off,
    see_foot,
    see_ground,
    see_slope,
)
from go2_wbc.robot.footprints import EACH, FAR
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import IMU_FRAME, RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from go2_wbc.robot.state import RobotState
from go2_wbc.robot.state_filter import FEET, Filter
from tests.engine_helpers import state_of

TICK, COUNT = 0.002, 700  # s; of readings
STANDING = 0.4  # s
NUDGE = 1e-4  # s; of differences
# m/s and m. The filter takes the acceleration as constant over a tick.
SPEED_ERROR, PLACE_ERROR = 3e-3, 2e-3
TURNING_ERROR, TILT_ERROR = 2e-3, 2e-3  # rad/s, rad
IN_THE_AIR = Leg.FL
CONTACT_FORCE = EstimatorConfig().contact_force


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


MODEL = RobotModel()


@pytest.fixture(scope="module")
def motion() -> Motion:
    data = MODEL.pin_model.createData()
    pin.forwardKinematics(MODEL.pin_model, data, pin.neutral(MODEL.pin_model))
    frame = MODEL.pin_model.getFrameId(IMU_FRAME)
    p_base_imu = np.array(pin.updateFramePlacement(MODEL.pin_model, data, frame).translation)
    p_feet = MODEL.p_base_feet_nominal.copy()
    p_feet[:, 2] = MODEL.foot_radius - pose(0.0)[0][2]
    places = [leg_angles(LegGeometry.of(MODEL, leg), p_feet[leg][None]).q[0] for leg in LEGS]
    joints, readings, states = np.concatenate(places), [], []
    for t in TICK * np.arange(COUNT):
        state = state_at(t, joints, MODEL)
        halfway = state_at(t + TICK / 2, joints + TICK / 2 * state.joint_velocities, MODEL)
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


def test_place_and_speed_of_an_exactly_known_motion_are_found(motion: Motion) -> None:
    estimator = StateEstimator(MODEL, EstimatorConfig(compliance=1e-9))
    found = [estimator.update(reading) for reading in motion.readings]
    off_v = np.array([a.v - b.v for a, b in zip(found, motion.states, strict=True)])
    off_q = np.array([a.q - b.q for a, b in zip(found, motion.states, strict=True)])
    assert np.abs(off_v[50:, :3]).max() < SPEED_ERROR
    assert np.abs(off_q[:, :3]).max() < PLACE_ERROR
    assert np.abs(off_v[:, 3:6]).max() < TURNING_ERROR
    assert np.abs(off_q[:, 3:7]).max() < TILT_ERROR
    assert np.abs(off_v[:, 6:]).max() < 1e-12
    assert np.abs(off_q[:, 7:]).max() < 1e-12


def test_what_needs_no_estimate_is_passed_on(motion: Motion) -> None:
    reading = motion.readings[7]
    forces = np.array([0.0, CONTACT_FORCE, CONTACT_FORCE + 0.01, 40.0])
    scaled = replace(reading, foot_forces=forces)
    state = StateEstimator(MODEL).update(scaled)
    assert state.time == reading.time
    assert state.tau.tolist() == reading.tau.tolist()
    assert state.foot_forces.tolist() == forces.tolist()
    assert state.feet_in_contact.tolist() == [False, False, True, True]


C = EstimatorConfig()


def unsure() -> Filter:
    f = Filter()
    f.P[:] = np.diag(np.arange(1.0, 28.0) ** 2 * 1e-4)
    f.x.v[:] = 0.1, -0.2, 0.3
    return f


@pytest.mark.parametrize(
    ("age", "force", "trust", "stays"),
    [
        (0.3, 0.9 * C.contact_force, LEAST_TRUST, False),
        (0.3, C.contact_force, LEAST_TRUST, False),
        (0.3, 0.5 * (C.contact_force + C.trusted_force), 0.5, True),
        (0.3, C.trusted_force, 1.0, True),
        (0.3, 2.0 * C.trusted_force, 1.0, True),
        (0.004, 2.0 * C.trusted_force, 1.0, True),
        (C.settled_time + 0.01, 2.0 * C.trusted_force, 1.0, True),
    ],
)
@pytest.mark.parametrize("rests", [False, True])
def test_how_far_a_foot_is_believed(
    *, age: float, force: float, trust: float, stays: bool, rests: bool
) -> None:
    f, dt, vertical, leg = unsure(), 0.002, 0.7, 2
    foot = Foot(age=age, rolling=[1.0, 2.0, 0.0], velocity=f.x.v, speed=0.4)
    before, begun = np.diag(f.P).copy(), age if stays else -dt
    assert follow_foot(f, foot, leg, force, dt, vertical, rests, C) == begun
    assert foot.age == begun + dt
    assert foot.carries is stays
    slip = C.touchdown_slip * np.exp(-max(begun, 0.0) / C.touchdown_time)
    creep = C.velocity_share * 0.4
    variance = (C.velocity / trust) ** 2 + slip**2 + creep**2 if stays else 0.0
    vertical += C.landing * np.exp(-max(begun, 0.0) / C.landing_time)
    risen = variance + vertical**2 if stays else 0.0
    np.testing.assert_allclose(foot.variance, [variance, variance, risen])
    own = C.settled_drift if begun > C.settled_time else C.foot_drift
    drift = own / trust + slip + C.drift_share * 0.4
    drifts = np.full(3, C.still_drift) if rests else drift + np.array([0.0, 0.0, vertical])
    expected = np.zeros(27)
    expected[FEET + 6 : FEET + 9] = (drifts * dt) ** 2
    np.testing.assert_allclose(np.diag(f.P) - before, expected, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(f.x.p_feet[leg], [0.002, 0.004, 0.0])


LEVELS = np.array([0.05, 0.13, 0.21, 0.29, -0.05, -0.15, -0.25, -0.35])  # m


@pytest.mark.parametrize("place", [0, 2, 7])
@pytest.mark.parametrize(
    ("off", "doubt", "told"),
    [(0.01, 0.0, True), (-0.01, 0.0, True), (0.01, 0.5, False), (0.013, 0.0, False)],
)
def test_a_foot_stands_on_a_level_that_is_known_or_the_ground_has_none(
    *, place: int, off: float, doubt: float, told: bool
) -> None:
    level, others = Level(heights=LEVELS, doubt_time=doubt), np.delete(LEVELS, place)
    found = height_off(level, LEVELS[place] - off, 1.0, C)
    assert found == (pytest.approx(off) if told else np.inf)
    follows = LEVELS[place] - (0.0 if told else 0.2 * off)
    assert level.heights == pytest.approx([follows, *others])  # as it was met last
    assert level.doubt_time == (C.uneven_time if abs(off) > C.terrace else doubt)


def test_a_step_is_a_level_that_nobody_knew_and_the_oldest_is_forgotten() -> None:
    level = Level(heights=LEVELS)
    assert height_off(level, 0.36, 1.0, C) == np.inf
    assert level.heights == pytest.approx([0.36, *LEVELS[:-1]])
    assert level.doubt_time == 0.0
    assert height_off(level, 0.362, 1.0, C) == pytest.approx(-0.002)


def test_a_height_that_is_too_sure_to_be_wrong_is_not_that_of_level_ground() -> None:
    for deviation, told in ((0.0034, True), (0.0033, False)):
        assert np.isfinite(height_off(Level(), 0.01, deviation**2, C)) == told


@pytest.mark.parametrize(
    ("before", "after", "looks"), [(0.9, 1.1, True), (0.7, 0.9, False), (1.0, 1.2, False)]
)
def test_the_ground_is_where_a_foot_met_it_once_that_has_settled(
    *, before: float, after: float, looks: bool
) -> None:
    """A foot sinks by up to 2 cm as it lands, and springs back for longer than 0.1 s."""
    f, foot, level = unsure(), Foot(), Level(heights=np.full(8, 0.004))
    f.x.p[2], force, radius = 0.3, 50.0, 0.022
    foot.place[2], foot.age = -0.276, 0.002
    see_ground(f, foot, 1, force, -0.002, radius, level, C)
    ground = 0.024 - radius + C.compliance * force
    assert (foot.met, foot.height_off) == (pytest.approx(ground), np.inf)
    foot.place[2], foot.age = -0.29, after * C.landing_time
    see_ground(f, foot, 1, force, before * C.landing_time, radius, level, C)
    assert foot.height_off == (pytest.approx(0.004 - ground) if looks else np.inf)
    assert foot.height_variance == (C.height**2 if looks else 0.0)


TILT = np.radians(20.0)
UPHILL = np.array([-np.sin(TILT), 0.0, np.cos(TILT)])


def test_a_foot_rolls_about_the_normal_of_the_ground_and_creeps_downhill() -> None:
    joints, w, R, radius, creep = (
        np.array([0.1, 0.8, -1.6]),
        np.array([0.2, 2.0, -0.3]),
        np.eye(3),
        0.02,
        0.03,
    )
    leg, still, c1 = LegGeometry.of(MODEL, Leg.FL), np.zeros(3), np.cos(0.1)
    rates = np.array([0.3, -0.4, 0.9])
    foot, upright = Foot(normal=UPHILL), Foot(normal=[0.0, 0.0, 1.0])
    see_foot(foot, leg, joints, rates, still, w, radius, creep, R)
    see_foot(upright, leg, joints, rates, still, w, radius, creep, R)
    turning = w + [rates[0], c1 * 0.5, np.sin(0.1) * 0.5]
    downhill = creep * np.sin(TILT) * np.array([-np.cos(TILT), 0.0, -np.sin(TILT)])
    rolling = np.cross(turning, radius * UPHILL) + downhill
    np.testing.assert_allclose(foot.rolling, rolling, atol=1e-12)
    np.testing.assert_allclose(upright.rolling, [0.02 * turning[1], -0.02 * turning[0], 0.0])
    np.testing.assert_allclose(foot.velocity - upright.velocity, foot.rolling - upright.rolling)


def on_a_slope(doubt: float, bend: float = 0.0) -> Level:
    """Ground on which the front feet came down all over, the hind feet behind."""
    rng, level = np.random.default_rng(4), Level(doubt_time=doubt)
    x = rng.uniform(-0.3, 0.3, 2 * EACH) - np.repeat([0.0, 0.6], EACH)
    level.prints[:, 0], level.prints[:, 1] = x, rng.uniform(-0.2, 0.2, 2 * EACH)
    level.prints[:, 2] = np.tan(TILT) * x + bend * np.sign(rng.standard_normal(2 * EACH))
    return level


@pytest.mark.parametrize(
    ("end", "doubt", "met", "told"),
    [
        (1, 1.0, 0.004, True),
        (1, 0.0, 0.004, False),  # it is in levels
        (0, 1.0, 0.004, False),  # no hind foot has come down there
        (1, 1.0, 0.1, False),  # it stands on something
    ],
)
def test_a_foot_on_a_slope_is_as_high_as_where_the_other_feet_came_down(
    *, end: int, doubt: float, met: float, told: bool
) -> None:
    level, foot = on_a_slope(doubt), Foot(met=met, height_off=np.inf)
    before = level.prints.copy()
    see_slope(foot, np.array([0.0, 0.0, met]), 1e-6, end, level)
    assert foot.height_off == (pytest.approx(-met, abs=1e-3) if told else np.inf)
    if told:
        assert 0.003**2 < foot.height_variance < 2.0 * 0.004**2
    own = slice(EACH * end, EACH * (end + 1))
    np.testing.assert_array_equal(level.prints[own][1:], before[own][:-1])
    assert level.prints[own][0].tolist() == [0.0, 0.0, met]


@pytest.mark.parametrize(
    ("doubt", "bend", "least"), [(1.0, 0.0, 0.95), (1.0, 0.1, 0.0), (0.0, 0.0, 0.0)]
)
def test_the_normal_is_that_of_the_plane_as_far_as_there_is_one(
    doubt: float, bend: float, least: float
) -> None:
    foot = Foot(met=0.0)
    see_slope(foot, np.zeros(3), 1e-6, 1, on_a_slope(doubt, bend))
    assert np.linalg.norm(foot.normal) == pytest.approx(1.0)
    assert least <= foot.normal[0] / UPHILL[0] < least + 0.06


def test_before_any_foot_has_come_down_nothing_is_known_of_a_slope() -> None:
    foot, level = Foot(height_off=np.inf), Level(doubt_time=1.0)
    level.prints[:] = FAR
    see_slope(foot, np.zeros(3), 1e-6, 0, level)
    assert foot.height_off == np.inf
    assert foot.normal == pytest.approx([0.0, 0.0, 1.0])
