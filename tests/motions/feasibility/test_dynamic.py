"""Contact forces of a motion: what they must be, said without the QP that finds them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline, compile_timeline
from motions.feasibility.dynamic import SPREAD, Forces, forces_of, torque
from motions.feasibility.limits import FeasibilityLimits
from motions.placement import configurations
from motions.trajectory import Trajectory, trajectory_of
from tests.engine_helpers import state_of
from tests.motions.feasibility.shared_loads import forces_one_by_one

EXACT = 1e-5  # N; what the QP's solver leaves, and the motion itself


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def resting(model: RobotModel) -> Trajectory:
    line = Timeline().body(z=-0.001, over=0.1).home(over=0.1)
    return trajectory_of(compile_timeline(line, model), model)


@pytest.mark.parametrize("share", [[1.0, 1.0, 1.0, 1.0], [1.0, 0.5, 0.7, 1.0], [0.4, 1, 1, 1]])
def test_what_the_wrench_leaves_open_is_shared_as_the_loads_are(
    model: RobotModel, resting: Trajectory, share: list[float]
) -> None:
    # Forces that cancel each other in the trunk's wrench cost nothing there, so in those
    # directions the forces are those of the even share exactly (KKT conditions of the QP).
    asked = np.tile(share, (len(resting.times), 1))
    forces = forces_of(replace(resting, load_share=asked), model).contact[0]
    J = model.snapshot(state_of(resting.q[0], resting.v[0])).J_contacts
    internal = null_space(J[:, :, :6].reshape(12, 6).T)
    even = np.zeros((4, 3))
    even[:, 2] = model.mass * model.gravity * np.array(share) / np.sum(share)
    assert internal.T @ forces.ravel() == pytest.approx(internal.T @ even.ravel(), abs=EXACT)


def test_the_torque_at_speed_is_what_the_motors_of_the_plant_give(
    model: RobotModel, resting: Trajectory
) -> None:
    rng, count = np.random.default_rng(4), len(resting.times)
    v = np.hstack([np.zeros((count, 6)), rng.uniform(-1.2, 1.2, (count, 12)) * model.speed_limits])
    tau = rng.uniform(-1.2, 1.2, (count, 12)) * model.torque_limits
    zeros = (np.zeros((count, size)) for size in (2, 2, 6))
    forces = Forces(np.zeros((count, 4, 3)), tau, *zeros)
    _, at_speed = torque(replace(resting, v=v), forces, model, FeasibilityLimits())
    lower, upper = MujocoPlant().motor.limits(v[:, 6:])
    drives = tau * v[:, 6:] > 0.0
    drives[:SPREAD] = False  # what a plan begins with is not asked for
    assert (np.isfinite(at_speed.margins) == drives).all()
    is_refused = np.maximum(tau - upper, lower - tau) > 0.0
    assert ((at_speed.margins < 0.0) == (is_refused & drives)).all()
    assert np.array_equal(at_speed.limits, np.where(tau < 0.0, -lower, upper))


def test_a_fast_rise_is_judged_by_the_line_of_its_calves() -> None:
    line = Timeline().body(z=-0.1, over=0.6).body(z=0.05, over=0.12).home(over=0.6)
    limits = {}
    for motor in ("torque-speed", "ideal"):
        report = FeasibilityChecker(RobotModel(motor=motor)).check(line)
        found = [
            f for f in report.failures if (f.check, f.subject) == ("torque at speed", "FL_calf")
        ]
        limits[motor] = min(finding.limit for finding in found)
    assert limits["ideal"] == pytest.approx(45.43)
    assert limits["torque-speed"] < 35.0


def random_trajectory(model: RobotModel, count: int, *, pace: float, seed: int) -> Trajectory:
    """States, accelerations and loads at random, as far from any motion as ``pace`` says."""
    rng = np.random.default_rng(seed)
    rpy = rng.normal(scale=0.3 * pace, size=(count, 3))
    joints = np.tile([0.0, 0.8, -1.6], 4) + rng.normal(scale=0.4 * pace, size=(count, 12))
    poses = np.hstack([rng.normal(scale=0.05, size=(count, 3)) + [0.0, 0.0, 0.27], rpy])
    load_share = rng.choice([0.0, 0.3, 1.0], p=[0.2, 0.2, 0.6], size=(count, 4))
    return Trajectory(
        times=0.01 * np.arange(count),
        q=configurations(poses, joints),
        v=rng.normal(scale=pace, size=(count, 18)),
        a=rng.normal(scale=10.0 * pace, size=(count, 18)),
        rpy=rpy,
        p_com=poses[:, :3],
        stance=load_share > 0.0,
        load_share=load_share,
        p_feet=np.zeros((count, 4, 3)),
        miss=np.zeros((count, 4)),
        is_dynamic=np.zeros(count, dtype=bool),
    )


@pytest.mark.parametrize(("pace", "radius"), [(0.1, 0.022), (1.0, 0.022), (1.0, 0.0), (3.0, 0.022)])
def test_the_forces_are_those_of_one_qp_for_each_instant(pace: float, radius: float) -> None:
    model = RobotModel(foot_radius=radius)
    motion = random_trajectory(model, 250, pace=pace, seed=round(10 * pace))
    found, expected = forces_of(motion, model), forces_one_by_one(motion, model)
    for name in ("contact", "tau", "missing", "zmp"):
        difference = np.abs(getattr(found, name) - getattr(expected, name))
        assert difference.max() < EXACT * max(1.0, pace), name
    if pace > 0.5:
        assert (np.abs(expected.missing) > 1.0).any()


def test_a_trunk_that_the_ground_cannot_hold_stays_level_and_lags() -> None:
    # In MuJoCo it is 18 mm off and turned by 2.5 deg.
    line = Timeline().body(y=0.045, over=0.26).body(y=-0.045, over=0.26).home(over=0.26)
    checked = FeasibilityChecker().evaluate(line)
    force, moment = checked.forces.missing.max(axis=0)
    assert force > 20.0
    assert moment < 0.05


def nods(half: float, pitch: float) -> Timeline:
    """Up and down and up again, ``half`` [s] each way."""
    line = Timeline(name="nods").body(pitch=pitch, over=half / 2)
    for sign in (-1, 1) * 3:
        line = line.body(pitch=sign * pitch, over=half)
    return line.home(over=0.3)


def test_what_the_feet_cannot_give_for_a_moment_is_refused_if_it_is_much(
    model: RobotModel,
) -> None:
    # The trunk lags by a few millimetres only, but the feet slide: such a nod fell.
    quick = nods(0.1, 0.1)
    (failure,) = FeasibilityChecker(model).check(quick).failures
    assert (failure.check, failure.subject) == ("contact wrench", "force")
    assert failure.value > FeasibilityLimits().jolt
    assert FeasibilityChecker(model, FeasibilityLimits(jolt=1e3)).check(quick).ok
    assert FeasibilityChecker(model).check(nods(0.12, 0.08)).ok


def test_a_force_that_lacks_as_a_plan_begins_at_speed_is_not_asked_for(model: RobotModel) -> None:
    # In MuJoCo the first slides by 2.7 mm, though it lacks four times as much.
    checker, start = FeasibilityChecker(model), Timeline()
    jumps = [
        line.body(x=0.02, over=0.4, ease="out") for line in (start, start.body(x=-0.02, over=0.5))
    ]
    begins, later = (checker.check(line.home(over=0.6)) for line in jumps)
    assert begins.margins["contact wrench"].value > later.margins["contact wrench"].value > 30.0
    assert begins.ok
    assert "contact wrench" in {finding.check for finding in later.failures}
