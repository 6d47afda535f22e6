"""The state estimator against MuJoCo's truth, with the controller living on it."""

from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.plant.terrain import Slope
from go2_wbc.robot.estimator import EstimatorConfig, StateEstimator
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.robot.state_filter import FEET, FORCE_BIAS, GYRO_BIAS, THETA, VELOCITY, EstimateError
from tests.engine_helpers import STAND_JOINTS
from tests.engine_helpers import standing_reading as reading

# m/s; of the estimate while trotting at 0.5 m/s. A foot taken for a point that does not roll would
# be off by 4 % and more.
MEAN_BAR, RMS_BAR = 0.015, 0.03
STILL_BAR = 0.01  # m/s
PLACE_BAR = 0.015  # of the distance walked
CREEP_BAR = 0.003  # m in 4 s of standing or lying
BIAS_BAR = 0.003  # rad/s; of the gyro
NOISE_TILT = np.radians(0.05)  # in 18 s; 0.3 deg if the noise is in the gains
ROUNDING = 1e-12  # of the greatest variance, which is 0.01
STEP = 0.002  # s
FAR, WALKED = 4.5, 9.0  # m and s that a robot has walked
UNSURE, TWIST = 0.01, 0.01  # rad/s; of its gyro's bias meanwhile, and what it reads too much
TURNED, MOVED = 0.005, 0.002  # rad; m
LEARNT_BAR = 0.001  # rad/s; of a gyro's bias in 6 s
TILT_BAR = 0.015  # rad; the accelerometer's bias of 0.05 m/s^2 is 0.005


@pytest.mark.slow
def test_a_stand_and_a_trot_on_its_own_sensors_are_estimated() -> None:
    plant = MujocoPlant(sensors="imu", seed=3)
    errors: list[np.ndarray] = []
    recorder = GroundTruth(plant)
    recorder.on_tick = lambda: errors.append(plant.read().v[:3] - plant.truth().v[:3])
    with GO2Controller(plant=recorder) as go2:
        assert go2.stand(), go2.last_outcome.reason
        go2.wait(1.0)
        errors.clear()
        start = go2.state.q[:2]
        go2.wait(4.0)
        assert np.linalg.norm(go2.state.q[:2] - start) < CREEP_BAR
        assert np.sqrt((np.array(errors) ** 2).mean(axis=0)).max() < STILL_BAR
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5)
        errors.clear()
        start, true_start = go2.state.q[:2], plant.truth().q[:2]
        go2.wait(3.0)
        trotting = np.array(errors)
        way = float(np.linalg.norm(go2.state.q[:2] - start))
        true_way = float(np.linalg.norm(plant.truth().q[:2] - true_start))
        assert go2.last_outcome.ok, go2.last_outcome.reason
    plant.close()
    assert np.abs(trotting.mean(axis=0)[:2]).max() < MEAN_BAR
    assert np.sqrt((trotting**2).mean(axis=0)).max() < RMS_BAR
    assert way == pytest.approx(true_way, rel=PLACE_BAR)
    assert true_way == pytest.approx(1.5, rel=0.1)


@pytest.mark.slow
def test_a_slope_is_not_taken_for_level_ground() -> None:
    """The pitch of a robot that walked up 15 deg had gone 7 deg wrong within 8 s."""
    plant = MujocoPlant(sensors="imu", seed=3, terrain=Slope(np.radians(15.0)))
    with GO2Controller(plant=plant) as go2:
        assert go2.stand(), go2.last_outcome.reason
        assert go2.walk()
        go2.move(0.5)
        go2.wait(4.0)
        assert np.abs(plant.read().rpy[:2] - plant.truth().rpy[:2]).max() < TILT_BAR
        risen = go2.state.q[2]
        go2.wait(1.0)
        assert go2.state.q[2] - risen == pytest.approx(0.5 * np.sin(np.radians(15.0)), rel=0.15)
    plant.close()


def test_what_is_noise_of_the_feet_is_no_contact() -> None:
    """Stones were seen in mid-swing on level ground, and the trunk went up and down by 20 mm."""
    plant = MujocoPlant(sensors="imu", seed=3)
    plant.place(np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, *STAND_JOINTS]))
    seen = []
    for _ in range(250):
        plant.write(JointCommand.damping(3.0))
        seen.append((plant.read().feet_in_contact.any(), plant.read().foot_forces.max()))
    plant.close()
    contacts, forces = zip(*seen, strict=True)
    assert max(forces) > 5.0
    assert not any(contacts)


