"""What is read off a measured state, and the snapshot, against Pinocchio."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import CommandError
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import JointCommand, RobotState, Snapshot
from tests.engine_helpers import moved, random_state, standing_q, state_of

EXACT = 1e-12  # rounding of numbers of order one
SEEDS = range(30)
STEP = 1e-5  # [s] of the central differences
DIFFERENCE = 1e-6  # error of a first difference; measured 3e-9
SECOND_STEP = 1e-4  # [s] larger: rounding enters a second difference as 1e-16 / step^2
SECOND_DIFFERENCE = 1e-4  # [m/s^2] of second differences; measured 1e-6
PINOCCHIO_EXACT = 1e-10  # the same quantity by another algorithm, numbers up to 100
POSES = range(15)

MODEL = RobotModel()


@pytest.mark.parametrize("seed", SEEDS)
def test_orientation_angles_and_tilt_are_pinocchios(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = random_state(rng, tilt=0.6)
    R = pin.Quaternion(state.q[3:7]).matrix()
    np.testing.assert_allclose(state.R_world_base, R, atol=EXACT)
    np.testing.assert_allclose(state.rpy, pin.rpy.matrixToRpy(R), atol=1e-9)
    np.testing.assert_allclose(rotation_from_rpy(*state.rpy), R, atol=1e-9)
    up = R @ np.array([0.0, 0.0, 1.0])
    assert state.tilt == pytest.approx(np.arccos(up[2]), abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2, 2.5, np.pi])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_tilt_goes_up_to_half_a_turn_and_ignores_yaw(angle: float, axis: int) -> None:
    lean = pin.AngleAxis(angle, np.eye(3)[axis]).matrix()
    R = rotation_from_rpy(0.0, 0.0, 1.3) @ lean
    q = standing_q()
    q[3:7] = pin.Quaternion(R).coeffs()
    assert state_of(q).tilt == pytest.approx(angle, abs=1e-7)


def test_parts_of_a_state_are_pinocchios_and_its_pitch_at_the_pole_is_finite() -> None:
    q = standing_q()
    q[3:7] = pin.Quaternion(rotation_from_rpy(0.0, np.pi / 2, 0.0)).coeffs() * (1 + 1e-12)
    assert state_of(q).rpy[1] == pytest.approx(np.pi / 2, abs=1e-5)
    state = state_of(np.arange(19.0), np.arange(18.0))
    np.testing.assert_array_equal(state.p_world_base, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(state.joint_positions, np.arange(7.0, 19.0))
    np.testing.assert_array_equal(state.joint_velocities, np.arange(6.0, 18.0))


def test_states_and_commands_are_equal_whose_numbers_all_are() -> None:
    state = random_state(np.random.default_rng(0))
    command = JointCommand(*np.random.default_rng(0).normal(size=(5, 12)))
    assert state == state.read_only()
    assert command == replace(command, tau=command.tau.copy())
    assert state != command
    assert state != state.q.tolist()
    for one, names in (state, ("q", "v", "tau", "foot_forces")), (command, ("tau", "q_des", "kd")):
        for name in names:
            other = getattr(one, name).copy()
            other[-1] += 1e-9
            assert one != replace(one, **{name: other}), name
    assert state != replace(state, time=state.time + 1e-3)
    assert state != replace(state, feet_in_contact=~state.feet_in_contact)
    unknown = replace(state, v=np.full(18, np.nan))
    assert unknown == unknown.read_only()


def test_a_torque_command_has_no_servo_and_a_servo_no_torque() -> None:
    tau = np.arange(12.0)
    torque = JointCommand.torque(tau)
    np.testing.assert_array_equal(torque.tau, tau)
    assert not torque.kp.any()
    assert not torque.kd.any()
    servo = JointCommand.servo(tau, 2 * tau, kp=30.0, kd=1.0)
    assert not servo.tau.any()
    np.testing.assert_array_equal(servo.q_des, tau)
    np.testing.assert_array_equal(servo.v_des, 2 * tau)
    assert set(servo.kp) == {30.0}
    assert set(servo.kd) == {1.0}
    damping = JointCommand.damping(3.0)
    assert not damping.tau.any()
    assert not damping.kp.any()
    assert set(damping.kd) == {3.0}


def test_the_shared_zeros_of_commands_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        JointCommand.damping(1.0).tau[0] = 1.0


def scene(seed: int) -> tuple[RobotState, np.ndarray, Snapshot]:
    """A brisk random state, an acceleration, and the state's snapshot."""
    rng = np.random.default_rng(seed)
    state = random_state(rng, tilt=0.3)
    return state, rng.normal(scale=3.0, size=18), MODEL.snapshot(state)


