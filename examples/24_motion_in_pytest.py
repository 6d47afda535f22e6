"""Test motions with pytest: the project brings a plugin. This file tests itself.

Needs pytest (`pip install pytest`). `pytest 24_motion_in_pytest.py` makes a test of every @motion
of this file; the fixture check_motion checks one inside a test of your own, with required margins.
"""

import subprocess
import sys
from collections.abc import Callable
from typing import Annotated

try:
    import pytest
except ImportError:
    print("this example needs pytest: python -m pip install pytest")
    raise SystemExit(0) from None

from motions import FeasibilityReport, Range, Timeline, deg, motion

Check = Callable[[object], FeasibilityReport]


@motion
def greet(taps: Annotated[int, Range(1, 5)] = 2) -> Timeline:
    """Greet: bow, then tap the ground with a front paw."""
    line = Timeline().body(pitch=deg(15), z=-0.04, over=0.8).hold(0.3).home(over=0.8)
    for _ in range(taps):
        line = line.foot("FR", z=0.06, over=0.4).down("FR", over=0.3)
    return line.home(over=0.8)


@pytest.mark.parametrize("taps", [1, 5])
def test_any_number_of_taps_is_feasible(check_motion: Check, taps: int) -> None:
    """The fixture fails with the table of margins, and returns the report."""
    assert check_motion(greet(taps=taps)).duration < 10.0


@pytest.mark.motion_margins(foot_load=20.0, support=0.03)
def test_every_standing_foot_stays_well_loaded(check_motion: Check) -> None:
    """The marker asks for more than the limits."""
    check_motion(greet)


def test_ten_taps_are_refused() -> None:
    """A parameter outside its range is an error with the range in it."""
    with pytest.raises(ValueError, match="1 to 5"):
        greet(taps=10)


if __name__ == "__main__":
    options = ["-v", "--no-header", "-p", "no:cacheprovider"]
    sys.exit(subprocess.call([sys.executable, "-m", "pytest", __file__, *options]))
