"""Heights over the ground: of every point of every link, by another way to find them."""

from dataclasses import replace

import coal
import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline, compile_timeline, deg
from motions.batch_kinematics import configurations
from motions.feasibility.bodies import FAR, LinkHulls, SelfCollision
from motions.plan.trajectory import Trajectory, trajectory_of

EXACT = 1e-9  # m; rounding of sums
GJK = 1e-5  # m; where Coal stops


@pytest.fixture(scope="module")
def bodies(model: RobotModel) -> SelfCollision:
    return SelfCollision(model)


def anywhere(model: RobotModel, count: int, seed: int) -> Trajectory:
    """The robot in any attitude, with joints anywhere, near the ground."""
    rng = np.random.default_rng(seed)
    plan = compile_timeline(Timeline().body(z=-0.01, over=0.01 * (count - 1)), model)
    path = trajectory_of(plan, model)
    count = len(path.times)
    rpy = rng.uniform(-1.0, 1.0, (count, 3))
    joints = rng.uniform(model.q_lower, model.q_upper, (count, 12))
    poses = np.hstack([rng.uniform(0.0, 0.25, (count, 3)), rpy])
    return replace(path, q=configurations(poses, joints), rpy=rpy)


def test_every_link_is_as_high_as_its_distance_from_the_ground(
    model: RobotModel, bodies: SelfCollision
) -> None:
    motion, hulls = anywhere(model, 40, seed=1), LinkHulls(model, bodies.geometry)
    found = hulls.heights(motion)
    ground = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    data, results = model.pin_model.createData(), bodies.geometry.createData()
    request = coal.DistanceRequest()
    for row, q in enumerate(motion.q):
        pin.updateGeometryPlacements(model.pin_model, data, bodies.geometry, results, q)
        lowest: dict[int, float] = {}
        for item, T in zip(bodies.geometry.geometryObjects, results.oMg, strict=True):
            if "foot" in item.name:
                continue
            place = coal.Transform3s(T.rotation, T.translation)
            result = coal.DistanceResult()
            height = coal.distance(
                item.geometry, place, ground, coal.Transform3s(), request, result
            )
            lowest[item.parentJoint] = min(lowest.get(item.parentJoint, np.inf), height)
        for column, link in enumerate(hulls.links):
            expected = lowest[link.joint]
            if found[row, column] < FAR:
                assert found[row, column] == pytest.approx(expected, abs=GJK)
            else:  # that of the box, which is no higher
                assert FAR <= found[row, column] <= expected + EXACT
    assert (found < 0.0).any()
    assert ((found > 0.0) & (found < FAR)).any()


def test_a_trunk_that_puts_its_head_on_the_ground_is_refused() -> None:
    # Of a trunk drawn as its underside's corners, 63 mm were left; its head lay on the ground.
    line = Timeline().body(pitch=deg(28), z=-0.10, over=1.0).hold(0.5).home(over=1.0)
    failures = FeasibilityChecker().check(line).failures
    (finding,) = [f for f in failures if (f.check, f.subject) == ("clearance", "trunk")]
    assert finding.value < 0.005
