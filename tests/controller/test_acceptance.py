"""A motion is done if it was near its plan, ended there, and held feet up on the average."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from controller.acceptance import (
    PAW_TOLERANCE,
    TOUCH_FORCE,
    TOUCH_TIME,
    Acceptance,
    arrival,
    off_plan,
)
from controller.behaviours.plans import PlayPlan
from controller.modes import Aborted, are_within, told
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import HeldFoot, MotionPlan, Posture
from go2_wbc.reference import Reference
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landings
from go2_wbc.tracking.plan_tracking import Deviation
from tests.controller.plants import StillPlant
from tests.engine_helpers import standing_q, state_of

FOOT_RADIUS = find_profile().foot_radius

MODEL = RobotModel()
FIRST = HeldFoot("first", Leg.FR, 1.0, 2.0, 0.3)
SECOND = HeldFoot("second", Leg.FL, 2.5, 3.0, 0.2)
CENTIMETRE = 0.01


@dataclass
class Holding(MotionPlan):
    held: tuple[HeldFoot, ...]
    name: str = "holding"
    entry: Posture = Posture.STAND
    exit: Posture = Posture.STAND
    duration: float = 4.0

    def at(self, t: float) -> Reference:
        raise AssertionError(f"only its held feet are asked for, not {t:.2f} s of it")

    @property
    def held_feet(self) -> tuple[HeldFoot, ...]:
        return self.held


def raised(leg: Leg, height: float) -> Snapshot:
    """The foot of ``leg`` at this height over the ground below the others."""
    snapshot = MODEL.snapshot(state_of(standing_q()))
    feet = snapshot.p_world_feet.copy()
    feet[leg, 2] = feet[Leg.RL, 2] - FOOT_RADIUS + height
    return snapshot.replaced(p_world_feet=feet)


def test_a_foot_counts_on_the_average_of_its_hold_and_not_where_none_is_held() -> None:
    held = Acceptance(Holding((FIRST,)), StillPlant())
    for t, height in ((0.99, 9.0), (1.0, 0.3 - PAW_TOLERANCE), (2.0, 0.305), (2.01, 0.0)):
        held.note(raised(Leg.FR, height), t)
    measured = held.with_held_feet({"yaw [deg]": 1.0})
    assert measured["yaw [deg]"] == 1.0
    assert measured["planned paw height [m]"] == 0.3
    assert measured["least paw height [m]"] == pytest.approx(0.3 - PAW_TOLERANCE)
    assert measured["mean paw height [m]"] == pytest.approx(0.3025 - PAW_TOLERANCE / 2)
    held = Acceptance(Holding(()), StillPlant())
    held.note(raised(Leg.FR, 0.3), 1.5)
    assert held.with_held_feet({"yaw [deg]": 1.0}) == {"yaw [deg]": 1.0}


def test_a_foot_that_was_too_low_is_told_with_what_was_measured() -> None:
    held = Acceptance(Holding((FIRST, SECOND)), StillPlant())
    held.note(raised(Leg.FR, 0.3), 1.5)
    held.note(raised(Leg.FL, 0.2 - PAW_TOLERANCE - CENTIMETRE), 2.7)
    with pytest.raises(
        Aborted, match=r"its height: mean paw height in second \[m\] 0.16, at least 0.17$"
    ) as told:
        held.with_held_feet({})
    assert told.value.measured["mean paw height in first [m]"] == pytest.approx(0.3)
    assert told.value.measured["mean paw height in second [m]"] == pytest.approx(0.16)


@pytest.mark.parametrize("lies", ["", "entry", "exit"])
@pytest.mark.parametrize("force", [None, TOUCH_FORCE, 1.01 * TOUCH_FORCE])
@pytest.mark.parametrize("ticks", [5, 6])
def test_a_motion_may_touch_the_ground_for_a_moment_or_where_it_lies(
    lies: str, force: float | None, ticks: int
) -> None:
    """Of a fifth of the time each."""
    plant: Any = SimpleNamespace(body_contact_force=force, control_period=TOUCH_TIME / 5.0)
    plan = replace(Holding(()), **dict.fromkeys([lies] if lies else [], Posture.LIE))
    watched, snapshot = Acceptance(plan, plant), raised(Leg.FR, 0.0)
    for _ in range(ticks):
        watched.note(snapshot, 1.0)
    played = Mock(spec=PlayPlan, deviation=Deviation(0.0, 0.0, 0.0))
    touches = (force or 0.0) > TOUCH_FORCE and ticks > 5 and not lies
    with pytest.raises(Aborted, match="touched the ground") if touches else nullcontext():
        assert watched.judged(played, snapshot, {"at rest": 1.0})["at rest"] == 1.0


@pytest.mark.parametrize(
    ("deviation", "standing", "solved"),
    [
        (Deviation(place=0.02, attitude=0.05, joints=None), True, True),
        (Deviation(place=0.04, attitude=0.12, joints=0.0), False, True),
        (Deviation(place=0.06, attitude=0.0, joints=0.0), False, False),
        (Deviation(place=0.0, attitude=0.15, joints=0.0), False, False),
        (Deviation(place=0.0, attitude=0.0, joints=0.3), False, False),
    ],
)
def test_a_solved_motion_may_be_as_far_off_as_its_plan_may_be_from_what_was_asked(
    deviation: Deviation, *, standing: bool, solved: bool
) -> None:
    found = off_plan(deviation)
    assert ("mean joints off plan [deg]" in found) is (deviation.joints is not None)
    assert are_within(found) is standing
    assert are_within(off_plan(deviation, is_dynamic=True)) is solved


@pytest.mark.parametrize(
    ("place", "heading", "missed", "arrived"),
    [(0.04, 0.06, 0, True), (0.06, 0.0, 0, False), (0.0, 0.08, 0, False), (0.0, 0.0, 1, False)],
)
def test_a_motion_that_moves_on_has_arrived_near_its_end_with_every_foot_landed(
    place: float, heading: float, missed: int, *, arrived: bool
) -> None:
    for error in (None, 0.01):
        end = arrival(place, heading, Landings(missed=missed, error=error))
        assert are_within(end) is arrived
        assert ("worst landing error [m]" in end) is (error is not None)
        assert (told(end) == "") is arrived