def difference(name: str, state: RobotState, a: np.ndarray) -> np.ndarray:
    """Rate of a quantity along the motion with acceleration ``a``."""
    states = (moved(MODEL, state, a, dt) for dt in (-STEP, STEP))
    before, after = (getattr(MODEL.snapshot(moment), name) for moment in states)
    return (after - before) / (2 * STEP)


@pytest.mark.parametrize("seed", POSES)
def test_mass_matrix_and_bias_are_symmetric_positive_definite_and_pinocchios(seed: int) -> None:
    state, a, snapshot = scene(seed)
    M, robot = snapshot.mass_matrix, MODEL.pin_model
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0.0
    data = robot.createData()
    for given, expected in ((a, M @ a + snapshot.bias), (np.zeros(18), snapshot.bias)):
        needed = pin.rnea(robot, data, state.q, state.v, given)
        np.testing.assert_allclose(expected, needed, atol=PINOCCHIO_EXACT)


@pytest.mark.parametrize("seed", POSES)
def test_the_com_and_its_jacobian_are_pinocchios(seed: int) -> None:
    state, _, snapshot = scene(seed)
    data = MODEL.pin_model.createData()
    com = pin.centerOfMass(MODEL.pin_model, data, state.q, state.v)
    np.testing.assert_allclose(snapshot.p_world_com, com, atol=PINOCCHIO_EXACT)
    np.testing.assert_allclose(snapshot.v_world_com, data.vcom[0], atol=PINOCCHIO_EXACT)
    J = pin.jacobianCenterOfMass(MODEL.pin_model, data, state.q)
    np.testing.assert_allclose(snapshot.J_com, J, atol=PINOCCHIO_EXACT)


@pytest.mark.parametrize("what", ["com", "feet"])
@pytest.mark.parametrize("seed", POSES)
def test_velocities_are_the_rates_of_the_places(seed: int, what: str) -> None:
    state, a, snapshot = scene(seed)
    rate, v = difference(f"p_world_{what}", state, a), getattr(snapshot, f"v_world_{what}")
    np.testing.assert_allclose(v, rate, atol=DIFFERENCE)
    np.testing.assert_allclose(getattr(snapshot, f"J_{what}") @ state.v, v, atol=PINOCCHIO_EXACT)


@pytest.mark.parametrize("what", ["com", "feet", "contacts"])
@pytest.mark.parametrize("seed", POSES)
def test_jacobians_and_drifts_give_the_rates_of_the_velocities(seed: int, what: str) -> None:
    """A contact moves over the foot: its velocity is that of ever new material."""
    state, a, snapshot = scene(seed)
    rate, J = difference(f"v_world_{what}", state, a), getattr(snapshot, f"J_{what}")
    np.testing.assert_allclose(J @ a + getattr(snapshot, f"drift_{what}"), rate, atol=DIFFERENCE)


def foot_poses(state: RobotState) -> list[pin.SE3]:
    robot = MODEL.pin_model
    data = robot.createData()
    pin.framesForwardKinematics(robot, data, state.q)
    return [data.oMf[robot.getFrameId(name)] for name in FOOT_NAMES]


def material_points(state: RobotState, p_foot_points: np.ndarray) -> np.ndarray:
    """Where points fixed to the feet, given in foot axes (4, 3), are in the world."""
    return np.array([T.act(p) for T, p in zip(foot_poses(state), p_foot_points, strict=True)])


def lowest_points(state: RobotState) -> np.ndarray:
    """The sphere's lowest material point of each foot, in foot axes (4, 3)."""
    down = np.array([0.0, 0.0, -MODEL.foot_radius])
    return np.array([T.rotation.T @ down for T in foot_poses(state)])


