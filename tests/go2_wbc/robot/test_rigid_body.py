"""The snapshot of a Go2 is what Pinocchio's own functions say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload, fill_snapshot
from go2_wbc.robot.state import RobotState, Snapshot
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state, state_of

MODEL = RobotModel()
ROUNDING = 1e-12  # [SI] of values up to 1000; measured 1e-13
FAST_ROUNDING = 1e-10  # [SI] of values up to 20,000; measured 1e-11
STATES = 1000
NAMES = Snapshot.part_names()[2:]
PAYLOAD = """<link name="payload"><inertial><origin xyz="0.1 -0.05 0.12" rpy="0.3 0.2 0.1"/>
<mass value="4.0"/><inertia ixx="0.05" ixy="0.01" ixz="0.005" iyy="0.07" iyz="0.002" izz="0.03"/>
</inertial></link><joint name="payload_joint" type="fixed"><parent link="{link}"/>
<child link="payload"/><origin xyz="0.02 0.03 0.04" rpy="0.5 0.4 0.3"/></joint></robot>"""


POINT_MASS = """<link name="payload"><inertial><origin xyz="0 0 0" rpy="0 0 0"/>
<mass value="4.0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
</inertial></link><joint name="payload_joint" type="fixed"><parent link="base"/>
<child link="payload"/><origin xyz="0.1 -0.05 0.12" rpy="0 0 0"/></joint></robot>"""


def difference(a: Snapshot, b: Snapshot) -> float:
    """Largest difference of any number of two snapshots."""
    return max(float(np.abs(getattr(a, n) - getattr(b, n)).max()) for n in NAMES)


def fast_state(rng: np.random.Generator) -> RobotState:
    """Any attitude, any joint angles, and faster than any Go2."""
    attitude = Rotation.random(rng=rng).as_quat()
    q = np.concatenate([rng.normal(size=3), attitude, rng.uniform(-np.pi, np.pi, size=12)])
    return state_of(q, np.concatenate([rng.normal(scale=5.0, size=6), 30.0 * rng.normal(size=12)]))


@pytest.mark.parametrize("foot_radius", [0.022, 0.0])
def test_every_quantity_is_what_pinocchio_says(foot_radius: float) -> None:
    model = RobotModel(foot_radius=foot_radius)
    rng = np.random.default_rng(3)
    for _ in range(STATES):
        state = random_state(rng, tilt=0.7)
        assert difference(model.snapshot(state), model.pinocchio_snapshot(state)) < ROUNDING


def test_every_quantity_is_pinocchios_in_any_attitude_and_with_a_payload() -> None:
    rng = np.random.default_rng(6)
    for _ in range(STATES):
        state = fast_state(rng)
        assert difference(MODEL.snapshot(state), MODEL.pinocchio_snapshot(state)) < FAST_ROUNDING
    rng = np.random.default_rng(9)
    for mass in (3.0, 0.0, 7.5, 7.5):
        payload = Payload(mass, tuple(rng.uniform(-0.2, 0.2, size=3).tolist()))
        for _ in range(20):
            state = fast_state(rng)
            ours, theirs = MODEL.snapshot(state, payload), MODEL.pinocchio_snapshot(state, payload)
            assert difference(ours, theirs) < FAST_ROUNDING
    state = fast_state(np.random.default_rng(11))
    bare = MODEL.snapshot(state).row.copy()
    MODEL.snapshot(state, Payload(3.0, (0.1, 0.0, 0.0)))
    np.testing.assert_array_equal(MODEL.snapshot(state, NO_PAYLOAD).row, bare)


@pytest.mark.parametrize("link", ["base", "FR_hip", "RL_thigh", "RR_calf"])
def test_it_is_for_a_robot_that_carries_something(tmp_path: Path, link: str) -> None:
    path = tmp_path / "robot.urdf"
    urdf = find_description().urdf_path.read_text(encoding="utf-8")
    path.write_text(urdf.replace("</robot>", PAYLOAD.format(link=link)), encoding="utf-8")
    model = RobotModel(find_description(path), armature=np.linspace(0.001, 0.012, 12))
    rng = np.random.default_rng(7)
    assert model.mass == pytest.approx(RobotModel().mass + 4.0)
    for _ in range(100):
        state = fast_state(rng)
        assert difference(model.snapshot(state), model.pinocchio_snapshot(state)) < FAST_ROUNDING


def test_a_payload_is_a_part_of_the_trunk(tmp_path: Path) -> None:
    """The same as a point mass in the robot's description, and it says where the CoM was."""
    path, place = tmp_path / "robot.urdf", (0.1, -0.05, 0.12)
    urdf = find_description().urdf_path.read_text(encoding="utf-8")
    path.write_text(urdf.replace("</robot>", POINT_MASS), encoding="utf-8")
    heavy, model = RobotModel(find_description(path)), RobotModel()
    state = fast_state(np.random.default_rng(10))
    carrying, bare = model.snapshot(state, Payload(4.0, place)), model.snapshot(state)
    same = heavy.snapshot(state)
    for name in set(NAMES) - {"payload", "com_shift"}:
        assert getattr(carrying, name) == pytest.approx(getattr(same, name), abs=1e-6), name
    moved = carrying.p_world_com - bare.p_world_com
    np.testing.assert_allclose(carrying.com_shift, moved, atol=1e-12)
    assert np.linalg.norm(carrying.com_shift) > 0.02
    assert carrying.payload == pytest.approx([4.0, 4.0 * model.gravity])


