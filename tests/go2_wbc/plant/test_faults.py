"""What is broken on a simulated robot reads, or gives, what was said; what cannot be is refused."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import CommandError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.faults import FaultKind, Faults, InjectedFault
from go2_wbc.robot.description import find_description
from go2_wbc.robot.state import JointCommand, SensorReading
from tests.go2_wbc.plant.helpers import STAND, stand_up

HOLD = JointCommand.servo(STAND, np.zeros(12), 60.0, 2.0)


def test_a_dead_motor_gives_nothing_from_its_time_on() -> None:
    plant = MujocoPlant()
    stand_up(plant)
    plant.fault("motor", part="FL_calf_joint", at=plant.time + 0.1)
    plant.write(HOLD)
    assert abs(plant.read().tau[2]) > 3.0
    for _ in range(60):
        plant.write(HOLD)
    assert plant.read().tau[2] == 0.0
    assert plant.model.nu == 12
    assert plant.data.ctrl[2] == 0.0


def test_a_weak_motor_gives_its_share() -> None:
    sound, weak = MujocoPlant(), MujocoPlant()
    for plant in (sound, weak):
        stand_up(plant)
    weak.fault("motor", part="RR_thigh_joint", value=0.5)
    for plant in (sound, weak):
        plant.write(HOLD)
    assert weak.read().tau[10] == pytest.approx(0.5 * sound.read().tau[10], rel=0.1)


def test_a_held_foot_stays_against_no_more_than_its_force() -> None:
    raised = STAND.copy()
    raised[1:3] += 0.3, -0.6
    moved = []
    for most in (0.0, 50.0, 200.0):
        plant = MujocoPlant()
        stand_up(plant)
        plant.fault("foot_held", part="FL_foot", value=most, at=plant.time + 0.01)
        saved, places = plant.save(), [plant.p_world_feet[0]]
        for _ in range(100):
            plant.write(JointCommand.servo(raised, np.zeros(12), 60.0, 2.0))
            places.append(plant.p_world_feet[0])
        moved.append(np.linalg.norm(places[-1] - places[0]))
        plant.restore(saved)
        for _ in range(100):
            plant.write(JointCommand.servo(raised, np.zeros(12), 60.0, 2.0))
        assert np.array_equal(plant.p_world_feet[0], places[-1])
    assert moved[0] > moved[1] > moved[2]
    assert moved[2] < 0.5 * moved[0]


@pytest.mark.parametrize("sensors", ["ideal", "imu"])
def test_the_watch_puts_right_what_a_sensor_reads_wrong(sensors: str) -> None:
    plant = MujocoPlant(sensors=sensors)
    stand_up(plant)
    for kind, part in (("encoder", "FL_calf_joint"), ("foot_force", "RR_foot"), ("gyro", "y")):
        plant.fault(kind, part=part)
    for _ in range(300):
        plant.write(HOLD)
        plant.read()
    truth, seen = plant.truth(), plant.read()
    assert seen.q[9] == pytest.approx(truth.q[9], abs=0.01)
    assert seen.foot_forces[3] == pytest.approx(truth.foot_forces[3], abs=8.0)
    assert np.abs(seen.v[3:6] - truth.v[3:6]).max() < 0.15
    named = {fault.part for fault in plant.sensor_faults}
    assert named == {"FL_calf_joint", "RR_foot", "gyro"}


def test_an_encoder_that_sticks_and_is_off_reads_one_angle() -> None:
    # The offset was added anew to what it had read before: 98 rad after two seconds.
    faults, seen = Faults(find_description()), []
    reading = SensorReading(
        0.0, np.zeros(3), np.zeros(3), np.zeros(12), np.ones(12), np.zeros(12), np.zeros(4)
    )
    for kind, value in (
        (FaultKind.ENCODER_STUCK, 0.0),
        (FaultKind.ENCODER, 0.1),
        (FaultKind.NOT_A_NUMBER, 0.0),
    ):
        faults.known += (InjectedFault(kind, "FL_calf_joint", 0.01, value),)
    for tick in range(6):
        now = replace(reading, time=0.01 * tick, q_joints=np.full(12, 0.5 * tick))
        seen.append(faults.broken(now).q_joints[2])
    np.testing.assert_allclose(seen, [0.0, np.nan, 0.1, 0.1, 0.1, 0.1])


def test_one_reading_that_is_not_a_number_is_not_seen() -> None:
    plant = MujocoPlant(sensors="imu")
    stand_up(plant)
    for part in ("FL_calf_joint", "RR_foot", "x"):
        plant.fault("not_a_number", part=part)
        for _ in range(5):
            plant.write(HOLD)
            assert np.isfinite(plant.read().q).all()
    assert plant.sensor_faults == ()


def test_a_share_of_the_states_does_not_arrive() -> None:
    plant = MujocoPlant(seed=1)
    stand_up(plant)
    plant.fault("lost_packets", value=0.2)
    times = []
    for _ in range(500):
        plant.write(HOLD)
        times.append(plant.read().time)
    assert np.mean(np.diff(times) == 0.0) == pytest.approx(0.2, abs=0.06)


@pytest.mark.parametrize("sensors", ["ideal", "imu"])
def test_a_robot_that_is_put_back_to_before_a_fault_is_sound(sensors: str) -> None:
    plant = MujocoPlant(sensors=sensors)
    stand_up(plant)
    saved, states = plant.save(), []
    for breaks in (False, True, False):
        plant.restore(saved)
        if breaks:
            plant.fault("encoder", part="FL_calf_joint")
            plant.fault("motor", part="FR_calf_joint")
        for _ in range(50):
            plant.write(HOLD)
            plant.read()
        states.append(plant.read())
        assert bool(plant.sensor_faults) is breaks
    assert np.array_equal(states[0].q, states[2].q)
    assert not np.array_equal(states[0].q, states[1].q)


def test_what_cannot_break_is_refused_with_what_can() -> None:
    plant = MujocoPlant()
    with pytest.raises(CommandError, match="unknown kind of fault 'wheel'; valid: "):
        plant.fault("wheel")
    with pytest.raises(CommandError, match="unknown part for 'motor' 'FL_foot'; valid: "):
        plant.fault("motor", part="FL_foot")
    with pytest.raises(CommandError, match="finite numbers"):
        plant.fault("gyro", value=np.inf)
    with pytest.raises(CommandError, match=r"the value of 'motor' is a share, 0 to 1, got -0.5"):
        plant.fault("motor", part="FL_hip_joint", value=-0.5)
    with pytest.raises(CommandError, match=r"'lost_packets' is a share, 0 to 1, got 1.1"):
        plant.fault("lost_packets", value=1.1)
    assert {kind.value for kind in FaultKind} >= {"motor", "encoder", "gyro", "foot_force"}
