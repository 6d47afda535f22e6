"""Which sensor is broken is found from the others; a sound robot's readings are left alone."""

import math
from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.algebra.linear import triple
from go2_wbc.compilation import plain
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.imu_watch import (
    CALM,
    JUMP_LASTS,
    LONG_CALM,
    LONGEST_JUMP,
    SEEN_AFTER,
    SHAKEN,
    SHAKEN_LASTS,
    WatchedImu,
    judge_accelerometer,
    judge_jump,
)
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.sensor_watch import (
    CHANGED,
    DOUBT,
    FREE,
    LOADED,
    NOISY,
    RUBBING,
    SAME_TIME,
    SENSED,
    SOUND_TIME,
    UNFELT,
    SensorWatch,
    WatchedSensors,
    leg_motion,
    less_rolling,
    watch_encoders,
    watch_force,
)
from go2_wbc.robot.speed_noise import noise_of_gyro
from go2_wbc.robot.state import PartFault, SensorReading

MODEL = RobotModel()
STANDING = np.tile([0.05, 0.8, -1.6], 4)
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
DT = 0.002
ZERO, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def standing_torques() -> np.ndarray:
    """That hold a quarter of the robot on each foot, of legs without weight."""
    geometry = leg_table(MODEL).geometry
    columns = []
    for leg in range(4):
        q = triple(STANDING[3 * leg : 3 * leg + 3])
        unit = np.eye(3)
        forces = [plain(leg_motion)(geometry[leg], q, ZERO, triple(e))[2] for e in unit]
        weight = np.array([0.0, 0.0, 0.25 * MODEL.mass * MODEL.gravity])
        columns.append(np.linalg.solve(np.array(forces).T, weight))
    return np.concatenate(columns)


def reading(step: int, **changes: np.ndarray) -> SensorReading:
    """Of a robot that stands on four feet, with a sensor's noise in its forces."""
    forces = 39.0 + np.array([step % 3, step % 2, (step + 1) % 3, (step + 1) % 2], dtype=float)
    v = np.full(12, 1e-4 * (step % 2))
    sound = SensorReading(
        DT * step, np.zeros(3), np.array([0.0, 0.0, 9.81]), STANDING, v, standing_torques(), forces
    )
    return replace(sound, **changes)


def watched(*readings: SensorReading) -> tuple[SensorReading, tuple[PartFault, ...]]:
    """The last as it is passed on, and what was found to be broken."""
    watch = SensorWatch(MODEL)
    last = readings[0]
    for one in readings:
        last = watch.checked(one, LEVEL)
    return last, watch.faults


@pytest.mark.parametrize("leg", range(4))
def test_a_legs_motion_and_force_are_pinocchios(leg: int) -> None:
    rng = np.random.default_rng(leg)
    model, data = MODEL.pin_model, MODEL.pin_model.createData()
    for _ in range(20):
        q, v = pin.neutral(model), np.zeros(18)
        q[7:] = STANDING + rng.uniform(-0.5, 0.5, 12)
        v[6:], tau = rng.uniform(-5.0, 5.0, 12), rng.uniform(-20.0, 20.0, 12)
        joints = slice(3 * leg, 3 * leg + 3)
        frame = model.getFrameId(FOOT_NAMES[leg])
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3, 6:][:, joints]
        given = (triple(q[7:][joints]), triple(v[6:][joints]), triple(tau[joints]))
        place, u, force, slack = plain(leg_motion)(leg_table(MODEL).geometry[leg], *given)
        assert place == pytest.approx(data.oMf[frame].translation, abs=1e-6)
        assert u == pytest.approx(J @ v[6:][joints], abs=1e-5)
        assert J.T @ np.array(force) == pytest.approx(-tau[joints], abs=1e-3)
        assert slack == pytest.approx(RUBBING * abs(np.linalg.inv(J.T)[2]) @ abs(v[6:][joints]))


