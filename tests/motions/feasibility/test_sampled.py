"""What of a motion is worked out anew, if only a part of it has changed."""

import numpy as np
import pytest

from motions.feasibility.sampled import BESIDE, Change
from motions.plan.compiled_plan import PlanSamples

ROWS = 400


def change(numbers: np.ndarray, before: np.ndarray) -> tuple[int, ...] | None:
    """The rows; a foot is in the air from row 120 to 139, and rows 280 to 289 are dynamic."""
    asked = object.__new__(PlanSamples)
    stance = np.ones((len(numbers), 4), dtype=bool)
    stance[120:140, 2] = False
    object.__setattr__(asked, "stance", stance)
    object.__setattr__(asked, "times", 0.01 * np.arange(len(numbers)))
    found = Change.of(asked, numbers, before)
    return found and (found.start, found.first, found.last, found.stop, found.shift)


@pytest.fixture
def numbers() -> np.ndarray:
    rows = np.column_stack([np.sin(np.arange(ROWS)), np.zeros(ROWS)])
    rows[280:290, 1] = 1.0
    return rows


def test_it_is_what_has_changed_to_where_the_robot_stands_well_before_and_behind(
    numbers: np.ndarray,
) -> None:
    before = numbers.copy()
    before[190:195, 0] += 0.1
    first, last = 190 - BESIDE, 195 + BESIDE
    assert change(numbers, before) == (119, first, last, last + BESIDE, 0)
    before = numbers.copy()
    before[220:225, 0] += 0.1
    assert change(numbers, before) == (160, 190, 255, 291, 0)


def test_what_was_put_in_or_taken_out_shifts_the_rest(numbers: np.ndarray) -> None:
    before = np.delete(numbers, np.s_[190:210], axis=0)
    assert change(numbers, before) == (119, 160, 240, 270, 20)
    assert change(before, numbers) == (119, 160, 220, 250, -20)


def test_what_has_changed_from_its_start_or_all_over_is_worked_out_as_a_whole(
    numbers: np.ndarray,
) -> None:
    before = numbers.copy()
    before[0] += 1.0
    assert change(numbers, before) is None
    before[0], before[70], before[340] = numbers[0], 5.0, 5.0
    assert change(numbers, before) == (10, 40, 371, ROWS, 0)
    before[50] = 5.0
    assert change(numbers, before) is None