def foot_spins(state: RobotState) -> np.ndarray:
    """Angular velocity of each foot in the world (4, 3)."""
    robot = MODEL.pin_model
    data = robot.createData()
    pin.forwardKinematics(robot, data, state.q, state.v)
    pin.updateFramePlacements(robot, data)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    frames = [robot.getFrameId(name) for name in FOOT_NAMES]
    return np.array([pin.getFrameVelocity(robot, data, f, aligned).angular for f in frames])


@pytest.mark.parametrize("seed", POSES)
def test_the_contact_velocity_is_that_of_the_spheres_lowest_material_point(seed: int) -> None:
    state, a, snapshot = scene(seed)
    marks = lowest_points(state)
    before, after = (material_points(moved(MODEL, state, a, dt), marks) for dt in (-STEP, STEP))
    rate = (after - before) / (2 * STEP)
    np.testing.assert_allclose(snapshot.v_world_contacts, rate, atol=DIFFERENCE)


@pytest.mark.parametrize("seed", POSES)
def test_the_material_point_has_the_contact_acceleration_and_a_centripetal_one(seed: int) -> None:
    state, a, snapshot = scene(seed)
    marks = lowest_points(state)
    before, now, after = (
        material_points(moved(MODEL, state, a, dt), marks)
        for dt in (-SECOND_STEP, 0.0, SECOND_STEP)
    )
    acceleration = (after - 2 * now + before) / SECOND_STEP**2
    w = foot_spins(state)
    centripetal = np.cross(w, np.cross(w, [0.0, 0.0, -MODEL.foot_radius]))
    expected = snapshot.J_contacts @ a + snapshot.drift_contacts + centripetal
    np.testing.assert_allclose(acceleration, expected, atol=SECOND_DIFFERENCE)


@pytest.mark.parametrize("seed", POSES)
def test_a_foot_without_contact_velocity_rolls_like_a_sphere_on_a_plane(seed: int) -> None:
    """Its centre moves at r w x n, so the path of the centre is r times the angle turned."""
    state, _, snapshot = scene(seed)
    J = snapshot.J_contacts.reshape(12, 18)
    rolling = state.v - np.linalg.pinv(J) @ (J @ state.v)
    rolled = MODEL.snapshot(state_of(state.q, rolling))
    np.testing.assert_allclose(rolled.v_world_contacts, 0.0, atol=PINOCCHIO_EXACT)
    w = foot_spins(rolled.state)
    normal = np.array([0.0, 0.0, 1.0])
    expected = MODEL.foot_radius * np.cross(w, normal)
    np.testing.assert_allclose(rolled.v_world_feet, expected, atol=PINOCCHIO_EXACT)
    assert np.abs(rolled.v_world_feet).max() > 1e-3


def test_a_snapshot_does_not_change_with_the_next_one() -> None:
    """Pinocchio reuses its memory; a snapshot that shared it would change behind its holder."""
    state, _, held = scene(3)
    fields = held.part_names()
    before = {name: np.array(getattr(held, name)) for name in fields}
    MODEL.snapshot(random_state(np.random.default_rng(4)))
    MODEL.forward_kinematics(random_state(np.random.default_rng(5)).q)
    for name in fields:
        np.testing.assert_array_equal(getattr(held, name), before[name], err_msg=name)
    assert held.state is state


@pytest.mark.parametrize("name", ["tau", "q_des", "v_des", "kp", "kd"])
def test_a_command_that_is_not_finite_or_of_another_shape_is_refused(name: str) -> None:
    good = JointCommand(*np.arange(60.0).reshape(5, 12))
    assert np.array_equal(good.numbers(), np.arange(60.0).reshape(5, 12))
    for bad, said in ((np.full(12, np.nan), "not finite"), (np.zeros(11), "must have shape")):
        with pytest.raises(CommandError, match=rf"command\.{name} .*{said}"):
            replace(good, **{name: bad}).numbers()
    huge = replace(good, **{name: np.full(12, 1e200)})
    assert huge.numbers().max() == 1e200