def test_a_foot_that_rolls_has_the_velocity_of_the_point_that_touches() -> None:
    """A calf that turns about y by 2 rad/s rolls its foot's centre ahead by 2 r."""
    moved = plain(less_rolling)(
        (0.0, 0.8, -1.6), (0.0, 3.0, -1.0), (0.04, 0.0, 0.0), ZERO, (0.0, 0.0, 1.0), 0.02
    )
    assert moved == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_a_sound_robots_readings_leave_as_they_came() -> None:
    readings = [reading(step) for step in range(400)]
    last, faults = watched(*readings)
    assert faults == ()
    for field in fields(SensorReading):
        assert np.array_equal(getattr(last, field.name), getattr(readings[-1], field.name))


def test_what_a_leg_moves_itself_by_is_its_speeds_derivative() -> None:
    sensors = WatchedSensors()
    for k in range(40):
        t = DT * k
        one = reading(k, q_joints=STANDING + 2.5 * t**2, v_joints=np.full(12, 5.0 * t))
        plain(watch_encoders)(sensors, one, DT)
    np.testing.assert_allclose(sensors.dv, 5.0, rtol=0.02)


def test_legs_that_carry_a_robot_push_it_against_gravity() -> None:
    watch = SensorWatch(MODEL)
    for step in range(600):
        watch.checked(reading(step), LEVEL)
    assert watch._state.imu.push == pytest.approx([0.0, 0.0, MODEL.gravity], abs=0.05)


@pytest.mark.parametrize("name", ["gyro", "q_joints", "v_joints", "foot_forces", "accelerometer"])
def test_what_is_not_a_number_is_what_it_was(name: str) -> None:
    before, bad = reading(10), reading(11)
    value = getattr(bad, name).copy()
    value[1] = np.nan
    last, faults = watched(*(reading(k) for k in range(10)), before, replace(bad, **{name: value}))
    assert getattr(last, name)[1] == getattr(before, name)[1]
    assert faults == ()


def test_a_jump_of_an_encoder_is_named_and_taken_off_after_a_gap_too() -> None:
    off = STANDING.copy()
    off[4] += 0.1
    readings = [reading(k, q_joints=STANDING if k < 50 else off) for k in range(60)]
    last, faults = watched(*readings)
    assert [fault.part for fault in faults] == ["FR_thigh_joint"]
    assert faults[0].is_survived
    for one in (last, watched(*readings, replace(readings[-1], time=5.0))[0]):
        assert one.q_joints == pytest.approx(STANDING, abs=1e-6)


def test_an_encoder_that_stays_while_its_legs_others_do_not_is_stuck() -> None:
    """Even if the robot stands still: the others are read with noise."""
    noise = 1e-5 * (np.arange(12) != 2)
    _, faults = watched(
        *(
            reading(k, q_joints=STANDING + k % 2 * noise, v_joints=np.full(12, 1e-4))
            for k in range(100)
        )
    )
    (stuck,) = faults
    assert stuck.part == "FL_calf_joint"
    assert not stuck.is_survived
    assert stuck.since < 0.2


@pytest.mark.parametrize("value", [0.0, 44.0])
def test_a_foots_dead_or_stuck_sensor_gives_way_to_the_legs_torques(value: float) -> None:
    def forces(step: int) -> np.ndarray:
        sound = reading(step).foot_forces
        return np.where(np.arange(4) == 3, value, sound) if step > 500 else sound

    last, faults = watched(*(reading(k, foot_forces=forces(k)) for k in range(700)))
    assert [fault.part for fault in faults] == ["RR_foot"]
    assert last.foot_forces[3] == pytest.approx(0.25 * MODEL.mass * MODEL.gravity, abs=0.1)


def test_a_foots_sensor_that_feels_what_its_leg_bears_is_sound_after_all() -> None:
    watch, named, loads = SensorWatch(MODEL), [], np.array([1.0, 1.0, 1.0, 0.0])
    for k in range(700):
        forces = reading(k).foot_forces
        heard = forces * loads if 200 < k <= 400 else forces
        watch.checked(reading(k, foot_forces=heard), LEVEL)
        named.append([fault.part for fault in watch.faults])
    assert named[400] == ["RR_foot"]
    assert named[400 + round(0.8 * SOUND_TIME / DT)] == ["RR_foot"]
    assert named[400 + round(1.2 * SOUND_TIME / DT)] == []
    last = reading(700)
    np.testing.assert_array_equal(watch.checked(last, LEVEL).foot_forces, last.foot_forces)


