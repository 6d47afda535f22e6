"""A user's own MJCF is driven like the built model, or refused with everything it lacks."""

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import ConfigError, ModelMismatch
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import FLOOR, IMU_SITE, JointDynamics, build_spec, drawn_shapes
from go2_wbc.plant.terrain import Boxes
from go2_wbc.robot.description import BASE_LINK, find_description
from go2_wbc.robot.state import JointCommand
from tests.go2_wbc.plant.contract import DAMPED
from tests.go2_wbc.plant.helpers import GRAVITY, STAND, fly, momentum, stand_up

TOTAL_MASS = 16.085  # kg, the sum of the URDF's links
# Our own model, exported with MuJoCo's six digits and read again, stands alike within this [rad].
EXPORT_TOLERANCE = 1e-3
CLOSE = 5e-3  # m; other cones, and feet without their own bodies, sink by 2 mm less

Edit = Callable[[mujoco.MjSpec], None]
Mjcf = Callable[..., Path]


@pytest.fixture
def users_mjcf(tmp_path: Path) -> Mjcf:
    """Writes our model as a user's MJCF, without anything of ours, changed by ``edit``."""

    def write(edit: Edit = lambda _spec: None) -> Path:
        spec = build_spec(find_description(), JointDynamics(), friction=0.8)
        for sensor in list(spec.sensors):
            spec.delete(sensor)
        spec.delete(spec.site(IMU_SITE))
        spec.compile()
        edit(spec)
        path = tmp_path / "user.xml"
        path.write_text(spec.to_xml(), encoding="utf-8")
        return path

    return write


def delete_actuators(spec: mujoco.MjSpec) -> None:
    for actuator in list(spec.actuators):
        spec.delete(actuator)


def test_a_users_model_behaves_like_the_built_one(users_mjcf: Mjcf) -> None:
    user, built = MujocoPlant(users_mjcf()), MujocoPlant()
    assert user.total_mass == pytest.approx(TOTAL_MASS, abs=1e-4)
    assert np.abs(stand_up(user).q - stand_up(built).q)[2:].max() < EXPORT_TOLERANCE
    assert user.read().foot_forces == pytest.approx(built.read().foot_forces, rel=0.02)
    assert user.imu().accelerometer == pytest.approx(built.imu().accelerometer, abs=0.1)


def test_what_is_drawn_of_a_users_model_moves_with_its_joints(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        cube = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [0.01] * 3, "mass": 0.0}
        for body in spec.bodies:
            if body.name in ("base", "FL_hip", "RR_calf", "world"):
                body.add_geom(**cube, rgba=[1, 0, 0, 1], pos=[0.0, 0.0, 0.1])
        spec.body("base").pos, spec.body("base").quat = [1.0, 2.0, 0.5], [0.6, 0.0, 0.0, 0.8]

    meshes, shapes = drawn_shapes(users_mjcf(edit))
    cubes = [one for one in shapes if one.mesh.startswith("box")]
    assert {one.mesh for one in shapes} == meshes.keys()
    assert {one.link: one.joint for one in cubes} == {
        "base": "", "FL_hip": "FL_hip_joint", "RR_calf": "RR_calf_joint"
    }  # fmt: skip
    places = [0.0, 0.0, 0.1], [0.1934, 0.0465, 0.1], [-0.1934, -0.142, -0.113]
    for one, place in zip(cubes, places, strict=True):
        pose = pin.SE3(np.eye(3), np.array(place)).homogeneous
        assert one.T_base_shape == pytest.approx(pose, abs=1e-6)


