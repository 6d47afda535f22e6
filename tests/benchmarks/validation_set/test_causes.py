"""What the check once got wrong, and what it says of it now: as physics does.

That was the same when this was written. It says whether these causes are mended, and nothing of
motions that nobody has thought of: that is what the exam is for.
"""

from collections.abc import Callable

import pytest

from benchmarks.validation_set.drawing import to_and_fro
from go2_wbc.legs import LEGS
from motions import FeasibilityChecker, Timeline, deg

Write = Callable[[float], Timeline]
Go = Callable[[Timeline], Timeline]


def over_and_over(times: int, go_on: Go, over: float) -> Timeline:
    line = Timeline()
    for _ in range(times):
        line = go_on(line)
    return line.home(over=over)


def lifts_in_turn(z: float) -> Timeline:
    line = Timeline()
    for leg in LEGS:
        line = line.foot(leg, z=z, over=0.5).down(leg, over=0.5)
    return line.home(over=0.8)


def tap(leg: str, z: float, up: float, down: float) -> Go:
    return lambda line: line.foot(leg, z=z, over=up).down(leg, over=down)


CAUSES: dict[str, tuple[Write, tuple[float, ...], str, tuple[float, ...]]] = {
    "roll and back": (
        lambda s: Timeline().body(roll=deg(s), over=0.8).hold(0.3).body(roll=0.0, over=0.8),
        (9.0, 12.0), "", (),
    ),
    "head down": (
        lambda s: Timeline().body(pitch=deg(28.0), z=-s, over=1.0).hold(0.6).home(over=1.0),
        (), "clearance", (0.06, 0.10),
    ),
    "twists": (
        lambda s: over_and_over(3, lambda line: to_and_fro(line, "yaw", deg(20.0), s), s),
        (), "slip", (0.20, 0.25, 0.30),
    ),
    "sways": (
        lambda s: over_and_over(3, lambda line: to_and_fro(line, "y", 0.03, s), 0.5),
        (0.30, 0.40), "", (),
    ),
    "skims": (
        lambda s: Timeline().foot("FR", y=-0.05, z=s, over=0.6).down("FR", over=0.6).home(over=0.8),
        (0.004, 0.010, 0.030), "", (),
    ),
    "slides": (
        lambda s: Timeline().foot("RR", x=s, z=0.006, over=0.6).down("RR", over=0.5).home(over=0.8),
        (0.02, 0.04), "", (),
    ),
    "rocks": (
        lambda s: over_and_over(4, lambda line: to_and_fro(line, "roll", 0.37, s), 0.5),
        (0.20,), "slip", (0.13,),
    ),
    "stamps": (
        lambda s: over_and_over(3, tap("FR", 0.07, 0.4, s), 0.8), (0.15, 0.20, 0.25), "", (),
    ),
    "taps": (
        lambda s: over_and_over(4, tap("FL", 0.03, s, s), 0.8), (0.15, 0.20, 0.30), "", (),
    ),
    "lifts in turn": (lifts_in_turn, (0.05, 0.10, 0.15), "", ()),
}  # fmt: skip
"""Motions by a size (degrees, metres or seconds); sizes that are done; the check that refuses the
others, and these, which physics does not do."""


@pytest.mark.parametrize(
    ("name", "size"),
    [(name, size) for name, (_, done, _, wrong) in CAUSES.items() for size in (*done, *wrong)],
)
def test_a_known_cause_of_wrong_verdicts_stays_mended(
    name: str, size: float, checker: FeasibilityChecker
) -> None:
    write, done, by, _ = CAUSES[name]
    report = checker.check(write(size))
    assert report.ok is (size in done)
    assert report.ok or by in {finding.check for finding in report.failures}