@pytest.mark.parametrize(
    ("force", "borne", "carries", "same", "agrees"),
    [
        (40.0, 40.0 + 0.9 * CHANGED, True, 0.0, True),
        (40.0, 40.0 - 0.9 * CHANGED, True, 0.0, True),
        (40.0, 40.0 + 1.1 * CHANGED, True, 0.0, False),
        (40.0, 40.0 - 1.1 * CHANGED, True, 0.0, False),
        (40.0, 40.0, False, 0.0, False),
        (40.0, 40.0, True, DOUBT, False),
        (0.9 * SENSED, SENSED, True, 0.0, False),
    ],
)
def test_a_sensor_agrees_with_its_leg_while_it_changes_with_its_load(
    force: float, borne: float, carries: bool, same: float, agrees: bool
) -> None:
    for leg in range(4):
        s, r = WatchedSensors(), reading(1, foot_forces=np.full(4, force))
        s.force_is_wrong[leg], s.agreed[leg], s.force_same[leg] = 1.0, DT, same
        s.force[leg] = s.load[leg] = force if same else force - 1.0
        watch_force(s, r, leg, borne, 0.0, carries, DT)
        assert s.agreed[leg] == (2.0 * DT if agrees else 0.0)


def test_a_sensor_is_believed_again_once() -> None:
    s = WatchedSensors()
    for is_wrong in (0.0, 1.0):
        s.force_is_wrong[0] = 1.0
        for force in (40.0, 41.0) * round(SOUND_TIME / DT):
            watch_force(s, reading(1, foot_forces=np.full(4, force)), 0, 40.0, 0.0, True, DT)
        assert s.force_is_wrong[0] == is_wrong


def test_a_sensor_without_noise_may_say_the_same() -> None:
    still = np.full(4, 39.0)
    _, faults = watched(*(reading(k, foot_forces=still) for k in range(700)))
    assert faults == ()


def test_a_sensor_that_changes_lives_whatever_its_leg_bears() -> None:
    """A calf lies on a box, and its foot in the air feels its own noise."""
    rng = np.random.default_rng(0)

    def forces(step: int) -> np.ndarray:
        load = np.array([39.0, 39.0, 39.0, 0.0 if step > 300 else 39.0])
        return np.maximum(np.round(load + 2.0 * rng.standard_normal(4)), 0.0)

    _, faults = watched(*(reading(k, foot_forces=forces(k)) for k in range(1000)))
    assert faults == ()


NOISE = {"noisy": 1.1 * NOISY, "still": 0.0}


@pytest.mark.parametrize(
    ("noise", "last", "force", "borne", "is_against"),
    [
        ("noisy", 0.0, 0.0, FREE + 1.0, True),
        ("still", 0.0, 0.0, FREE + 1.0, False),
        ("still", 0.0, 0.0, LOADED + 1.0, True),
        ("still", 0.0, 1.0, LOADED + 1.0, True),
        ("noisy", 0.0, 1.0, LOADED + 1.0, False),  # one that changes lives
        ("still", 0.0, UNFELT + 1.0, LOADED + 1.0, False),
        ("still", 30.0, SENSED + 1.0, FREE - 1.0, True),
        ("still", 30.0, SENSED - 1.0, FREE - 1.0, False),
        ("still", 30.0, SENSED + 1.0, FREE + 1.0, False),
    ],
)
def test_a_foots_sensor_is_against_its_leg(
    noise: str, last: float, force: float, borne: float, is_against: bool
) -> None:
    for leg in range(4):
        s, r = WatchedSensors(), reading(1, foot_forces=np.full(4, force))
        s.noise[:, leg], s.force[leg] = NOISE[noise], last
        watch_force(s, r, leg, borne, 0.0, True, DT)
        assert s.against[leg] == (DT if is_against else 0.0)