@pytest.mark.parametrize("seed", range(3))
def test_a_lying_robot_stays_where_it_is_and_learns_the_bias_of_its_gyro(seed: int) -> None:
    plant = MujocoPlant(sensors="imu", seed=seed)
    biased = plant.imu().gyro
    for _ in range(1500):
        plant.write(JointCommand.damping(3.0))
        biased = biased + plant.imu().gyro
    bias = biased / 1501 - plant.truth().v[3:6]
    start = plant.read().q[:2]
    for _ in range(2000):
        plant.write(JointCommand.damping(3.0))
    state = plant.read()
    assert np.linalg.norm(state.q[:2] - start) < CREEP_BAR
    assert np.abs(state.v[:3]).max() < STILL_BAR
    known = plant.imu().gyro - state.v[3:6]
    assert known == pytest.approx(bias, abs=BIAS_BAR)
    assert np.abs(bias).max() > 3 * BIAS_BAR
    assert np.abs(state.rpy[:2] - plant.truth().rpy[:2]).max() < TILT_BAR
    plant.close()


def test_it_begins_above_the_lowest_foot_and_stays_there() -> None:
    model = RobotModel()
    estimator = StateEstimator(model)
    states = [estimator.update(reading(0.002 * tick)) for tick in range(200)]
    assert states[0].q[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    _, p_feet = model.forward_kinematics(states[-1].q)
    assert p_feet[:, 2].mean() == pytest.approx(model.foot_radius, abs=1e-3)
    assert np.abs(states[-1].v).max() < 2e-4


def test_roll_and_pitch_begin_as_gravity_says() -> None:
    leaning = reading(0.0, accelerometer=9.81 * np.array([-0.3, 0.4, 0.75**0.5]))
    state = StateEstimator(RobotModel()).update(leaning)
    assert state.R_world_base.T[:, 2] == pytest.approx(leaning.accelerometer / 9.81, abs=1e-6)
    assert state.yaw == pytest.approx(0.0, abs=1e-6)


def test_a_slipping_foot_counts_less_than_those_that_stand() -> None:
    def speed(slip: float) -> float:
        config = EstimatorConfig(slip=slip, velocity_share=1e-9, drift_share=1e-9)
        estimator = StateEstimator(RobotModel(), config)
        sliding = np.zeros((300, 12))
        sliding[:, 1], sliding[280:, 1] = 0.2, 10.0  # never at rest; then FL slides
        states = [
            estimator.update(reading(0.002 * tick, v_joints=rates))
            for tick, rates in enumerate(sliding)
        ]
        return float(np.abs(states[-1].v[:3]).max())

    assert speed(3.0) < 0.3 * speed(1e6)


def test_a_gap_in_the_readings_begins_the_filter_anew() -> None:
    estimator = StateEstimator(RobotModel())
    estimator.update(reading(0.0))
    falling = reading(0.002, accelerometer=np.array([50.0, 0.0, 9.81]))
    assert estimator.update(falling).v[0] > 0.0
    assert estimator.update(reading(5.0)).v[0] == pytest.approx(0.0, abs=1e-6)


def test_what_was_saved_goes_on_alike() -> None:
    estimator = StateEstimator(RobotModel())
    turning = [reading(0.002 * t, gyro=np.array([0.1, 0.2, 0.3])) for t in range(40)]
    for given in turning[:20]:
        estimator.update(given)
    saved = estimator.save()
    first = [estimator.update(given).q for given in turning[20:]]
    estimator.restore(saved)
    assert np.array_equal([estimator.update(given).q for given in turning[20:]], first)


def test_the_covariance_stays_symmetric() -> None:
    # What rounding leaves grew with every measurement; after five minutes the robot fell.
    estimator = StateEstimator(RobotModel())
    estimator.update(reading(0.0))
    saved = estimator.save()
    saved["state"].filter.P[3, 7] += 1e-7
    estimator.restore(saved)
    estimator.update(reading(0.002))
    P = estimator.save()["state"].filter.P
    assert np.abs(P - P.T).max() < ROUNDING


@pytest.mark.parametrize("turn", [0.0, 0.02])
def test_a_turn_that_was_none_is_taken_back_and_what_it_touched_is_doubted(turn: float) -> None:
    estimator = StateEstimator(RobotModel())
    estimator.update(reading(0.0))
    x, P = estimator._state.filter.x, estimator._state.filter.P
    x.force_bias[:] = 0.04, -0.5, 0.0  # the latter has hidden the tilt, and would turn it back
    before = np.array(P)
    estimator._turn_back(np.array([turn, 0.0, 0.0]))
    doubted = np.zeros(len(P))
    doubted[THETA : THETA + 2], doubted[VELOCITY : VELOCITY + 3] = 0.05**2, 0.2**2
    if not turn:  # it was the accelerometer
        doubted[FORCE_BIAS : FORCE_BIAS + 3] = 0.2**2
    np.testing.assert_allclose(P - before, np.diag(doubted), atol=ROUNDING)
    roll = 2.0 * np.arctan2(x.quaternion[0], x.quaternion[3])
    assert roll == pytest.approx(-turn, abs=1e-9)
    assert x.force_bias == pytest.approx([0.04, -0.05 if turn else -0.5, 0.0])


def after_a_start(speed: float, accelerometer: list[float], forces: float) -> list[RobotState]:
    """States over 0.5 s that begin with a kick that is over when the feet read ``forces``."""
    estimator = StateEstimator(RobotModel())
    estimator.update(reading(0.0))
    kick = np.array([speed / 0.002, 0.0, 9.81])
    air = np.zeros(4)
    estimator.update(reading(0.002, accelerometer=kick, foot_forces=air))
    return [
        estimator.update(
            reading(
                0.004 + 0.002 * tick,
                accelerometer=np.array(accelerometer),
                foot_forces=np.full(4, forces),
            )
        )
        for tick in range(250)
    ]


def test_a_robot_in_flight_goes_on_as_it_flew() -> None:
    flown = after_a_start(2.0, [0.0, 0.0, 0.0], forces=0.0)[-1]
    assert flown.v[0] == pytest.approx(2.0, rel=0.02)
    assert flown.v[2] == pytest.approx(-9.81 * 0.5, rel=0.02)


def test_a_robot_that_its_feet_do_not_carry_is_at_rest_soon() -> None:
    states = after_a_start(2.0, [0.0, 0.0, 9.81], forces=0.0)
    assert states[30].v[0] == pytest.approx(2.0, rel=0.05)  # 0.06 s: it may be in flight
    assert abs(states[-1].v[0]) < 0.1


def test_a_robot_that_turns_in_flight_is_not_taken_to_lie() -> None:
    # The IMU is beside the CoM about which it turns and feels w^2 r: for that the estimate of one
    # that a push had thrown was held fast, which turned it by 23 deg; here by 6.
    turning, pushed, ticks = 11.0, 40, 150
    estimator, air = StateEstimator(RobotModel()), np.zeros(4)
    state = estimator.update(reading(0.0))
    for tick in range(1, 1 + pushed + ticks):
        given = reading(0.002 * tick, foot_forces=air)
        if tick <= pushed:
            given = replace(given, accelerometer=np.array([60.0, 18.0, 9.81]))
        else:
            felt = np.array([0.06 * turning**2, 0.0, 0.0])
            given = replace(given, gyro=np.array([0.0, turning, 0.0]), accelerometer=felt)
        state = estimator.update(given)
    turned = turning * 0.002 * (ticks - 0.5)
    up = np.array([-np.sin(turned), 0.0, np.cos(turned)])
    assert state.R_world_base[2] @ up > np.cos(TILT_BAR)


def test_noise_of_the_joints_speeds_does_not_tilt_a_standing_robot() -> None:
    # It stood in the gains, too: pitch and the accelerometer's bias ran away, 1 deg in a minute.
    estimator, rng = StateEstimator(RobotModel()), np.random.default_rng(3)
    noisy = (
        reading(0.002 * tick, v_joints=0.02 * rng.standard_normal(12)) for tick in range(10_000)
    )
    pitches = [float(estimator.update(given).rpy[1]) for given in noisy]
    assert abs(pitches[-1] - pitches[1000]) < NOISE_TILT


def test_what_tells_of_the_heading_does_not_move_a_robot_that_stands() -> None:
    """It moved by 6 cm/s after 4.5 m: standing up on a slope, a robot followed over its feet."""
    model = RobotModel()
    estimator = StateEstimator(model)
    estimator.update(reading(0.0))
    saved = estimator.save()
    kept, lever = saved["state"].filter, EstimateError()
    p_feet = kept.x.p_feet - kept.x.p
    lever.gyro_bias[2], lever.theta[2], lever.p[1] = 1.0, -WALKED, -WALKED * FAR / 2
    lever.p_feet[:] = lever.p - WALKED * np.cross([0.0, 0.0, 1.0], p_feet)
    kept.P[:] += np.outer(lever.row, lever.row) * UNSURE**2
    estimator.restore(saved)
    given = [reading(STEP * n, gyro=np.array([0.0, 0.0, TWIST])) for n in range(1, 101)]
    end = [estimator.update(one) for one in given][-1]
    assert abs(end.yaw) > TURNED  # the feet say that the gyro has read too much since
    assert np.abs(end.q[:2]).max() < MOVED


def standing_joints(yaws: np.ndarray) -> np.ndarray:
    """Joint angles (n, 12) of a robot that is turned by ``yaws`` (n,) [rad] above its feet."""
    model, angles = RobotModel(), []
    for leg in LEGS:
        geometry = LegGeometry.of(model, leg)
        foot = foot_places(geometry, STAND_JOINTS.reshape(4, 1, 3)[leg])[0]
        places = np.array([foot @ yaw_rotation(yaw) for yaw in yaws])
        angles.append(leg_angles(geometry, places).q)
    return np.concatenate(angles, axis=1)


def test_feet_that_stay_tell_the_bias_of_the_gyro_of_one_that_dances() -> None:
    # Slow turns of the trunk read as rest; taken for none, they went into the bias. After a minute
    # of dancing it was 0.6 mrad/s off, the heading 1.7 deg.
    estimator, bias = StateEstimator(RobotModel()), 0.01
    times = STEP * np.arange(3001)
    inside = times % 1.1  # there at 0.02 rad/s, back at 0.2
    yaws = np.minimum(0.02 * inside, 0.2 * (1.1 - inside))
    joints, rates = standing_joints(yaws), np.diff(yaws) / STEP
    for n, rate in enumerate(rates):
        now = reading(
            times[n],
            gyro=np.array([0.0, 0.0, rate + bias]),
            q_joints=joints[n],
            v_joints=(joints[n + 1] - joints[n]) / STEP,
        )
        estimator.update(now)
    kept, yaw = estimator.save()["state"].filter, GYRO_BIAS + 2
    assert kept.x.gyro_bias[2] == pytest.approx(bias, abs=LEARNT_BAR)
    assert np.sqrt(kept.P[yaw, yaw]) < LEARNT_BAR


def test_after_a_pause_the_filter_begins_at_rest_with_the_biases_that_it_knew() -> None:
    estimator, config = StateEstimator(RobotModel()), EstimatorConfig()
    estimator.update(reading(0.0))
    saved = estimator.save()
    kept, biases = saved["state"].filter, slice(GYRO_BIAS, FEET)
    first = [config.gyro_bias] * 3 + [config.accelerometer_bias] * 3
    np.testing.assert_allclose(np.sqrt(np.diag(kept.P)[biases]), first)
    kept.x.force_bias[:], kept.P[GYRO_BIAS, GYRO_BIAS] = (0.5, -0.4, 0.1), 1e-8
    estimator.restore(saved)
    felt = reading(1.0, accelerometer=np.array([0.5, -0.4, 9.81 + 0.1]))
    state, kept = estimator.update(felt), estimator.save()["state"].filter
    assert state.tilt < 1e-6
    assert kept.x.force_bias == pytest.approx([0.5, -0.4, 0.1], abs=1e-6)
    assert np.sqrt(np.diag(kept.P)[biases]) == pytest.approx([1e-4, *first[1:]], rel=1e-3)


def test_numbers_must_be_positive() -> None:
    with pytest.raises(ConfigError, match="velocity"):
        EstimatorConfig(velocity=-1.0)


def test_a_foot_is_trusted_above_the_force_at_which_it_touches() -> None:
    with pytest.raises(ConfigError, match="trusted_force must be above contact_force"):
        EstimatorConfig(contact_force=30.0)


def test_the_estimate_does_not_depend_on_when_the_clock_began() -> None:
    def speed(begin: float) -> float:
        estimator = StateEstimator(RobotModel())
        states = [
            estimator.update(
                reading(
                    begin + 0.002 * tick,
                    accelerometer=np.array([1.0, 0.0, 9.81]),
                    v_joints=np.ones(12),
                    foot_forces=np.zeros(4),
                )
            )
            for tick in range(50)
        ]
        return float(states[-1].v[0])

    assert speed(1000.0) == pytest.approx(speed(0.0), rel=1e-6)
    assert abs(speed(0.0)) > 1e-4
