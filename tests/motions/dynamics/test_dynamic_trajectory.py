"""A plan survives a file; what is no plan is refused."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import MotionError
from motions.dynamics import DynamicTrajectory, Miss

MISSES = (Miss("trunk", "land", 0.04, 0.012, 0.1), Miss("FL_foot", "land", 0.04, 0.02, 0.0))
PLAN = DynamicTrajectory(
    times=np.array([0.0, 0.02, 0.04]),
    q=np.ones((3, 19)),
    v=np.zeros((3, 18)),
    tau=np.full((2, 12), 3.0),
    forces=np.zeros((2, 4, 3)),
    stance=np.array([[True] * 4, [False] * 4]),
    gains=np.zeros((2, 12, 36)),
    p_feet=np.zeros((3, 4, 3)),
    iterations=7,
    cost=0.25,
    misses=MISSES,
)


def test_a_plan_comes_back_from_its_bytes() -> None:
    copy = DynamicTrajectory.from_bytes(PLAN.to_bytes())
    for name in ("times", "q", "v", "tau", "forces", "stance", "gains", "p_feet"):
        assert np.array_equal(getattr(copy, name), getattr(PLAN, name))
    assert (copy.iterations, copy.cost, copy.misses) == (7, 0.25, MISSES)
    small = DynamicTrajectory.from_bytes(PLAN.to_bytes(is_small=True))
    assert small.gains.dtype == np.float64, "they are kept in 16 bits, and reckoned with in 64"


def test_a_damaged_file_is_refused() -> None:
    content = PLAN.to_bytes()
    for bad in (b"", b"no plan", content[:-200], content[:200], b"\x00" + content):
        with pytest.raises(MotionError, match="no dynamic trajectory"):
            DynamicTrajectory.from_bytes(bad)


def test_numbers_that_are_none_are_refused() -> None:
    content = replace(PLAN, tau=np.full((2, 12), np.nan)).to_bytes()
    with pytest.raises(MotionError, match=r"tau must be finite and \(2, 12\)"):
        DynamicTrajectory.from_bytes(content)


def test_the_deviation_names_the_worst_place_and_angle() -> None:
    assert PLAN.position_deviation == 0.02
    assert PLAN.angle_deviation == 0.1
    assert "FL_foot at 0.04 s (land): 20 mm" in PLAN.deviation
    assert "trunk at 0.04 s (land): 12 mm, 5.7 deg" in PLAN.deviation