@pytest.mark.parametrize(
    ("noise", "force", "borne", "is_wrong"),
    [
        ("still", 44.0, 44.0 + 1.1 * CHANGED, True),
        ("still", 44.0, 44.0 - 0.9 * CHANGED, False),
        ("noisy", 44.0, 44.0, True),
        ("still", 0.0, FREE - 1.0, False),
        ("noisy", 0.0, FREE - 1.0, True),
    ],
)
def test_a_sensor_that_says_the_same_is_wrong_once_it_should_not(
    noise: str, force: float, borne: float, is_wrong: bool
) -> None:
    for leg in range(4):
        s, r = WatchedSensors(), reading(1, foot_forces=np.full(4, force))
        s.noise[int(force > UNFELT), leg] = NOISE[noise]
        s.force[leg], s.load[leg], s.force_same[leg] = force, 44.0 * (force > 0.0), SAME_TIME
        watch_force(s, r, leg, borne, 0.0, True, DT)
        assert s.force_is_wrong[leg] == is_wrong
        kept = borne if borne > LOADED else 0.0
        assert r.foot_forces[leg] == (kept if is_wrong else force)


def test_joints_that_rub_are_not_taken_for_loads() -> None:
    """A leg in the air that turns fast, against a damping that nobody has told of."""
    v, forces = np.zeros(12), np.full(4, 52.0)
    v[11], forces[3] = -10.0, 0.0
    tau = standing_torques()
    tau[11] += 0.5 * v[11]
    _, faults = watched(
        *(
            reading(k, v_joints=v, tau=tau, foot_forces=forces + k % 3 * (forces > 0))
            for k in range(200)
        )
    )
    assert "RR_foot" not in [fault.part for fault in faults]


@pytest.mark.parametrize("axis", range(3))
def test_an_accelerometer_that_jumps_is_named_and_its_error_taken_off(axis: int) -> None:
    off = np.array([0.0, 0.0, 9.81]) + np.eye(3)[axis]
    steps = range(900)
    readings = [reading(k, **({"accelerometer": off} if k >= 600 else {})) for k in steps]
    last, faults = watched(*readings)
    assert [fault.part for fault in faults] == ["accelerometer"]
    assert faults[0].since < DT * 600 + 0.45
    assert last.accelerometer == pytest.approx([0.0, 0.0, 9.81], abs=0.35)


def test_a_blow_is_no_error_of_the_accelerometer() -> None:
    """Over 20 ms it feels 15 m/s^2 that the feet, pressed into the ground, do not move by."""
    up, blow = np.array([0.0, 0.0, 9.81]), np.array([0.0, 15.0, 9.81])
    _, faults = watched(
        *(reading(k, accelerometer=blow if 600 <= k < 610 else up) for k in range(1000))
    )
    assert faults == ()


@pytest.mark.parametrize("thrown", [True, False])
def test_what_a_sound_accelerometer_lacks_after_a_throw_is_a_tilt(thrown: bool) -> None:
    # A robot slid over slippery ground, was believed to lean, and its accelerometer was named.
    watch, turns = SensorWatch(MODEL), []
    blow, off = np.array([0.0, 40.0, 9.81]), np.array([0.6, 0.0, 9.79])
    for k in range(1000):
        is_blow = thrown and 50 <= k < 60
        changed = {"accelerometer": off} if k >= 60 else {"accelerometer": blow} if is_blow else {}
        watch.checked(reading(k, **changed), LEVEL)
        if watch.misturned is not None:
            turns.append(watch.misturned)
    assert [fault.part for fault in watch.faults] == ([] if thrown else ["accelerometer"])
    assert turns[0] == pytest.approx([0.0, 0.6 / 9.81 if thrown else 0.0, 0.0], abs=0.015)


@pytest.mark.parametrize(("lack", "is_off"), [(0.0, 0.0), (-1.0, 1.0)])
def test_what_legs_push_by_is_felt_and_an_error_is_what_they_lack(
    lack: float, is_off: float
) -> None:
    m = WatchedImu(stood=2.0 * LONG_CALM)
    for _ in range(300):
        m.push[:], m.lack[0] = (0.8, 0.0, 9.81), lack
        plain(judge_accelerometer)(m, (1.0, 0.0, 9.81), ZERO, ZERO, UP, 9.81, True, DT)
    assert m.force_is_off == is_off
    assert m.force_time == 0.0  # what is taken off, or felt, lasts no longer


