"""The state estimator of a robot that tumbles, falls on its back, or begins in the air."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from jaxtyping import Float

from benchmarks.balance import dropped
from controller import GO2Controller
from go2_wbc.records import packed
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rest_detection import (
    KNOWN,
    LOST,
    TUMBLED,
    Rest,
    begin_anew,
    is_at_rest,
    is_upset,
    lies,
    take_in_rest,
)
from go2_wbc.robot.state import RobotState
from go2_wbc.robot.state_filter import GYRO_BIAS, THETA, VELOCITY, Estimate, Filter
from tests.engine_helpers import standing_reading

STEP = 0.002  # s
ON_BACK = pin.rpy.rpyToMatrix(2.5, -0.3, 0.0)
FALLING = np.array([0.1, 0.3, -0.2])  # m/s^2
TILT_BAR = np.radians(1.5)  # the biases that a start forgets are 0.3 deg
HEIGHT_BAR = 0.005  # m; in a tick


def resting(
    time: float, R: Float[np.ndarray, "3 3"], forces: float = 0.0, jolt: float = 0.0
) -> SensorReading:
    """What a robot reads that does not move."""
    felt = R.T @ [0.0, 0.0, 9.81] + [jolt, 0.0, 0.0]
    return standing_reading(time, accelerometer=felt, foot_forces=np.full(4, forces))


def tilt_between(state: RobotState, R: Float[np.ndarray, "3 3"]) -> float:
    """Angle [rad] between what is up for the estimate and in truth."""
    return float(np.arccos(np.clip(state.R_world_base[2] @ R[2], -1.0, 1.0)))


def found_after(time: float, every: int = 0, config: EstimatorConfig | None = None) -> float:
    """Tilt [rad] by which a robot is off that stood, and rests on its back unseen by its gyro.

    Its accelerometer is jolted in one of ``every`` readings.
    """
    estimator = StateEstimator(RobotModel(), config)
    for tick in range(200):
        estimator.update(resting(STEP * tick, np.eye(3), forces=40.0))
    tilts = []
    for tick in range(round(time / STEP)):
        jolt = 30.0 if every and tick % every == 0 else 0.0
        state = estimator.update(resting(STEP * (200 + tick), ON_BACK, jolt=jolt))
        tilts.append(tilt_between(state, ON_BACK))
    return tilts[-1]


def test_a_robot_that_was_lost_is_found_once_it_is_at_rest() -> None:
    assert found_after(0.35) < TILT_BAR
    assert found_after(0.35, config=EstimatorConfig(still_time=100.0)) > 5 * TILT_BAR


def test_who_begins_in_the_air_does_not_trust_its_tilt() -> None:
    deviations = []
    for felt in (resting(0.0, np.eye(3)), replace(resting(0.0, np.eye(3)), accelerometer=FALLING)):
        estimator = StateEstimator(RobotModel())
        estimator.update(felt)
        deviations.append(float(estimator.save()["state"].filter.P[THETA, THETA]) ** 0.5)
    assert deviations[0] < EstimatorConfig().tilt
    assert deviations[1] > 0.5


def test_jolts_delay_that_and_do_not_prevent_it() -> None:
    assert found_after(0.6, every=20) < 3 * TILT_BAR
    assert found_after(0.6, every=1) > 5 * TILT_BAR


def test_a_robot_that_rolled_onto_its_feet_forgets_its_biases_and_keeps_its_height() -> None:
    estimator, rate = StateEstimator(RobotModel()), 5.0
    for tick in range(200):
        estimator.update(resting(STEP * tick, pin.rpy.rpyToMatrix(2.0, 0.0, 0.0)))
    for tick in range(200):
        R = pin.rpy.rpyToMatrix(2.0 - rate * STEP * (tick + 1), 0.0, 0.0)
        rolling = replace(resting(STEP * (200 + tick), R), gyro=np.array([-rate, 0.0, 0.0]))
        estimator.update(rolling)
    saved = estimator.save()
    x = saved["state"].filter.x
    x.gyro_bias[:], x.force_bias[:] = 0.04, 0.04
    estimator.restore(saved)
    rests = [resting(STEP * (400 + tick), np.eye(3), forces=40.0) for tick in range(300)]
    states = [estimator.update(given) for given in rests]
    assert tilt_between(states[-1], np.eye(3)) < TILT_BAR
    x = estimator.save()["state"].filter.x
    assert np.abs([x.gyro_bias, x.force_bias]).max() < 0.004
    heights = np.array([state.q[2] for state in states])
    assert np.abs(np.diff(heights)).max() < HEIGHT_BAR
    assert not estimator.save()["state"].rest.tumbled


def test_a_robot_that_never_tumbled_does_not_begin_anew() -> None:
    estimator = StateEstimator(RobotModel())
    leaning = pin.rpy.rpyToMatrix(0.0, -0.75, 0.0)  # as reared
    for tick in range(300):
        estimator.update(resting(STEP * tick, leaning if tick < 200 else np.eye(3), forces=40.0))
    estimator.update(resting(STEP * 300, np.eye(3), forces=40.0))
    assert not estimator.save()["state"].rest.tumbled


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9001, 9003, 9006])
def test_a_dropped_robot_stands_up_on_its_own_sensors(seed: int) -> None:
    # None of these stood before: attitude, biases and speed were lost in the fall.
    plant = dropped(seed, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        go2.wait(1.0)
        assert go2.recover(), go2.last_outcome.reason
        assert go2.stand(), go2.last_outcome.reason
    assert plant.truth().tilt < np.radians(3.0)
    plant.close()


C, G, DT = EstimatorConfig(), 9.81, 0.002
UP = [0.0, 0.0, G]
CARRYING = 0.5 * G  #: What a trunk feels at least if something carries it


def read(
    gyro: float = 0.0, force: float = G, rate: float = 0.0, over: float = 0.0
) -> tuple[Estimate, Rest, SensorReading]:
    """An estimate with biases, and a reading that turns and moves by this much beyond them."""
    x = Estimate(gyro_bias=[0.01, -0.02, 0.0], force_bias=[0.02, 0.0, 0.05])
    rates, felt = np.full(12, rate), [force * np.sin(over), 0.0, force * np.cos(over)]
    taken = standing_reading(
        gyro=x.gyro_bias + [0.0, gyro, 0.0], accelerometer=x.force_bias + felt, v_joints=rates
    )
    return x, Rest(joint_speeds=rates.copy()), packed(taken)


@pytest.mark.parametrize(
    ("kwargs", "rests"),
    [
        ({}, True),
        ({"gyro": 0.99 * C.still_turning, "rate": 0.99 * C.still_joints}, True),
        ({"gyro": 1.01 * C.still_turning}, False),
        ({"rate": 1.01 * C.still_joints}, False),
        ({"force": G + 0.99 * C.still_force}, True),
        ({"force": G + 1.01 * C.still_force}, False),
        ({"force": G - 1.01 * C.still_force}, False),
    ],
)
def test_at_rest_is_what_has_not_moved_for_a_while(*, kwargs: dict, rests: bool) -> None:
    x, rest, taken = read(**kwargs)
    rest.still_time = C.still_time - 1.5 * DT
    assert not is_at_rest(x, rest, taken, DT, G, C)
    assert is_at_rest(x, rest, taken, DT, G, C) is rests
    assert (rest.still_time > 0.0) == rests


def test_speeds_of_joints_are_smoothed() -> None:
    x, rest, taken = read()
    taken.v_joints[:] = 1.0
    is_at_rest(x, rest, taken, DT, G, C)
    np.testing.assert_allclose(rest.joint_speeds, DT / 0.05)
    is_at_rest(x, rest, taken, 1.0, G, C)
    np.testing.assert_allclose(rest.joint_speeds, 1.0)


@pytest.mark.parametrize(
    ("force", "gyro", "is_carried", "is_lying"),
    [
        (1.01 * CARRYING, 0.0, False, True),
        (0.99 * CARRYING, 0.0, False, False),  # falls freely
        (1.01 * CARRYING + 0.1 * 9.0, 3.0, False, True),
        (0.99 * CARRYING + 0.1 * 9.0, 3.0, False, False),  # and turns
        (G, 0.0, True, False),  # stands
    ],
)
def test_who_lies_feels_gravity_and_no_foot(
    *, force: float, gyro: float, is_carried: bool, is_lying: bool
) -> None:
    x, rest, taken = read(gyro, force)
    rest.lying_time = C.lying_time - 1.5 * DT
    assert not lies(x, rest, taken, DT, is_carried, G, C)
    assert lies(x, rest, taken, DT, is_carried, G, C) is is_lying
    assert (rest.lying_time > 0.0) == is_lying


@pytest.mark.parametrize(
    ("tilt", "is_lying", "is_down"), [(51.0, False, True), (49.0, False, False), (0.0, True, True)]
)
def test_who_was_down_is_upset_for_a_second(*, tilt: float, is_lying: bool, is_down: bool) -> None:
    rest, level = Rest(), np.eye(3)
    R = pin.rpy.rpyToMatrix(np.radians(tilt), 0.0, 0.0)
    assert is_upset(rest, DT, is_lying, R) is is_down
    ticks = 0
    while is_upset(rest, DT, False, level):
        ticks += 1
    assert ticks * DT == pytest.approx(1.0 - DT if is_down else 0.0, abs=1.5 * DT)


@pytest.mark.parametrize(
    ("what", "found"),
    [
        ({}, KNOWN),
        ({"speed": 0.49}, KNOWN),
        ({"speed": 0.51}, LOST),
        ({"speed": 0.51, "rate": 0.99 * C.still_joints}, LOST),
        ({"speed": 0.51, "rate": 1.01 * C.still_joints}, KNOWN),
        ({"over": np.radians(14.5)}, KNOWN),
        ({"over": np.radians(15.5)}, LOST),
        ({"gyro_bias": 4.9 * C.gyro_bias}, KNOWN),
        ({"gyro_bias": -5.1 * C.gyro_bias}, LOST),
        ({"force_bias": 4.9 * C.accelerometer_bias}, KNOWN),
        ({"force_bias": -5.1 * C.accelerometer_bias}, LOST),
        ({"tumbled": True}, TUMBLED),
        ({"tumbled": True, "speed": 0.51}, LOST),
        ({"tumbled": True, "roll": 51.0}, LOST),
        ({"roll": 51.0}, LOST),
    ],
)
def test_when_an_estimate_begins_anew(*, what: dict, found: int) -> None:
    x, rest, taken = read(rate=what.get("rate", 0.0), over=what.get("over", 0.0))
    x.v[0], rest.tumbled = what.get("speed", 0.0), what.get("tumbled", False)
    x.gyro_bias[:] = x.force_bias[:] = 0.0
    x.gyro_bias[1], x.force_bias[2] = what.get("gyro_bias", 0.0), what.get("force_bias", 0.0)
    taken.gyro[:] = 0.0
    R = pin.rpy.rpyToMatrix(np.radians(what.get("roll", 0.0)), 0.0, 0.0)
    rest.lost_time = C.still_time - 1.5 * DT
    assert begin_anew(x, rest, taken, DT, R, G, C) == KNOWN
    assert begin_anew(x, rest, taken, DT, R, G, C) == found
    assert rest.tumbled == ("tumbled" in what or "roll" in what)
    assert (rest.lost_time == 0.0) == (found == KNOWN)


@pytest.mark.parametrize(
    ("gyro", "force", "way"),
    [
        (1.01 * C.still_turning, G, -1),
        (-1.01 * C.still_turning, G, -1),
        (-0.99 * C.still_turning, G, 1),
        (0.0, G + 1.01 * C.still_force, -1),
        (0.0, G - 1.01 * C.still_force, -1),
        (0.0, G + 0.99 * C.still_force, 1),
    ],
)
def test_who_is_shaken_is_found_later(gyro: float, force: float, way: int) -> None:
    x, rest, taken = read(gyro, force)
    x.v[0], rest.lost_time = 1.0, C.still_time + 10 * DT
    taken.gyro[:], taken.accelerometer[:] = (0.0, gyro, 0.0), (0.0, 0.0, force)
    assert begin_anew(x, rest, taken, DT, np.eye(3), G, C) == LOST
    assert rest.lost_time == pytest.approx(C.still_time + (10 + way) * DT)


@pytest.mark.parametrize("is_carried", [False, True])
def test_rest_tells_the_velocity_and_of_who_lies_the_gyros_bias(*, is_carried: bool) -> None:
    f, (_, _, taken) = Filter(), read(gyro=0.2)
    f.P[:], f.x.v[:], f.x.gyro_bias[:] = np.eye(27), (0.1, -0.2, 0.3), 0.05
    take_in_rest(f, taken, is_carried, C)
    velocity, biases = slice(VELOCITY, VELOCITY + 3), slice(GYRO_BIAS, GYRO_BIAS + 3)
    np.testing.assert_allclose(f.error[velocity], -f.x.v / (1.0 + C.still_velocity**2))
    told = 0.0 if is_carried else (taken.gyro - 0.05) / (1.0 + C.still_gyro**2)
    np.testing.assert_allclose(f.error[biases], told)
    variance = 1.0 if is_carried else 1.0 - 1.0 / (1.0 + C.still_gyro**2)
    np.testing.assert_allclose(np.diag(f.P)[biases], variance)