def test_an_export_that_has_our_sensors_is_accepted(tmp_path: Path) -> None:
    spec = build_spec(find_description(), JointDynamics(), friction=0.8)
    spec.compile()
    path = tmp_path / "own.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    assert MujocoPlant(path).read().tilt < 0.2
    without = re.sub("<sensor>.*?</sensor>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    path.write_text(without, encoding="utf-8")
    assert MujocoPlant(path).imu().accelerometer == pytest.approx(MujocoPlant().imu().accelerometer)


def test_a_scene_without_ground_below_the_robot_is_refused(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        spec.delete(spec.geom(FLOOR))
        spec.worldbody.add_geom(name="step", pos=[3.0, 0, 0], size=[1, 1, 0.1])
        spec.geom("step").type = mujoco.mjtGeom.mjGEOM_BOX

    with pytest.raises(ModelMismatch, match="no ground at x = y = 0"):
        MujocoPlant(users_mjcf(edit))


def test_a_plane_is_ground_also_unseen_and_beyond_what_is_drawn_of_it(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        floor = spec.geom(FLOOR)
        floor.rgba, floor.material, floor.pos = [0.0] * 4, "", [3.0, 0.0, 0.0]
        floor.size = [2.0, 2.0, 0.1]

    assert MujocoPlant(users_mjcf(edit)).read().q[2] < 0.2


def test_motors_and_floor_are_added_and_the_tighter_motor_limit_wins(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        delete_actuators(spec)
        spec.delete(spec.geom(FLOOR))

    plant = MujocoPlant(users_mjcf(edit))
    assert plant.model.nu == 12
    assert np.array_equal(plant.torque_limits, np.tile([23.7, 23.7, 45.43], 4))
    assert stand_up(plant).q[2] == pytest.approx(stand_up(MujocoPlant()).q[2], abs=EXPORT_TOLERANCE)

    def tighten(spec: mujoco.MjSpec) -> None:
        spec.actuator("FR_calf").ctrlrange = [-20.0, 20.0]
        spec.actuator("FR_hip").ctrlrange = [-99.0, 99.0]

    limits = MujocoPlant(users_mjcf(tighten)).torque_limits
    assert limits[5] == 20.0
    assert limits[3] == 23.7


def test_motors_in_another_order_still_drive_their_own_joints(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        delete_actuators(spec)
        for name in sorted(JOINT_NAMES, reverse=True):
            motor = spec.add_actuator(name=f"m_{name}", target=name)
            motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
            motor.set_to_motor()

    plant = MujocoPlant(users_mjcf(edit))
    assert plant.model.nu == 12
    for joint in range(12):
        plant.place(np.concatenate([[0, 0, 3.0, 0, 0, 0, 1.0], STAND]))
        plant.write(JointCommand.torque(5.0 * np.eye(12)[joint]))
        assert np.argmax(np.abs(plant.read().joint_velocities)) == joint


def test_what_stands_before_the_robot_in_the_file_can_be_pushed_too(users_mjcf: Mjcf) -> None:
    path = users_mjcf()
    crate = '<body name="crate" pos="2 0 0.1"><freejoint/><geom size=".1" mass="1"/></body>'
    text = path.read_text(encoding="utf-8").replace("<worldbody>", f"<worldbody>{crate}", 1)
    path.write_text(text, encoding="utf-8")
    plant = MujocoPlant(path)
    plant.push(np.array([0.0, 30.0, 0.0]), 0.1, "crate")
    for _ in range(50):
        plant.write(DAMPED)
    assert plant.data.body("crate").cvel[4] > 1.0  # m/s


def test_a_servo_that_drives_no_leg_is_the_users_own_affair(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        arm = spec.body("base").add_body(name="arm", pos=[0.0, 0.0, 0.1])
        arm.add_joint(name="arm_joint", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
        arm.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], mass=0.1)
        servo = spec.add_actuator(name="arm_servo", target="arm_joint")
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        servo.set_to_position(kp=5.0)

    plant = MujocoPlant(users_mjcf(edit))
    assert plant.model.nu == 13
    assert plant.read().joint_positions.shape == (12,)


def feet_on_the_calves(spec: mujoco.MjSpec) -> None:
    """The Menagerie's way: each foot is a geom ``FL`` of the calf, without a body of its own."""
    for leg in LEGS:
        spec.delete(spec.geom(leg.foot))
        spec.body(leg.foot).name = f"{leg.name}_toe"
        calf = spec.body(f"{leg.name}_calf")
        sphere = mujoco.mjtGeom.mjGEOM_SPHERE
        calf.add_geom(name=leg.name, type=sphere, size=[0.022, 0, 0], pos=[0, 0, -0.213], mass=0.0)
    for exclude in list(spec.excludes):
        spec.delete(exclude)
        second = exclude.bodyname2
        if not second.endswith("_foot"):
            spec.add_exclude(bodyname1=exclude.bodyname1, bodyname2=second)


def with_pyramids(spec: mujoco.MjSpec) -> None:
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL


def with_a_ball(spec: mujoco.MjSpec) -> None:
    ball = spec.worldbody.add_body(name="ball", pos=[1.0, 0.0, 0.1])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], mass=0.2)


@pytest.mark.parametrize("edit", [feet_on_the_calves, with_pyramids, with_a_ball])
def test_the_feet_carry_the_weight_wherever_they_are_in_whatever_scene(
    users_mjcf: Mjcf, edit: Edit
) -> None:
    plant = MujocoPlant(users_mjcf(edit))
    height = stand_up(plant).q[2]
    assert height == pytest.approx(stand_up(MujocoPlant()).q[2], abs=CLOSE)
    assert plant.total_mass == pytest.approx(TOTAL_MASS, abs=1e-4)
    assert plant.read().foot_forces.sum() == pytest.approx(TOTAL_MASS * GRAVITY, rel=5e-3)


def test_a_push_at_a_foot_without_a_body_acts_at_the_foot_not_at_the_calfs_centre(
    users_mjcf: Mjcf,
) -> None:
    plant = MujocoPlant(users_mjcf(feet_on_the_calves))
    urdf = str(find_description().urdf_path)
    robot = pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    state = fly(plant, speed=0.0)
    arm = plant.p_world_feet[LEGS[3]] - pin.centerOfMass(robot, robot.createData(), state.q)
    force = np.array([5.0, 7.0, -3.0])
    plant.push(force, plant.control_period, at="RR_foot")
    plant.write(JointCommand.torque(np.zeros(12)))
    gained = momentum(robot, plant.read())[3:]
    assert gained == pytest.approx(np.cross(arm, force) * plant.control_period, rel=0.01, abs=1e-5)


def test_a_base_of_another_name_is_pushed_by_that_or_by_ours(users_mjcf: Mjcf) -> None:
    path = users_mjcf()
    path.write_text(path.read_text("utf-8").replace(f'"{BASE_LINK}"', '"trunk"'), "utf-8")
    plant, moved = MujocoPlant(path), list[np.ndarray]()
    for at in ("trunk", BASE_LINK):
        fly(plant, speed=0.0)
        plant.push(np.array([30.0, 0.0, 0.0]), plant.control_period, at=at)
        plant.write(JointCommand.torque(np.zeros(12)))
        moved.append(plant.read().v[:3])
    np.testing.assert_allclose(moved[0], moved[1])


def test_friction_of_a_users_model_is_its_own_unless_asked(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        for geom in spec.geoms:
            geom.friction = [0.33, 0.005, 0.0001]

    path = users_mjcf(edit)
    for given, expected in ((None, 0.33), (0.55, 0.55), (0.2, 0.2)):
        plant = MujocoPlant(path, friction=given)
        stand_up(plant)
        assert plant.data.contact.friction[:, 0] == pytest.approx(expected)


def test_joint_dynamics_of_a_users_model_are_its_own_unless_asked(users_mjcf: Mjcf) -> None:
    def edit(spec: mujoco.MjSpec) -> None:
        for name in JOINT_NAMES:
            spec.joint(name).armature = 0.02

    path, none = users_mjcf(edit), JointDynamics.none()
    assert MujocoPlant(path).model.dof_armature[6:] == pytest.approx(0.02)
    assert not MujocoPlant(path, joint_dynamics=none).model.dof_armature.any()
    told = [MujocoPlant(*own).joint_damping for own in ((path,), ())]
    assert [any(damping) for damping in told] == [True, False]  # of ours nobody is told
    assert not any(MujocoPlant(path, joint_dynamics=JointDynamics()).joint_damping)


def rename_joint(spec: mujoco.MjSpec) -> None:
    spec.actuator("FL_hip").target = spec.joint("FL_hip_joint").name = "abductor"


def fix_base(spec: mujoco.MjSpec) -> None:
    spec.delete(spec.joint("root"))


def slide_joint(spec: mujoco.MjSpec) -> None:
    spec.joint("RL_calf_joint").type = mujoco.mjtJoint.mjJNT_SLIDE


def remove_foot(spec: mujoco.MjSpec) -> None:
    spec.delete(spec.geom("RR_foot"))


def make_servo(spec: mujoco.MjSpec) -> None:
    spec.actuator("FR_thigh").set_to_position(kp=50.0)


def make_filtered(spec: mujoco.MjSpec) -> None:
    actuator = spec.actuator("FR_thigh")
    actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTER
    actuator.dynprm[0] = 0.1


def gear(spec: mujoco.MjSpec) -> None:
    spec.actuator("RL_hip").gear = [6.33, 0, 0, 0, 0, 0]


def second_motor(spec: mujoco.MjSpec) -> None:
    motor = spec.add_actuator(name="booster", target="FL_calf_joint")
    motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
    motor.set_to_motor()


def lengthen_thighs(spec: mujoco.MjSpec) -> None:
    for leg in LEGS:
        spec.joint(f"{leg.name}_calf_joint").parent.pos[2] -= 0.02


def make_heavy(spec: mujoco.MjSpec) -> None:
    spec.body("base").mass += 15.0


def take_radians_for_degrees(spec: mujoco.MjSpec) -> None:
    for joint in spec.joints:
        joint.range = np.radians(joint.range)


def flip_axis(spec: mujoco.MjSpec) -> None:
    spec.joint("RL_thigh_joint").axis = [0.0, -1.0, 0.0]


def disable_contacts(spec: mujoco.MjSpec) -> None:
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT


def fall_upward(spec: mujoco.MjSpec) -> None:
    spec.option.gravity = [0, 0, 9.81]


def go_to_the_moon(spec: mujoco.MjSpec) -> None:
    spec.option.gravity = [0.0, 0.0, -1.62]


FAULTS: list[tuple[Edit, str]] = [
    (rename_joint, "no joint FL_hip_joint"),
    (fix_base, "base body 'base' has no free joint"),
    (slide_joint, "RL_calf_joint is not a hinge"),
    (remove_foot, "no foot RR"),
    (make_servo, "actuator FR_thigh of FR_thigh_joint is a position or velocity servo"),
    (make_filtered, "actuator FR_thigh of FR_thigh_joint has internal dynamics"),
    (gear, "actuator RL_hip of RL_hip_joint has gear times gain 6.33"),
    (second_motor, "actuator booster of FL_calf_joint is a second actuator"),
    (lengthen_thighs, "its thigh is 0.233 m, not 0.213 m"),
    (make_heavy, "it weighs 31.1 kg, the robot that is controlled 16.1 kg"),
    (flip_axis, "RL_thigh_joint turns about (0.00, -1.00, 0.00) of the base, not (0, 1, 0)"),
    (disable_contacts, "its <option> disables contacts"),
    (go_to_the_moon, "its gravity is 1.62 m/s^2, the controller reckons with 9.81 downward"),
    (fall_upward, "its gravity is 9.81 m/s^2 upward, the controller"),
    (take_radians_for_degrees, 'it needs <compiler angle="radian"/>'),
]


@pytest.mark.parametrize(("edit", "message"), FAULTS)
def test_each_fault_of_a_users_model_is_named(users_mjcf: Mjcf, edit: Edit, message: str) -> None:
    with pytest.raises(ModelMismatch) as caught:
        MujocoPlant(users_mjcf(edit))
    assert message in str(caught.value)
    assert str(caught.value).count("\n  - ") == 1


def test_all_faults_are_named_at_once(users_mjcf: Mjcf) -> None:
    chosen = [FAULTS[i] for i in (0, 1, 3, 4, 6)]

    def edit(spec: mujoco.MjSpec) -> None:
        for fault, _ in chosen:
            fault(spec)

    with pytest.raises(ModelMismatch) as caught:
        MujocoPlant(users_mjcf(edit))
    assert [message for _, message in chosen if message not in str(caught.value)] == []


def test_a_file_that_is_missing_or_comes_with_terrain_is_refused(
    tmp_path: Path, users_mjcf: Mjcf
) -> None:
    with pytest.raises(ModelMismatch, match=r"nothing\.xml: no such file"):
        MujocoPlant(tmp_path / "nothing.xml")
    with pytest.raises(ConfigError, match="terrain"):
        MujocoPlant(users_mjcf(), terrain=Boxes())


@pytest.mark.parametrize("text", ["", "<mujoco>", "<mujoco><worldbody><cow/></worldbody></mujoco>"])
def test_a_broken_file_is_refused_with_the_reason(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelMismatch, match=r"MuJoCo cannot read .*broken\.xml: \S"):
        MujocoPlant(path)


def test_a_model_that_does_not_compile_is_refused_with_the_reason(users_mjcf: Mjcf) -> None:
    path = users_mjcf()
    text = path.read_text(encoding="utf-8").replace("base_convex.stl", "gone.stl")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelMismatch, match=r"MuJoCo cannot compile (?s:.)*gone\.stl"):
        MujocoPlant(path)
