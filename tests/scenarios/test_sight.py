"""What a lidar is for: stairs that a blind robot falls on, and a wall."""

import logging
import math

import numpy as np
import pytest

from benchmarks.rough import SEEING, measure_way
from benchmarks.study import TrialResult
from controller import GO2Controller
from controller.sweeps.trials import Trial
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Blocks, Gap, Stairs, Terrain
from tests.go2_wbc.planning.seen import true_heights

WALL = Blocks(0.6, count=1, start=1.2)


@pytest.mark.slow
def test_stairs_of_16_cm_are_climbed_by_sight_on_the_robots_own_sensors() -> None:
    (way,) = (way for way in SEEING if way.name == "seen-stairs-16")
    found = TrialResult()
    measure_way(Trial(0), found, way, first_seed=0)
    assert found.values["trunk"] == 0.0
    assert found.values["calf"] < 6.0
    assert found.values["speed"] < 20.0


@pytest.mark.parametrize(
    ("terrain", "what"),
    [(WALL, "a wall"), (Gap(0.6, start=1.2), "a gap"), (Stairs(0.3, 1, start=1.2), "a wall")],
    ids=lambda value: type(value).__name__,
)
def test_the_robot_stops_in_front_of_what_it_cannot_do_and_says_so(
    terrain: Terrain, what: str, caplog: pytest.LogCaptureFixture
) -> None:
    plant = MujocoPlant(terrain=terrain, lidar=True, sensors="imu")
    with GO2Controller(plant=plant) as go2, caplog.at_level(logging.WARNING):
        go2.stand()
        assert not go2.move_forward(3.0)
        assert go2.last_outcome.reason.startswith(f"walk 3.000 m ended: {what}")
        assert 0.4 < 1.2 - plant.truth().q[0] < 0.75
        go2.move(0.4)
        go2.wait(1.5)
        assert go2.terrain is not None
        assert go2.terrain.blocked.startswith(what)
        assert "blocked: " in repr(go2.terrain)
        assert [r for r in caplog.messages if r.startswith("stopped: ")]
        assert 0.4 < 1.2 - plant.truth().q[0] < 0.75
        assert plant.limb_contact_force == plant.base_contact_force == 0.0
        go2.stop()
        assert go2.turn_left(math.pi)  # it may turn, and walk away
        assert go2.move_forward(0.4)
        assert not go2.terrain.blocked


def test_users_look_at_what_was_seen() -> None:
    with GO2Controller(plant=MujocoPlant(terrain=WALL, lidar=True)) as go2:
        before = go2.terrain
        assert before is None
        go2.walk()
        go2.wait(0.5)
        seen = go2.terrain
        assert seen is not None
        points = seen.points()
        near = points[np.hypot(points[:, 0] - 0.5, points[:, 1]) < 0.3]
        assert len(near) > 200
        off = near[:, 2] - true_heights(WALL, near[:, :2])
        assert np.abs(off).mean() < 0.015
        x, y, z = near[0].tolist()
        assert seen.height(x, y) == z
        assert math.isnan(seen.height(50.0, 0.0))
        assert repr(seen).startswith("<SeenTerrain: ")
    with GO2Controller() as blind:
        blind.walk()
        assert blind.terrain is None
