"""A part breaks: it is named within half a second, and the robot goes on, or goes limp in time."""

import pytest

from benchmarks import faults
from benchmarks.faults import ENCODERS, FEET, HELD_FOOT, IMU, MOTORS, Break
from benchmarks.study import TrialResult
from controller import GO2Controller
from controller.modes import Mode
from controller.sweeps.trials import Trial
from go2_wbc.plant import MujocoPlant

GRAVE = ("calf-dead", "stuck")
"""What a trot is not to go on with: the robot goes limp before it falls."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "what", [*MOTORS[2:], *ENCODERS, *FEET[:2], *IMU, HELD_FOOT], ids=lambda what: what.name
)
def test_what_breaks_of_a_trotting_robot_is_named_and_it_goes_on_or_limp(
    what: Break, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(faults, "STATES", ("trotting",))
    monkeypatch.setattr(faults, "FIRST_SEED", 0)
    found = TrialResult()
    faults.measure_break(Trial(0, sensors="imu"), found, what)
    goes_on = float(what.name not in GRAVE)
    expected = {"named": 1.0, "falls": 0.0, "goes-on": goes_on, "others": 0.0}
    assert found.values == {f"trotting-{name}": value for name, value in expected.items()}, found
    health, _, reason = found.notes["trotting"].partition(": ")[2].partition("; ")
    assert health in reason or what.name == "half"


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_gyro_that_jumps_as_feet_land_is_named_before_the_robot_leans(axis: str) -> None:
    # 13 of 48 were not: what jumps within 10 ms of a landing was taken for its jerk.
    plant = MujocoPlant(sensors="imu", seed=45)
    with GO2Controller(plant=plant) as go2:
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5)
        swung = plant.truth().feet_in_contact
        while not (plant.truth().feet_in_contact & ~swung).any():
            swung = plant.truth().feet_in_contact
            go2.wait(plant.control_period)
        broken = plant.time + 0.014  # while the feet take the load
        plant.fault("gyro", part=axis, at=broken)
        go2.wait(1.0)
        (fault,) = go2.health.faults
        assert fault.part == "gyro"
        assert fault.since < broken + 0.1
        assert plant.truth().tilt < 0.1
        assert go2.mode is Mode.WALKING