@pytest.mark.parametrize(("lasts", "parts"), [(0.2, []), (0.6, ["accelerometer"])])
def test_what_begins_as_a_foot_springs_back_has_to_last(lasts: float, parts: list[str]) -> None:
    readings = [reading(k) for k in range(1200)]
    for k in range(600, 660):
        readings[k] = reading(k, foot_forces=np.array([200.0 + k % 3, 40.0, 40.0, 40.0]))
    for k in range(700, 700 + round(lasts / DT)):
        readings[k] = reading(k, accelerometer=np.array([0.0, 0.0, 11.0 + 0.01 * (k % 2)]))
    assert [fault.part for fault in watched(*readings)[1]] == parts


def test_a_lifted_foot_that_presses_tells_nothing_of_the_imu() -> None:
    watch = SensorWatch(MODEL)
    for k in range(100):
        watch.checked(reading(k), LEVEL)
    watch.checked(reading(100, foot_forces=np.array([0.0, 40.0, 40.0, 40.0])), LEVEL)
    assert (watch._state.stood > 0.0).tolist() == [False, True, True, True]


@pytest.mark.parametrize("axis", range(3))
def test_a_gyro_that_jumps_is_named_and_its_error_taken_off(axis: int) -> None:
    off = 0.5 * np.eye(3)[axis]
    steps = range(400)
    last, faults = watched(*(reading(k, gyro=np.zeros(3) if k < 200 else off) for k in steps))
    assert [fault.part for fault in faults] == ["gyro"]
    assert faults[0].since < 0.4 + 0.04
    assert last.gyro == pytest.approx(np.zeros(3), abs=0.02)


@pytest.mark.parametrize(("next_turn", "named"), [(0.4, ["gyro"]), (0.55, [])])
def test_a_landing_turns_a_robot_on_and_an_error_comes_at_once(
    next_turn: float, named: list[str]
) -> None:
    """The feet slide as it lands and do not tell; either is there for 80 ms."""
    turns = np.zeros((290, 3))
    turns[250], turns[251:] = [0.4, 0.0, 0.0], [next_turn, 0.0, 0.0]
    _, faults = watched(*(reading(k, gyro=w) for k, w in enumerate(turns)))
    assert [fault.part for fault in faults] == named


@pytest.mark.parametrize(
    ("before", "after", "may_err"), [(0.0, 0.0, True), (0.37, 0.0, False), (0.0, 0.37, False)]
)
def test_what_turns_for_two_readings_is_no_jump(before: float, after: float, may_err: bool) -> None:
    """Robots whose commands are late land hard, and lost their gyro by it."""
    imu = WatchedImu(stood=1.0)
    for n, change in enumerate((0.0, before, 0.43, after, 0.0)):
        judge_jump(imu, (change, 0.0, 0.0), False, DT * (1.0 + 1e-12 * n))
    assert bool(imu.jump_time > 0.0) is may_err


def test_a_gyro_that_drifts_off_is_named_too() -> None:
    drift = np.array([0.0, 0.5, 0.0])
    share = [min(max(k - 100, 0) / 50.0, 1.0) for k in range(500)]
    last, faults = watched(*(reading(k, gyro=share[k] * drift) for k in range(500)))
    assert [fault.part for fault in faults] == ["gyro"]
    assert faults[0].since < 0.2 + 0.4
    assert last.gyro == pytest.approx(np.zeros(3), abs=0.09)


@pytest.mark.parametrize("since", [0, 250])
def test_a_robot_that_turns_or_is_struck_has_a_sound_gyro(since: int) -> None:
    """Its feet turn about it as the gyro says, if all at once as well."""
    w, v = np.array([0.0, 0.0, 0.6]), np.zeros(12)
    for leg in range(4):
        geometry, q = leg_table(MODEL).geometry[leg], triple(STANDING[3 * leg : 3 * leg + 3])
        place = np.array(plain(leg_motion)(geometry, q, ZERO, ZERO)[0])
        J = np.array([plain(leg_motion)(geometry, q, triple(e), ZERO)[1] for e in np.eye(3)]).T
        v[3 * leg : 3 * leg + 3] = np.linalg.solve(J, -np.cross(w, place))
    turned = (reading(k, gyro=w, v_joints=v) if k >= since else reading(k) for k in range(350))
    assert watched(*turned)[1] == ()