def test_a_robot_with_other_joints_gets_pinocchios_snapshot() -> None:
    """``robot.rigid_body`` knows hips that turn about x, not about an axis tilted by 0.1 rad."""
    model, same = RobotModel(), RobotModel()
    for robot, angle in ((model, 0.1), (same, 0.0)):
        place = robot.pin_model.jointPlacements[3]
        tilted = pin.SE3(pin.utils.rotate("x", angle), place.translation)
        robot.pin_model.jointPlacements[3] = tilted
    state = random_state(np.random.default_rng(8))
    assert difference(model.snapshot(state), model.pinocchio_snapshot(state)) == 0.0
    assert 0.0 < difference(same.snapshot(state), same.pinocchio_snapshot(state)) < ROUNDING
    assert model.snapshot(state).row.shape == same.snapshot(state).row.shape
    assert difference(model.snapshot(state), same.snapshot(state)) > 0.01


def test_the_comparison_notices_a_wrong_number() -> None:
    snapshot = MODEL.snapshot(random_state(np.random.default_rng(0)))
    drift = snapshot.drift_contacts + 1e-9
    assert difference(snapshot, snapshot.replaced(drift_contacts=drift)) > ROUNDING


def test_whatever_memory_a_state_has_it_is_taken_and_a_nan_is_seen() -> None:
    state = random_state(np.random.default_rng(2))
    strided = replace(state, q=np.repeat(state.q, 2)[::2], v=np.repeat(state.v, 3)[::3])
    frozen = replace(state, q=state.q.copy(), v=state.v.copy())
    frozen.q.flags.writeable = frozen.v.flags.writeable = False
    for other in (strided, frozen):
        np.testing.assert_array_equal(MODEL.snapshot(other).row, MODEL.snapshot(state).row)
    state = random_state(np.random.default_rng(5))
    q = state.q.copy()
    q[8] = np.nan
    assert np.isnan(MODEL.snapshot(replace(state, q=q)).p_world_feet).any()


def test_compiled_is_plain() -> None:
    state = fast_state(np.random.default_rng(12))
    robot = MODEL._bodies
    assert robot is not None
    for numbers in (robot, MODEL._loaded(robot, Payload(3.0, (0.1, -0.05, 0.1)))):
        snapshot = Snapshot.of_row(
            state, np.full(len(MODEL.snapshot(state).row), np.nan), MODEL.profile
        )
        assert_plain_is_compiled(fill_snapshot, state.q, state.v, numbers, snapshot)
