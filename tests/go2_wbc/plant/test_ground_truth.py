"""Ground truth is what the simulator holds, one row per tick, and changes nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.recording import true_runs
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand
from tests.go2_wbc.plant.contract import same
from tests.go2_wbc.plant.helpers import STAND, empty_recording

TICKS = 20
SERVO = JointCommand.servo(STAND, np.zeros(12), 60.0, 3.0)


def test_every_tick_is_a_row_with_what_the_simulator_holds() -> None:
    plant = MujocoPlant(sensors="noisy", seed=3)
    truth = GroundTruth(plant)
    for _ in range(TICKS):
        truth.write(SERVO)
    recorded = truth.recording()
    assert len(recorded.time) == TICKS + 1
    assert np.diff(recorded.time) == pytest.approx(plant.control_period)
    assert recorded.time[-1] == plant.time
    masses = plant.model.body_mass[1:, None]
    com = (masses * plant.data.xipos[1:]).sum(axis=0) / masses.sum()
    assert recorded.p_world_com[-1] == pytest.approx(com, abs=1e-12)
    assert np.array_equal(recorded.p_world_feet[-1], plant.p_world_feet)


def test_recording_changes_nothing_for_the_controller() -> None:
    bare, recorded = MujocoPlant(seed=1), GroundTruth(MujocoPlant(seed=1))
    for _ in range(TICKS):
        bare.write(SERVO)
        recorded.write(SERVO)
    assert same(bare.read(), recorded.read())
    assert recorded.control_period == bare.control_period


def test_a_recording_begins_with_the_present_state_or_at_a_time() -> None:
    truth = GroundTruth(MujocoPlant())
    for _ in range(TICKS):
        truth.write(SERVO)
    truth.clear()
    assert truth.recording().time.tolist() == [truth.start]
    assert truth.start == truth.read().time
    for _ in range(TICKS):
        truth.write(SERVO)
    whole, middle = truth.recording(), 0.5 * TICKS * truth.control_period
    part, late = truth.recording(middle), whole.since(middle)
    for name in part.__slots__:
        assert np.array_equal(getattr(part, name), getattr(late, name), equal_nan=name[1:3] == "_w")
    assert truth.recording(math.inf).time.tolist() == [whole.time[-1]]


def test_what_was_recorded_is_what_the_plant_said_at_that_tick() -> None:
    plant = MujocoPlant()
    truth = GroundTruth(plant)
    said = [plant.foot_contacts()]
    for _ in range(TICKS):
        truth.write(JointCommand.torque(np.full(12, 8.0)))
        said.append(plant.foot_contacts())
    recorded = truth.recording()
    points = np.array([contacts.p_world_contact for contacts in said])
    velocities = np.array([contacts.v_world_contact for contacts in said])
    assert np.array_equal(recorded.p_world_contacts, points, equal_nan=True)
    assert np.array_equal(recorded.v_world_contacts, velocities)
    assert len(np.unique(velocities, axis=0)) > TICKS // 2


def test_what_shall_happen_in_a_call_is_called_after_every_tick() -> None:
    truth, times = GroundTruth(MujocoPlant()), list[float]()
    truth.on_tick = lambda: times.append(truth.read().time)
    for _ in range(3):
        truth.write(SERVO)
    assert times == pytest.approx(truth.recording().time[1:].tolist())


@pytest.mark.parametrize(
    ("roll", "said"), [(0.0, "trunk is on the ground"), (math.pi, "fell by t=0.40 s: tilt 17")]
)
def test_a_robot_on_its_trunk_or_its_back_has_fallen(roll: float, said: str) -> None:
    plant = MujocoPlant()
    truth = GroundTruth(plant)
    q = np.zeros(19)
    q[2], q[3], q[6] = 0.12, math.sin(roll / 2), math.cos(roll / 2)
    q[7:] = np.tile([0.0, 1.4, -2.7], 4)
    plant.place(q, np.zeros(18))
    for _ in range(200):
        truth.write(JointCommand.damping(3.0))
    assert said in str(truth.fall())


def test_a_standing_robot_has_not_fallen_and_one_that_is_not_finite_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant = MujocoPlant()
    q = np.concatenate([[0.0, 0.0, 0.34, 0.0, 0.0, 0.0, 1.0], STAND])
    plant.place(q, np.zeros(18))
    assert GroundTruth(plant).fall() is None
    truth, state = GroundTruth(plant), plant.truth()
    broken = replace(state, q=np.where(np.arange(19) == 2, math.nan, state.q))
    monkeypatch.setattr(plant, "truth", lambda: broken)
    assert truth.fall() is not None


def test_a_recording_has_its_velocity_by_heading_torques_by_motor_and_parts_in_step() -> None:
    recorded = empty_recording(11, np.zeros((11, 4, 3)))
    recorded.rpy[:, 2] = math.pi / 2
    recorded.p_world_com[:, :2] = recorded.time[:, None] * [0.2, 0.5]  # y is ahead, -x is left
    assert recorded.com_velocity == pytest.approx(np.tile([0.5, -0.2, 0.0], (10, 1)))
    recorded = empty_recording(10, np.zeros((10, 4, 3)))
    assert recorded.since(0.0041).time == pytest.approx(0.002 * np.arange(3, 10))
    part = recorded.part(slice(2, 5))
    assert {len(getattr(part, name)) for name in part.__slots__} == {3}
    flags = np.array([1, 0, 1, 1, 0, 1], dtype=bool)
    assert true_runs(flags) == [slice(0, 1), slice(2, 4), slice(5, 6)]
    assert true_runs(np.zeros(3, dtype=bool)) == []


def test_shares_and_distances_are_those_of_the_worst_joint() -> None:
    model = RobotModel()
    recorded = empty_recording(3, np.zeros((3, 4, 3)))
    recorded.tau[1, 5] = -0.5 * model.torque_limits[5]
    recorded.v[2, 6 + 4] = -0.25 * model.speed_limits[4]
    recorded.q[:, 7:] = 0.5 * (model.q_lower + model.q_upper)
    recorded.q[2, 7 + 8] = model.q_upper[8] + 0.1
    assert recorded.torque_shares(model) == pytest.approx([0.0, 0.5, 0.0])
    assert recorded.peak_speed_share(model) == pytest.approx(0.25)
    assert recorded.joint_distance(model) == pytest.approx(-0.1)


def test_a_torque_counts_against_what_its_motor_gives_at_the_start_of_the_tick() -> None:
    model, ideal = RobotModel(), RobotModel(motor="ideal")
    recorded = empty_recording(3, np.zeros((3, 4, 3)))
    recorded.v[0, 6 + 4] = 0.725 * model.speed_limits[4]  # half way from the knee to no load
    recorded.tau[1:, 4] = 0.25 * model.torque_limits[4]
    assert recorded.torque_shares(model) == pytest.approx([0.0, 0.5, 0.25])
    assert recorded.torque_shares(ideal) == pytest.approx([0.0, 0.25, 0.25])


def test_what_a_command_asks_for_is_recorded_beside_what_the_motors_gave() -> None:
    truth = GroundTruth(MujocoPlant())
    model, before = RobotModel(), truth.read()
    servo = JointCommand.servo(before.joint_positions + 0.5, np.full(12, 3.0), 100.0, 2.0)
    truth.write(servo)
    recorded = truth.recording()
    asked = servo.asked(before.joint_positions, before.joint_velocities)
    np.testing.assert_array_equal(recorded.tau_asked, [np.zeros(12), asked])
    lower, upper = model.motor.limits(before.joint_velocities)
    np.testing.assert_array_equal(recorded.tau[1], np.clip(asked, lower, upper))
    assert np.abs(asked / recorded.tau[1]).max() > 2.0
