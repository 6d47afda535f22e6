"""Builders of phases put the feet where they say, and refuse what no Go2 can do."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from motions.dynamics import Phase, PhaseProblem
from motions.dynamics import phases as phase_builders
from motions.dynamics.phases import ALL_FEET, FOOTPRINT, KNOT_PERIOD


def test_the_footprint_is_that_of_the_standing_robot(model: RobotModel) -> None:
    assert model.p_base_feet_nominal[:, :2] == pytest.approx(FOOTPRINT, abs=1e-3)


def test_a_jump_lands_at_the_place_and_heading_asked_for() -> None:
    problem = PhaseProblem(phase_builders.jump(x=0.3, y=-0.2, yaw=1.1))
    feet = np.column_stack([FOOTPRINT, np.zeros(4)]) + problem.shift
    landed = Anchor.of_feet(feet, 0.0)
    assert landed.p_world == pytest.approx([0.3, -0.2, 0.0])
    assert landed.yaw == pytest.approx(1.1)
    stand = problem.phases[-1]
    assert stand.body == pytest.approx((0.3, -0.2, 0.0, 0.0, 0.0, 1.1))


def test_flights_last_whole_knots_as_long_as_is_asked_and_hops_a_period() -> None:
    times, landed, before = [], 0.0, ALL_FEET
    assert phase_builders.hop(times=10)
    for phase in phase_builders.hop(times=4, period=0.47):
        if phase.stance and not before:
            times.append(landed)
        landed, before = landed + phase.duration, phase.stance
    assert np.diff(times) == pytest.approx([0.47] * 3)
    for phase in (
        *phase_builders.jump(height=0.11),
        *phase_builders.rear(hold=0.7),
        *phase_builders.jump(flight=0.33),
    ):
        assert phase.duration / KNOT_PERIOD == pytest.approx(round(phase.duration / KNOT_PERIOD))
    for given, taken in ((None, 0.36), (0.32, 0.32), (0.45, 0.44)):
        flight = [phase.duration for phase in phase_builders.jump(flight=given) if not phase.stance]
        assert sum(flight) == pytest.approx(taken)


def test_rearing_holds_the_front_feet_up_and_a_lift_the_others_down() -> None:
    up = [phase.duration for phase in phase_builders.rear(hold=0.6) if len(phase.stance) == 2]
    assert sum(up) == pytest.approx(0.6)
    phases = phase_builders.lift((Leg.FL, Leg.RR))
    assert {phase.stance for phase in phases} == {ALL_FEET, frozenset({Leg.FR, Leg.RL})}
    assert not PhaseProblem(phases).shift.any()


@pytest.mark.parametrize(
    "ask",
    [
        lambda: phase_builders.jump(x=2.0),
        lambda: phase_builders.jump(y=math.nan),
        lambda: phase_builders.jump(height=0.0),
        lambda: phase_builders.jump(height=2.0),
        lambda: phase_builders.jump(yaw=7.0),
        lambda: phase_builders.jump(flight=0.0),
        lambda: phase_builders.jump(flight=3.0),
        lambda: phase_builders.hop(times=0),
        lambda: phase_builders.hop(times=11),
        lambda: phase_builders.hop(period=0.1),
        lambda: phase_builders.rear(pitch=0.4),
        lambda: phase_builders.rear(hold=5.0),
        lambda: phase_builders.lift(LEGS),
        lambda: phase_builders.lift((Leg.FL,), height=-0.1),
    ],
)
def test_what_no_go2_can_do_is_refused(ask: Callable[[], tuple[Phase, ...]]) -> None:
    with pytest.raises(TimelineError, match=r"must be|lift one or two"):
        ask()


@pytest.mark.parametrize(
    ("pitch", "meant"), [(0.4, "-0.4"), (30.0, r"-deg\(30\)"), (-30.0, r"deg\(-30\)")]
)
def test_an_angle_of_the_other_sign_or_in_degrees_is_told(pitch: float, meant: str) -> None:
    with pytest.raises(TimelineError, match=rf"did you mean {meant}\?"):
        phase_builders.rear(pitch=pitch)
