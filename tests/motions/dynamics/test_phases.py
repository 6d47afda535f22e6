"""Phases that make no motion are refused with what is wrong."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from motions.dynamics import Phase, PhaseProblem
from motions.dynamics.phases import ALL_FEET

STAND = Phase(0.3)
AIR = frozenset[Leg]()


@pytest.mark.parametrize("duration", [0.0, -0.1, math.nan, math.inf, True, 9.0])
def test_a_phase_without_a_sensible_duration_is_refused(duration: float) -> None:
    with pytest.raises(TimelineError, match=r"duration|lasts"):
        Phase(duration)


def test_a_foot_under_the_ground_is_refused() -> None:
    with pytest.raises(TimelineError, match=r"FL foot -0.1 m is under the ground"):
        Phase(0.3, AIR, feet={Leg.FL: (0.0, 0.0, -0.1)})


def test_a_foot_cannot_stand_and_move() -> None:
    with pytest.raises(TimelineError, match=r"RR cannot stand and move"):
        Phase(0.3, feet={Leg.RR: (0.0, 0.0, 0.1)})


@pytest.mark.parametrize("place", [(0.0, math.nan, 0.0), (9.0, 0.0, 0.0)])
def test_a_foot_at_no_place_is_refused(place: tuple[float, float, float]) -> None:
    with pytest.raises(TimelineError, match="foot"):
        Phase(0.3, AIR, feet={Leg.FL: place})


def test_a_body_is_six_numbers() -> None:
    with pytest.raises(TimelineError, match=r"'land' body must be six numbers \(x, y, z, roll"):
        Phase(0.3, body=(0.0, 0.0, math.inf, 0.0, 0.0, 0.0), label="land")


def test_a_motion_ends_on_four_feet() -> None:
    with pytest.raises(TimelineError, match="must stand on four feet"):
        PhaseProblem((STAND, Phase(0.3, AIR)))
    with pytest.raises(TimelineError, match="at least one phase"):
        PhaseProblem(())


def test_a_foot_lands_on_the_ground() -> None:
    flight = Phase(0.3, AIR, feet={Leg.FL: (0.1, 0.0, 0.05)}, label="fly")
    with pytest.raises(TimelineError, match=r"'fly': FL lands, but its place is 0.05 m high"):
        PhaseProblem((STAND, flight, STAND))


def test_feet_stay_where_they_landed() -> None:
    first = Phase(0.3, ALL_FEET - {Leg.FL}, feet={Leg.FL: (0.1, 0.0, 0.0)})
    second = Phase(0.3, ALL_FEET - {Leg.RR}, feet={Leg.RR: (0.0, 0.2, 0.0)})
    problem = PhaseProblem((first, STAND, second, STAND))
    wanted = np.zeros((4, 3))
    wanted[Leg.FL, 0], wanted[Leg.RR, 1] = 0.1, 0.2
    assert np.array_equal(problem.shift, wanted)
    assert problem.foot_shifts[1, Leg.RR, 1] == 0.0
    assert problem.duration == pytest.approx(1.2)


def test_phases_can_be_pickled() -> None:
    phase = Phase(0.3, AIR, feet=dict.fromkeys(LEGS, (0.1, 0.0, 0.0)), label="fly")
    assert pickle.loads(pickle.dumps(phase)) == phase
