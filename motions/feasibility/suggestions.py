"""Changes that make a refused motion feasible: the least change of tempo, size, height or shifts.

Each kind of change is a call that the author can append to the motion. Its number is searched on a
grid as coarse as the printed digits: it grows until the check passes with a probability of ``AIM``,
then is bisected between the last number that did not pass and the first that did. So the suggestion
is exactly what was checked, and not at the border of feasibility, where half of all motions fail.
If no change reaches this probability, changes that just pass are suggested.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError, MotionError, TimelineError
from motions.feasibility.check import FeasibilityChecker, Playable, timeline_of
from motions.feasibility.report import FeasibilityReport
from motions.language.keys import BalanceShift
from motions.language.timeline import Timeline

_log = logging.getLogger(__name__)
_ReportOf = Callable[[Timeline], FeasibilityReport | None]
AIM = 0.9  #: Least chance of what is suggested


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A change that makes a motion feasible, and the least of its kind.

    Attributes:
        kind: "tempo", "amplitude", "height", "shift time", "jump" or "tempo and amplitude".
        call, meaning: what to append to the motion, as Python and in words.
        change: how large it is, as a share of the largest of its kind that is tried.
        motion, report: the changed motion, and what the check says of it.
    """

    kind: str
    call: str
    meaning: str
    change: float
    motion: Timeline
    report: FeasibilityReport

    __repr__ = brief

    def __str__(self) -> str:
        """A line to paste, with what it does."""
        return f"{self.call:<32} # {self.meaning}"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "kind": self.kind,
            "call": self.call,
            "meaning": self.meaning,
            "duration": self.report.duration,
            "end_pose": self.report.end_pose,
        }


@dataclass(frozen=True, slots=True)
class _Kind:
    """One kind of change."""

    name: str  #: see ``Suggestion.kind``
    ladder: Sequence[int]  #: numbers of steps that are tried, increasing
    calls: Mapping[str, Callable[[int], float]]
    """Calls of one number each, in their order, by what that is for a number of steps."""
    meaning: str  #: in words, of ``steps`` and of how long it ``lasts`` [s] after them
    digits: int = 2  #: to which the numbers are rounded
    finest: int = 1  #: difference of two numbers of steps that is looked for

    def numbers(self, steps: int) -> dict[str, float]:
        """The calls' numbers, by their names."""
        return {name: round(value(steps), self.digits) for name, value in self.calls.items()}

    def text(self, steps: int) -> str:
        """The calls as Python, with the very numbers that ``apply`` uses."""
        return "".join(f".{name}({value!r})" for name, value in self.numbers(steps).items())

    def apply(self, line: Timeline, steps: int) -> Timeline:
        """``line`` after the calls."""
        for name, value in self.numbers(steps).items():
            line = getattr(line, name)(value)
        return line


_RISE = (5, 10, 15, 20, 30, 40, 60, 80)  #: mm; own choice: the trunk stands 0.29 m high
_SHARES = (2, 5, 10, 15, 20, 30, 40, 50, 60, 70, 80, 90)  #: Per cent
_LONGER = (2, 5, 10, 20, 30, 40, 50, 75, 100, 150, 200, 300)  #: Per cent


def _longer(steps: int) -> float:
    return 1.0 + steps / 100


def _smaller(steps: int) -> float:
    return 1.0 - steps / 100


TEMPO = _Kind("tempo", _LONGER, {"scale_time": _longer}, "slower: it takes {lasts:.1f} s")
AMPLITUDE = _Kind("amplitude", _SHARES, {"scale": _smaller}, "all moves smaller by {steps} %")
HIGHER, LOWER = (
    _Kind("height", _RISE, {"shift_height": rise}, f"the trunk {way} by {{steps}} mm", digits=3)
    for way, rise in (("higher", lambda mm: mm / 1000), ("lower", lambda mm: -mm / 1000))
)
SHIFT_TIME = _Kind(
    "shift time",
    _LONGER,
    {"scale_shifts": _longer},
    "{steps} % more time to move over the feet that stay",
)
JUMPS = _Kind(
    "jump",
    (20, 40, 60, 80),
    {"scale_jumps": _smaller},
    "jumps lower and shorter by {steps} %",
    finest=5,
)
"""In few tries: each that has no plan is searched for long."""
BOTH = _Kind(
    "tempo and amplitude",
    _SHARES,
    {"scale": _smaller, "scale_time": lambda steps: 1.0 / _smaller(steps)},
    "smaller by {steps} % and slower: {lasts:.1f} s",
)


@typed("checker")
def suggest(
    motion: Playable, *, checker: FeasibilityChecker | None = None
) -> tuple[Suggestion, ...]:
    """The least changes that make ``motion`` feasible, of each kind, the smallest first.

    Nothing is suggested for a motion that is feasible. If no kind alone is enough, the motion is
    made smaller and slower at once; if that is not enough either, there is no suggestion.

    Args:
        motion: a name of the library, a motion, a timeline, or the file of a saved motion.
        checker: what checks, with its robot and limits; by default the installed Go2.

    Raises:
        CommandError: for an unknown name, or for a plan, which has no calls to change.
    """
    line, checker = timeline_of(motion), checker or FeasibilityChecker()
    if line is None:
        raise CommandError(
            "suggest() needs a motion as it is written, a name, a function with @motion before it "
            f"or a Timeline, got {type(motion).__name__}"
        )

    @cache
    def report_of(changed: Timeline) -> FeasibilityReport | None:
        return _report(changed, checker)

    if report_of(line) is not None:
        return ()
    for aim in (AIM, 0.0):
        for kinds in ((TEMPO, AMPLITUDE, HIGHER, LOWER, SHIFT_TIME, JUMPS), (BOTH,)):
            found = [_least(line, kind, report_of, aim) for kind in kinds]
            if some := [one for one in found if one is not None]:
                return tuple(sorted(some, key=lambda one: one.change))
    return ()


def _least(line: Timeline, kind: _Kind, report_of: _ReportOf, aim: float) -> Suggestion | None:
    """The least change of one kind after which ``line`` passes at a chance of ``aim``, if any."""
    if kind is SHIFT_TIME and not any(isinstance(key, BalanceShift) for key in line.keys):
        return None

    def tried(steps: int) -> Suggestion | None:
        changed = kind.apply(line, steps)
        _log.info("trying %s", kind.text(steps))
        if (report := report_of(changed)) is None or report.probability < aim:
            return None
        meaning = kind.meaning.format(steps=steps, lasts=report.duration)
        share = steps / kind.ladder[-1]
        return Suggestion(kind.name, kind.text(steps), meaning, share, changed, report)

    try:
        return _first(tried, kind)
    except TimelineError:  # the motion has calls that this cannot change
        return None


def _first(tried: Callable[[int], Suggestion | None], kind: _Kind) -> Suggestion | None:
    """Up the ladder to the first that passes, then by bisection to the least."""
    refused = 0
    for steps in kind.ladder:
        if (best := tried(steps)) is not None:
            break
        refused = steps
    else:
        return None
    while steps - refused > kind.finest:
        middle = (refused + steps) // 2
        if (less := tried(middle)) is None:
            refused = middle
        else:
            best, steps = less, middle
    return best


def _report(line: Timeline, checker: FeasibilityChecker) -> FeasibilityReport | None:
    """What the check says of ``line`` if it passes."""
    try:
        report = checker.check(line)
    except TimelineError:
        raise
    except MotionError:  # no plan was found: not feasible
        return None
    return report if report.ok else None
