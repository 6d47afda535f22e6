"""Phases that make no motion are refused with what is wrong."""

import math
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from motions.dynamics import Phase, PhaseProblem
from motions.dynamics.phases import ALL_FEET

STAND = Phase(0.3)
AIR = frozenset[Leg]()


def airborne(x: float, y: float, z: float) -> Phase:
    return Phase(0.3, AIR, feet={Leg.FL: (x, y, z)}, label="fly")


@pytest.mark.parametrize("duration", [0.0, -0.1, math.nan, math.inf, True, 9.0])
def test_a_phase_without_a_sensible_duration_is_refused(duration: float) -> None:
    with pytest.raises(TimelineError, match=r"duration|lasts"):
        Phase(duration)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda: airborne(0.0, 0.0, -0.1), r"FL foot -0.1 m is under the ground"),
        (lambda: airborne(0.0, math.nan, 0.0), "FL foot must be x, y, z"),
        (lambda: airborne(9.0, 0.0, 0.0), "FL foot is 9 m away"),
        (lambda: Phase(0.3, feet={Leg.RR: (0.0, 0.0, 0.1)}), r"RR cannot stand and move"),
        (
            lambda: Phase(0.3, body=(0.0, 0.0, math.inf, 0.0, 0.0, 0.0), label="land"),
            r"'land' body must be six numbers \(x, y, z, roll",
        ),
        (lambda: PhaseProblem((STAND, Phase(0.3, AIR))), "must stand on four feet"),
        (lambda: PhaseProblem(()), "at least one phase"),
        (
            lambda: PhaseProblem((STAND, airborne(0.1, 0.0, 0.05), STAND)),
            r"'fly': FL lands, but its place is 0.05 m high",
        ),
    ],
)
def test_what_makes_no_phase_or_no_motion_is_refused(
    write: Callable[[], object], message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        write()


def test_feet_stay_where_they_landed_and_phases_can_be_pickled() -> None:
    first = Phase(0.3, ALL_FEET - {Leg.FL}, feet={Leg.FL: (0.1, 0.0, 0.0)})
    second = Phase(0.3, ALL_FEET - {Leg.RR}, feet={Leg.RR: (0.0, 0.2, 0.0)})
    problem = PhaseProblem((first, STAND, second, STAND))
    wanted = np.zeros((4, 3))
    wanted[Leg.FL, 0], wanted[Leg.RR, 1] = 0.1, 0.2
    assert np.array_equal(problem.shift, wanted)
    assert problem.foot_shifts[1, Leg.RR, 1] == 0.0
    assert problem.duration == pytest.approx(1.2)
    phase = Phase(0.3, AIR, feet=dict.fromkeys(LEGS, (0.1, 0.0, 0.0)), label="fly")
    assert pickle.loads(pickle.dumps(phase)) == phase