def test_a_foot_that_slides_is_no_error_of_the_gyro() -> None:
    """Beside one that stands, as on the edge of a box: the line between both turns, and grows."""
    q, v, tau = triple(STANDING[:3]), np.zeros(12), 2.0 * standing_torques()
    J = [plain(leg_motion)(leg_table(MODEL).geometry[0], q, triple(e), ZERO)[1] for e in np.eye(3)]
    v[:3] = np.linalg.solve(np.array(J).T, [0.0, 0.25, 0.0])
    tau[3:9] = 0.0
    noisy = [reading(k).v_joints for k in range(200)]
    _, faults = watched(*(reading(k, v_joints=v + noisy[k], tau=tau) for k in range(200)))
    assert [fault.part for fault in faults if fault.part == "gyro"] == []


@pytest.mark.parametrize("noise", [1.0, 0.01])
def test_speeds_and_gyro_are_read_through_their_noise(noise: float) -> None:
    """Of 3 and 0.8 rad/s a motor was called dead, and no robot stood up; of little all is kept."""
    rng, swing = np.random.default_rng(5), 2.0 * np.pi * 1.5
    watch, w, off = SensorWatch(MODEL), np.array([0.0, 0.0, 0.3]), []
    for k in range(400):
        q = STANDING + 0.2 * np.sin(swing * DT * k)
        v = np.full(12, 0.2 * swing * np.cos(swing * DT * k))
        v_read, w_read = v + 3.0 * noise * rng.normal(size=12), w + 0.8 * noise * rng.normal(size=3)
        free = {"tau": np.zeros(12), "foot_forces": np.zeros(4)}
        one = reading(k, q_joints=q, v_joints=v_read, gyro=w_read, **free)
        passed = watch.checked(one, LEVEL)
        off.append([np.abs(passed.v_joints - v).max(), np.abs(passed.gyro - w).max()])
        if noise < 0.1:
            np.testing.assert_array_equal(passed.v_joints, one.v_joints)
            np.testing.assert_array_equal(passed.gyro, one.gyro)
    assert np.max(off[1:], axis=0)[0] < max(0.1, 0.15 * noise)
    assert np.sqrt(np.mean(np.square(off[50:]), axis=0))[1] < 0.5
    assert watch.faults == ()
    told = noise_of_gyro(watch.speed_noise)
    assert told == pytest.approx(0.8 if noise == 1.0 else 0.0, rel=0.2)


def named_after(landing: float, seen_after: float = 0.0) -> float:
    """Time [s] from a jump of the gyro until it is named: feet show it, and a landing is then."""
    imu = WatchedImu(stood=CALM)
    for k in range(100):
        stood = DT * k - landing
        judge_jump(imu, (0.5 if k == 0 else 0.0, 0.0, 0.0), 0.0 <= stood <= SHAKEN, DT)
        if imu.gyro_is_off > 0.0:
            return DT * k
        if DT * k < seen_after:
            continue
        imu.jump_seen = imu.jump_lacks = imu.jump_residual = imu.any_seen = 1.0
        imu.any_lacks = 0.0 if 0.0 <= stood < 0.8 * SHAKEN else 1.0  # it slides
    return math.inf


@pytest.mark.parametrize(
    ("landing", "lasts"),
    [(-0.02, JUMP_LASTS), (-0.008, SHAKEN_LASTS), (0.0, SHAKEN_LASTS), (0.016, SHAKEN_LASTS)],
)
def test_a_jump_of_the_gyro_as_a_foot_lands_has_to_be_shown_for_longer(
    landing: float, lasts: float
) -> None:
    """Of 13 that jumped within 12 ms of one none was named; of 20 sound ones on stairs 2 were."""
    assert named_after(landing) == pytest.approx(lasts, abs=2.1 * DT)


def test_feet_that_come_down_long_after_it_do_not_show_a_jump() -> None:
    """After a flight they slide: a sound gyro was accused on blocks at 1 m/s."""
    assert named_after(0.0, SEEN_AFTER - 0.02) < LONGEST_JUMP
    assert math.isinf(named_after(0.0, SEEN_AFTER + 0.02))
