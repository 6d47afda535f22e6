"""Self-collision along a motion: what is left out cannot have been the nearest pair."""

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline, load_motion
from motions.feasibility import bodies as geometry
from motions.feasibility.bodies import SLACK, STRIDE, SelfCollision, hulls_of, self_distance
from motions.plan.trajectory import trajectory_of
from tests.engine_helpers import standing_q
from tests.motions.feasibility.cases import case_of

TOLERANCE = 2e-6  # m; twice what GJK and EPA leave: where they stop depends on where they start


@pytest.fixture(scope="module")
def bodies(model: RobotModel) -> SelfCollision:
    return SelfCollision(model)


def test_a_pair_is_named_by_its_two_links(bodies: SelfCollision) -> None:
    links = set(bodies._model.names) | {f.name for f in bodies._model.frames}
    for pair in range(len(bodies.names)):
        first, second = bodies.pair_name(pair).split("-")
        assert {first, second} <= links
        for link, name in zip((first, second), bodies.names[pair], strict=True):
            assert name.removeprefix(f"{link}_").isdigit()


def random_configurations(model: RobotModel, count: int, seed: int) -> np.ndarray:
    """Joint angles anywhere within their limits: links far apart, and deep in each other."""
    rng = np.random.default_rng(seed)
    q = np.tile(standing_q(), (count, 1))
    q[:, 7:] = rng.uniform(model.q_lower, model.q_upper, size=(count, 12))
    return q


def all_distances(bodies: SelfCollision, q: np.ndarray) -> np.ndarray:
    """Distance [m] of every pair, by looking at every pair."""
    parts = (bodies._model, bodies._data, bodies.geometry, bodies._results)
    pin.updateGeometryPlacements(*parts, q)
    pin.computeDistances(bodies.geometry, bodies._results)
    return np.array([result.min_distance for result in bodies._results.distanceResults])


@pytest.mark.parametrize("size", [3.0, 0.3, 0.03])
def test_no_distance_falls_below_its_bound(
    model: RobotModel, bodies: SelfCollision, size: float
) -> None:
    rng = np.random.default_rng(1)
    tightest = np.inf
    for q in random_configurations(model, 150, seed=2):
        moved = q.copy()
        moved[7:] += rng.uniform(-size, size, 12) * (rng.random(12) < 0.5)
        before, after = all_distances(bodies, q), all_distances(bodies, moved)
        bounds = before - (bodies.levers * np.abs(moved[7:] - q[7:])).sum(axis=1)
        assert (after >= bounds - SLACK).all()
        moves = bounds < before - 1e-3
        left = (after - bounds)[moves] / (before - bounds)[moves]
        tightest = min(tightest, float(left.min(initial=np.inf)))
    assert tightest < 0.6  # the bound is not idle: some pair comes as near as half of it allows


def test_the_nearest_pair_is_that_of_looking_at_all(
    model: RobotModel, bodies: SelfCollision
) -> None:
    far = random_configurations(model, 40, seed=3)
    walk = np.tile(standing_q(), (200, 1))
    walk[:, 7:] += np.cumsum(np.random.default_rng(4).normal(scale=0.03, size=(200, 12)), axis=0)
    depths = []
    for q in (far, walk):
        for (distance, pair), row in zip(bodies.nearest_along(q), q, strict=True):
            distances = all_distances(bodies, row)
            assert distance == pytest.approx(distances.min(), abs=TOLERANCE)
            assert distances[pair] <= distances.min() + 2.0 * TOLERANCE
            depths.append(distance)
    assert min(depths) < -0.01 < 0.01 < max(depths)


def test_few_pairs_are_looked_at_along_a_motion(
    model: RobotModel, bodies: SelfCollision, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked: Counter[str] = Counter()
    compute = pin.computeDistance

    def counted(*arguments: object) -> object:
        looked["pairs"] += 1
        return compute(*arguments)

    monkeypatch.setattr(geometry.pin, "computeDistance", counted)
    for name in ("dance", "high_five"):
        q = trajectory_of(compile_timeline(load_motion(name), model), model).q[::STRIDE]
        looked.clear()
        bodies.nearest_along(q)
        assert looked["pairs"] < 10 * len(q) + len(bodies.names)  # of 145


def test_bodies_are_loaded_once_and_again_if_the_file_has_changed(tmp_path: Path) -> None:
    installed = find_description()
    assert geometry.geometry_of(installed) is geometry.geometry_of(find_description())
    urdf = tmp_path / "go2.urdf"
    urdf.write_bytes(installed.urdf_path.read_bytes())
    own = find_description(urdf)
    first = geometry.geometry_of(own)
    assert first is not geometry.geometry_of(installed)
    assert geometry.geometry_of(own) is first
    hulls = hulls_of(own)
    os.utime(urdf, ns=(0, 0))
    assert geometry.geometry_of(own) is not first
    assert hulls_of(own) is not hulls
    assert hulls_of(own) is hulls_of(own)


def test_a_joint_at_its_stop_brings_no_links_nearer(
    model: RobotModel, bodies: SelfCollision
) -> None:
    asked = trajectory_of(compile_timeline(Timeline().body(z=-0.01, over=0.1), model), model)
    asked.q[:, 7:] = standing_q()[7:]
    asked.q[:, 9] = -3.0  # FL's calf, beyond its stop
    stopped = asked.q[0].copy()
    stopped[9] = model.q_lower[2]
    real, beyond = (bodies.nearest(q)[0] for q in (stopped, asked.q[0]))
    least = self_distance(case_of(asked, model), bodies).values.min()
    assert beyond < real - 0.005
    assert least == pytest.approx(real, abs=TOLERANCE)
