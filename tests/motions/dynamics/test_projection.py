"""What was written without regard to physics becomes the nearest motion that obeys it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import PlanNotFound, TimelineError
from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline, deg
from motions.dynamics import DynamicTrajectory, Tolerance, audit
from motions.dynamics.solver import PlanTarget, _knots_of_written, _lag_of, nearest
from motions.plan.trajectory import trajectory_of
from tests.engine_helpers import standing_q

WIDE = Tolerance(0.1, math.radians(15.0))
SWAY = Timeline().body(y=0.06, over=0.14).hold(0.1).body(y=-0.06, over=0.14).home(over=0.3)


def written(line: Timeline, model: RobotModel) -> PlanTarget:
    plan = compile_timeline(line, model)
    path = trajectory_of(plan, model)
    stance = np.array([plan.at(float(t)).stance for t in path.times])
    return PlanTarget(path.times, path.q, stance)


def test_between_two_instants_a_motion_goes_straight() -> None:
    q = np.array([standing_q(0.3), standing_q(0.2)])
    line = PlanTarget(np.array([0.0, 1.0]), q, np.ones((2, 4), dtype=bool))
    np.testing.assert_allclose(line.at(np.array([0.25, 2.0])), [standing_q(0.275), q[1]])


def two_feet(model: RobotModel) -> PlanTarget:
    """Standing still, but for two diagonal feet that are said to be in the air for 0.3 s."""
    still = written(Timeline().body(z=-0.001, over=0.8).home(over=0.1), model)
    air = (still.times > 0.3) & (still.times < 0.6)
    stance = still.stance.copy()
    stance[air, Leg.FL] = stance[air, Leg.RR] = False
    return replace(still, stance=stance)


@pytest.fixture(scope="module")
def sway(plans: dict[str, DynamicTrajectory], model: RobotModel) -> DynamicTrajectory:
    return nearest(written(SWAY, model), model, tolerance=WIDE)


def test_a_sway_too_fast_for_friction_is_bent_by_what_a_look_at_its_path_tells(
    sway: DynamicTrajectory, model: RobotModel
) -> None:
    asked = written(SWAY, model)
    needed = np.gradient(np.gradient(asked.q[:, 1], asked.times), asked.times)
    assert np.abs(needed).max() > model.gravity  # four times what a cone of 0.5 and 0.5 g allow
    assert all(reading.is_kept for reading in audit(sway, model))
    wanted = np.array([np.interp(sway.times, asked.times, column) for column in asked.q.T]).T
    off = np.linalg.norm(sway.q[:, :3] - wanted[:, :3], axis=1)
    assert sway.position_deviation == pytest.approx(off.max(), abs=1e-3)
    assert 0.01 < off.max() < 0.06
    assert abs(sway.lag) < 0.05
    assert sway.duration == pytest.approx(asked.times[-1])


def test_what_can_be_done_is_done_as_written_and_two_diagonal_feet_are_lifted(
    plans: dict[str, DynamicTrajectory], model: RobotModel
) -> None:
    slow = Timeline().body(y=0.03, roll=deg(5), over=0.5).home(over=0.5)
    plan = nearest(written(slow, model), model)
    assert plan.position_deviation < 0.003
    assert plan.angle_deviation < math.radians(0.5)
    assert plan.lag == 0.0
    plan = nearest(two_feet(model), model)
    assert all(reading.is_kept for reading in audit(plan, model))
    assert plan.position_deviation < 0.02
    assert (~plan.stance[:, [Leg.FL, Leg.RR]]).any(axis=0).all()


def test_a_lag_is_told_if_it_explains_what_is_off_and_too_far_is_refused(
    plans: dict[str, DynamicTrajectory], model: RobotModel
) -> None:
    line = Timeline().hold(0.3).body(y=0.03, over=0.4).home(over=0.4).hold(0.3)
    asked = written(line, model)
    knots, plan = _knots_of_written(asked, model), nearest(asked, model)
    late = np.column_stack([np.interp(knots.times - 0.04, knots.times, c) for c in knots.q.T])
    assert _lag_of(knots, replace(plan, q=late)) == pytest.approx(0.04)
    rng = np.random.default_rng(3)
    swaying = knots.q + 0.01 * rng.standard_normal(knots.q.shape)
    assert _lag_of(knots, replace(plan, q=swaying)) == 0.0
    with pytest.raises(PlanNotFound, match="within 1 mm") as caught:
        nearest(written(SWAY, model), model, tolerance=Tolerance(0.001, 0.1))
    assert any(reason.startswith("trunk at") for reason in caught.value.reasons)


def test_what_is_no_motion_is_refused(model: RobotModel) -> None:
    good = two_feet(model)
    flies_off, flies_on = good.stance.copy(), good.stance.copy()
    flies_off[0], flies_on[-1] = False, False
    for bad in (
        {"times": good.times[::-1].copy()},
        {"times": 20.0 * good.times},
        {"q": np.full_like(good.q, np.nan)},
        {"stance": flies_off},
        {"stance": flies_on},
    ):
        with pytest.raises(TimelineError):
            replace(good, **bad)
