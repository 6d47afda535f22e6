"""The simulated Go2 keeps the plant contract and Pinocchio's conventions, and is repeatable."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import ClosedError, CommandError, ConfigError, PlantError
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.viewer import PlantViewer, display_problem
from go2_wbc.plant.sensors import SensorNoise
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import TORQUE_SPEED
from go2_wbc.robot.state import JointCommand, RobotState
from tests.go2_wbc.plant.contract import DAMPED, PlantContract, same
from tests.go2_wbc.plant.helpers import GRAVITY, STAND, fly, stand_up

# The contacts of a lying robot creep a little: dry friction and limits are soft constraints.
STATIC_TOLERANCE = 5e-3
# Identities that hold exactly for the integrator; rounding of sums of numbers of order one.
EXACT = 1e-9


class TestMujocoPlantContract(PlantContract):
    """The common suite."""


class TestNoisyMujocoPlantContract(PlantContract):
    """The common suite, with noisy sensors and several physics steps in a control period."""

    @pytest.fixture
    def plant(self) -> MujocoPlant:
        return MujocoPlant(sensors="noisy", timestep=0.001, control_period=0.004)


def test_the_robot_starts_lying_still_on_its_belly_and_stays(plant: MujocoPlant) -> None:
    state = plant.read()
    assert state.time == plant.data.time == 0.0
    assert state.tilt < np.deg2rad(10)
    assert state.p_world_base[2] < 0.1
    assert np.abs(state.v).max() < 0.01
    assert plant.base_contact_force > 50.0
    before = plant.read()
    for _ in range(5000):
        plant.write(DAMPED)
    assert np.abs(plant.read().q - before.q).max() < STATIC_TOLERANCE


@pytest.mark.parametrize("yaw", [-2.5, 0.7])
def test_the_initial_heading_is_the_one_asked_for(yaw: float) -> None:
    assert MujocoPlant(initial_yaw=yaw).read().rpy[2] == pytest.approx(yaw, abs=0.01)


def test_initial_joint_noise_moves_the_joints_by_the_seed() -> None:
    poses = [
        MujocoPlant(initial_joint_noise=0.05, seed=seed).read().joint_positions
        for seed in (1, 1, 2)
    ]
    assert np.array_equal(poses[0], poses[1])
    assert np.abs(poses[0] - poses[2]).max() > 0.005


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"timestep": 0.0}, "timestep"),
        ({"timestep": 0.002, "control_period": 0.003}, "integer multiple"),
        ({"timestep": 0.004, "control_period": 0.002}, "integer multiple"),
        ({"friction": -1.0}, "friction"),
        ({"payload": -1.0}, "payload"),
        ({"mass_scale": 0.0}, "mass_scale"),
        ({"initial_joint_noise": -0.1}, "initial_joint_noise"),
        ({"sensors": "perfect"}, "ideal, imu, noisy"),
        ({"motor": "perfect"}, "ideal, torque-speed"),
    ],
)
def test_a_wrong_setting_is_refused_by_name(settings: dict[str, Any], word: str) -> None:
    with pytest.raises(ConfigError, match=word):
        MujocoPlant(**settings)


def spinning(share: float, motor: str = TORQUE_SPEED) -> tuple[MujocoPlant, np.ndarray]:
    """A plant in the air whose joints turn at ``share`` of their speed, and that speed."""
    plant = MujocoPlant(motor=motor)
    speeds = share * np.array(find_description().speeds)
    q = np.concatenate([[0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0], STAND])
    plant.place(q, np.concatenate([np.zeros(6), speeds]))
    return plant, speeds


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 1.2, -0.6])
def test_a_driving_torque_is_cut_to_what_the_motor_gives_at_that_speed(share: float) -> None:
    direction = np.sign(share)
    plant, speeds = spinning(share)
    plant.write(JointCommand.torque(np.full(12, 1000.0 * direction)))
    available = direction * np.tile([23.7, 23.7, 45.43], 4)
    available *= np.clip((1.0 - abs(share)) / (1.0 - 0.45), 0.0, 1.0)
    assert plant.read().tau == pytest.approx(available, abs=0.1)  # the knee is at 0.4485
    lower, upper = plant.motor.limits(speeds)
    assert np.array_equal(plant.read().tau, upper if share > 0 else lower)


def test_a_torque_meets_the_motors_line_when_it_drives_and_its_peak_when_it_brakes() -> None:
    plant, _ = spinning(0.9)
    plant.write(JointCommand.torque(np.full(12, -1000.0)))
    assert np.array_equal(plant.read().tau, -plant.torque_limits)
    plant, _ = spinning(0.9, motor="ideal")
    plant.write(JointCommand.torque(np.full(12, 1000.0)))
    assert np.array_equal(plant.read().tau, plant.torque_limits)
    plant, speeds = spinning(0.8)
    plant.write(JointCommand.servo(STAND + 10.0, np.zeros(12), 60.0, 0.0))
    assert np.array_equal(plant.read().tau, RobotModel().motor.limits(speeds)[1])


@pytest.mark.parametrize(("motor", "is_passed"), [("torque-speed", False), ("ideal", True)])
def test_no_motor_drives_its_joint_beyond_its_speed_without_load(
    motor: str, is_passed: bool
) -> None:
    """The line is evaluated at every physics step, at the speed of that step."""
    plant = MujocoPlant(control_period=0.01, motor=motor)
    q = np.concatenate([[0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0], STAND])
    q[7 + 4] = -1.5  # the thigh has the longest way
    plant.place(q)
    fastest = 0.0
    while plant.read().joint_positions[4] < 3.0:
        plant.write(JointCommand.torque(23.7 * np.eye(12)[4]))
        fastest = max(fastest, plant.read().joint_velocities[4])
    assert fastest > 20.0
    assert (fastest > 30.1) == is_passed


def test_the_motor_law_is_evaluated_at_every_physics_step() -> None:
    coarse, fine = MujocoPlant(control_period=0.01), MujocoPlant(control_period=0.002)
    saved = coarse.save()
    fine.restore(saved)
    command = JointCommand.servo(STAND, np.zeros(12), 20.0, 1.0)
    torques = []
    for _ in range(20):
        coarse.write(command)
        for _ in range(5):
            fine.write(command)
            torques.append(fine.read().tau)
        assert np.array_equal(coarse.read().q, fine.read().q)
        assert np.allclose(coarse.read().tau, np.mean(torques[-5:], axis=0), atol=EXACT)
    assert np.ptp(torques[:5], axis=0).max() > 0.1  # it really changed within one period


def test_the_motor_law_has_the_documented_terms_on_each_joint(plant: MujocoPlant) -> None:
    state = fly(plant, speed=0.1)
    rng = np.random.default_rng(3)
    tau, q_des, v_des, kp, kd = rng.uniform(0.0, 1.0, (5, 12))
    plant.write(JointCommand(tau, q_des, v_des, kp, kd))
    expected = tau + kp * (q_des - state.joint_positions) + kd * (v_des - state.joint_velocities)
    assert np.allclose(plant.read().tau, expected, atol=EXACT)
    saved = plant.save()
    for joint in range(12):
        plant.restore(saved)
        fly(plant, speed=0.0)
        plant.write(JointCommand.torque(np.eye(12)[joint] * 5.0))
        velocities = plant.read().joint_velocities
        assert np.argmax(np.abs(velocities)) == joint
        assert velocities[joint] > 0.0


@pytest.mark.parametrize("seed", range(5))
def test_velocities_are_the_derivatives_of_positions_in_pinocchios_conventions(
    plant: MujocoPlant, seed: int
) -> None:
    before = fly(plant, seed)
    plant.write(DAMPED)
    after, dt = plant.read(), plant.control_period
    linear = (after.p_world_base - before.p_world_base) / dt
    turn = pin.log3(before.R_world_base.T @ after.R_world_base) / dt
    assert np.allclose(after.R_world_base @ after.v[:3], linear, atol=EXACT)
    assert np.allclose(after.v[3:6], turn, atol=EXACT)
    joints = (after.joint_positions - before.joint_positions) / dt
    assert np.allclose(after.joint_velocities, joints, atol=EXACT)


def test_a_placed_state_is_read_back_and_one_that_is_not_finite_refused(plant: MujocoPlant) -> None:
    rng = np.random.default_rng(5)
    q = np.concatenate([[1.0, -2.0, 3.0], rng.standard_normal(4), STAND + 0.1])
    q[3:7] /= np.linalg.norm(q[3:7])
    v = rng.standard_normal(18)
    plant.place(q, v)
    assert np.allclose(plant.read().q, q, atol=EXACT)
    assert np.allclose(plant.read().v, v, atol=EXACT)
    with pytest.raises(CommandError):
        plant.place(np.full(19, np.nan))


def test_the_feet_are_where_pinocchio_puts_them(plant: MujocoPlant, robot: pin.Model) -> None:
    state = fly(plant, 2)
    data = robot.createData()
    pin.framesForwardKinematics(robot, data, state.q)
    expected = [data.oMf[robot.getFrameId(name)].translation for name in FOOT_NAMES]
    assert np.allclose(plant.p_world_feet, expected, atol=EXACT)


def test_the_imu_feels_gravity_standing_and_nothing_falling(plant: MujocoPlant) -> None:
    state, sample = stand_up(plant, 4.0), plant.imu()
    assert np.allclose(state.R_world_base @ sample.accelerometer, [0, 0, GRAVITY], atol=0.02)
    assert np.allclose(sample.gyro, state.v[3:6], atol=EXACT)
    assert np.allclose(sample.quaternion, state.q[3:7], atol=EXACT)
    fly(plant, speed=0.0)
    plant.write(JointCommand.torque(np.zeros(12)))
    assert np.abs(plant.imu().accelerometer).max() < 1e-6


def history(plant: MujocoPlant, ticks: int = 200) -> list[RobotState]:
    states = []
    for _ in range(ticks):
        plant.write(JointCommand.servo(STAND, np.zeros(12), 30.0, 2.0))
        states.append(plant.read())
    return states


@pytest.mark.parametrize("sensors", ["ideal", "noisy", "imu"])
def test_the_same_seed_gives_the_same_history_bit_by_bit(sensors: str) -> None:
    first, second = (MujocoPlant(sensors=sensors, seed=4) for _ in range(2))
    assert all(map(same, history(first), history(second)))


def test_another_seed_gives_other_noise() -> None:
    first, second = (MujocoPlant(sensors="noisy", seed=seed).read().q for seed in (4, 5))
    assert not np.array_equal(first, second)


@pytest.mark.parametrize("sensors", ["ideal", "noisy", "imu"])
def test_a_restored_plant_goes_on_as_it_did_even_in_the_middle_of_a_push(sensors: str) -> None:
    plant = MujocoPlant(sensors=sensors)
    plant.push(np.array([0.0, 100.0, 0.0]), 0.3)
    history(plant, 50)
    saved = plant.save()
    at_save = plant.read()
    first = history(plant)
    plant.restore(saved)
    assert same(plant.read(), at_save)
    assert all(map(same, first, history(plant)))


@pytest.mark.parametrize("saves", [{}, {"sensors": "imu", "lidar": True}])
@pytest.mark.parametrize("restores", [{}, {"sensors": "imu", "lidar": True}])
def test_a_plant_goes_back_to_what_one_with_other_sensors_has_saved(
    saves: dict[str, Any], restores: dict[str, Any]
) -> None:
    saving, restoring = MujocoPlant(**saves), MujocoPlant(**restores)
    history(saving, 20)
    restoring.restore(saving.save())
    assert same(restoring.truth(), saving.truth())
    restoring.write(DAMPED)
    assert restoring.read().time == pytest.approx(saving.time + restoring.control_period)


def test_the_truth_is_that_of_this_moment_after_all_that_changes_it() -> None:
    plant = MujocoPlant(sensors="noisy")
    saved, lying = plant.save(), plant.truth()
    plant.write(DAMPED)
    fallen = plant.truth()
    assert fallen.time > lying.time
    assert np.array_equal(fallen.q[:3], plant.data.qpos[:3])
    plant.place(np.concatenate([[1.0, -2.0, 3.0], lying.q[3:]]))
    assert plant.truth().q[2] == 3.0
    plant.restore(saved)
    assert same(plant.truth(), lying)


def test_noise_has_the_configured_size() -> None:
    noise = SensorNoise()
    noisy, ideal = MujocoPlant(sensors="noisy"), MujocoPlant()
    errors_q, errors_v, errors_turn = [], [], []
    for _ in range(1000):
        noisy.write(DAMPED)
        ideal.write(DAMPED)
        got, true = noisy.read(), ideal.read()
        errors_q.append((got.q - true.q)[[0, 1, 2, *range(7, 19)]])
        errors_v.append(got.v - true.v)
        errors_turn.append(pin.log3(true.R_world_base.T @ got.R_world_base))
    found = np.std(errors_q, axis=0)
    assert np.allclose(found[:3], noise.position, rtol=0.15)
    assert np.allclose(found[3:], noise.joint_position, rtol=0.15)
    found = np.std(errors_v, axis=0)
    assert np.allclose(found[:3], noise.linear_velocity, rtol=0.15)
    assert np.allclose(found[3:6], noise.gyro, rtol=0.15)
    assert np.allclose(found[6:], noise.joint_velocity, rtol=0.15)
    assert np.allclose(np.std(errors_turn, axis=0), noise.orientation, rtol=0.15)


def test_physics_that_diverges_is_reported_and_a_restored_plant_works_again(
    plant: MujocoPlant, caplog: pytest.LogCaptureFixture
) -> None:
    saved = plant.save()
    state = plant.read()
    plant.place(state.q, np.full(18, 1e12))
    with pytest.raises(PlantError, match="physics failed at t="):
        plant.write(DAMPED)
    assert "MuJoCo" in caplog.text
    plant.restore(saved)
    plant.write(DAMPED)
    assert np.allclose(plant.read().q, state.q, atol=1e-3)


def test_a_closed_plant_refuses_pushes_and_measurements(plant: MujocoPlant) -> None:
    plant.close()
    with pytest.raises(ClosedError):
        plant.push(np.ones(3), 0.1)
    with pytest.raises(ClosedError):
        plant.foot_contacts()


def test_the_viewer_without_a_display_says_so_instead_of_ending_the_process(
    plant: MujocoPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(PlantError, match="no display"):
        PlantViewer(plant)
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    assert display_problem() is None

    def on_macos(*_: object) -> None:
        raise RuntimeError("must be run under `mjpython` on macOS")

    monkeypatch.setattr("mujoco.viewer.launch_passive", on_macos)
    with pytest.raises(PlantError, match=r"cannot open the viewer: .*mjpython"):
        PlantViewer(plant)
