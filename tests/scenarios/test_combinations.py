"""Commands that act late, on ground that is slippery, with a load: each alone holds, and all do."""

import pytest

from benchmarks import combined
from benchmarks.rough import LATEST, WAYS, UnreliablePlant, measure_way
from benchmarks.study import TrialResult
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.plant import MujocoPlant


@pytest.mark.slow
@pytest.mark.parametrize("sensors", ["ideal", "imu"])
@pytest.mark.parametrize(
    ("friction", "payload", "speed"), [(0.2, 0.0, 1.0), (0.3, 4.0, 0.5), (0.2, 4.0, 1.0)]
)
def test_a_robot_whose_commands_are_late_walks_on_slippery_ground_with_a_load(
    friction: float, payload: float, speed: float, sensors: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It fell within its first second, 20 of 20 times."""
    settings = {"LOADS": (payload,), "WALKS": (speed,), "WALK_TIME": 4.0, "FIRST_SEED": 0}
    for name, value in settings.items():
        monkeypatch.setattr(combined, name, value)
    found = TrialResult()
    combined.measure_combined(Trial(0, sensors=sensors), found, 0.01, friction)
    assert found.notes == {}


def test_a_robot_whose_commands_come_late_by_turns_is_sound_and_walks_on_level_ground() -> None:
    """Its legs struck each other, it took the floor for stairs and sound parts for broken ones."""
    settings = {"sensors": "imu", "seed": 9402, "friction": 0.7}
    with TrialRobot(UnreliablePlant(settings, latest=LATEST)) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        robot.truth.clear()
        for ahead, left in ((2.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.0, 1.0)):
            robot.go2.move(ahead, linear_y=left)
            robot.wait(3.0)
            assert not robot.go2._pilot._walker.walking._planner._state.ground.rough_way
        assert not robot.truth.recording().touches_itself.any()
        assert robot.go2.health.is_sound


@pytest.mark.slow
def test_a_robot_that_walks_fast_off_an_edge_on_slippery_ground_mostly_comes_down() -> None:
    """3 of 20 did, when it braked by less than 0.4 m/s^2 there; now 15 of 20."""
    (way,) = (way for way in WAYS if way.name == "fast-stairs-down")
    fallen = 0
    for seed in range(4):
        try:
            measure_way(Trial(seed, sensors="imu"), TrialResult(), way, first_seed=131000)
        except TrialFailed:
            fallen += 1
    assert fallen <= 2


def test_what_a_walk_has_shown_of_the_ground_is_known_to_the_next() -> None:
    """After 2 s on which no foot slides it believes 0.2 more."""
    with TrialRobot(MujocoPlant(friction=0.2)) as robot:
        known = []
        for _ in range(2):
            robot.require(robot.go2.walk())
            robot.go2.move(0.5)
            robot.wait(0.1)
            known.append(robot.go2._pilot._walker.walking.friction)
            robot.wait(1.9)
            robot.go2.stop()
            robot.require(robot.go2.stand())
        assert known[1] < known[0] + 0.1
