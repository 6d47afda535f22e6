"""The exam's motions: which family, which draw, which amplitude, and from which stratum."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from benchmarks.validation_set.drawing import Draw, Family
from benchmarks.validation_set.dynamic_families import DYNAMIC
from benchmarks.validation_set.feet_families import FEET, GOING
from benchmarks.validation_set.trunk_families import TRUNK
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline

TWICE = (
    "two_tracks", "three_tracks", "gaze", "random_trunk", "four_steps", "leaning_walk",
    "leaning_trot", "higher_hops", "jump_anywhere", "two_jumps", "phased_dip",
    *(family.name for family in FEET),
)  # fmt: skip
"""Families whose draws differ most, and all in which feet are raised: of each, two are bisected."""
FAMILIES: dict[str, Family] = {
    family.name: replace(family, draws=2) if family.name in TWICE else family
    for family in (*TRUNK, *FEET, *GOING, *DYNAMIC)
}
"""By name."""
EASY, BORDER, IMPOSSIBLE = "easy", "border", "impossible"
STRATA = (EASY, BORDER, IMPOSSIBLE)
EASY_SHARE, BORDER_SHARE, IMPOSSIBLE_SHARE = (0.3, 0.7), (0.10, 0.25), (1.6, 2.5)
"""Amplitudes as shares of the one at which physics changes its mind; borders, off it."""

FRESH = 100  # Number of the first draw that is not bisected
FRESH_DYNAMIC = 110  # The same of what is asked besides of solved motions
EACH = 4  # Motions that are asked besides of each dynamic family


@dataclass(frozen=True, slots=True)
class LateStart(MotionPlan):
    """A plan without its first ``start`` seconds, as if it began where that leaves the robot."""

    name: str
    entry: Posture
    exit: Posture
    duration: float
    inner: MotionPlan
    start: float

    def at(self, t: float) -> Reference:
        """The reference ``t`` seconds after the late start."""
        return self.inner.at(max(t, 0.0) + self.start)


@dataclass(frozen=True, slots=True)
class Question:
    """One motion."""

    family: Family  #: its structure
    draw: int  #: number of the draw of its free numbers
    amplitude: float  #: of what the family scales
    stratum: str = ""  #: how it was chosen

    @property
    def name(self) -> str:
        """Unique: family, draw and amplitude."""
        return f"{self.family.name} {self.draw} {self.amplitude:.4f}"

    @property
    def line(self) -> Timeline:
        """As it is written."""
        draw = Draw(self.family.name, self.draw)
        return replace(self.family.write(draw, self.amplitude), name=self.name)

    def plan(self, model: RobotModel) -> MotionPlan:
        """What is checked and played."""
        plan = FeasibilityChecker(model).plan(self.line, check=False)
        late = self.family.late
        if late == 0.0:
            return plan
        return LateStart(plan.name, plan.entry, plan.exit, plan.duration - late, plan, late)


def draws() -> list[tuple[Family, int]]:
    """All draws of all families, the first draw of each family first."""
    most = max(family.draws for family in FAMILIES.values())
    return [(f, k) for k in range(most) for f in FAMILIES.values() if k < f.draws]


def questions(borders: Mapping[str, float | None]) -> list[Question]:
    """The exam: of each border motions on both sides of it, and as many easy and impossible ones.

    These have free numbers of their own, and the same border stands for them. Of solved motions
    there are fewer: to see that there is no plan takes 20 s.

    Args:
        borders: by family and draw (see ``draw_name``), the amplitude at which physics changes its
            mind; None where it does not between the family's bounds: then these stand for it, and
            there is no motion at the border.
    """
    known = [draw for draw in draws() if draw_name(*draw) in borders]
    found = [one for draw in known for one in _around(*draw, borders[draw_name(*draw)])]
    return list({question.name: question for question in found}.values())


def dynamic_questions(borders: Mapping[str, float | None]) -> list[Question]:
    """The exam's dynamic motions, and ``EACH`` more of each family, with free numbers of their own.

    Where physics does not change its mind there are twice as many draws, and none at a border. For
    ``borders`` see ``questions``.
    """
    more: list[Question] = []
    for family in (family for family in FAMILIES.values() if family.is_dynamic):
        flip, number, own = borders[draw_name(family, 0)], FRESH_DYNAMIC, list[Question]()
        while len(own) < EACH:
            rng = Draw(f"more strata of {family.name}", number)
            sides = () if flip is None else (-1.0, 1.0)
            asked = [
                ((flip or 2.0 * family.low) * rng.between(*EASY_SHARE), EASY),
                ((flip or family.high) * rng.between(*IMPOSSIBLE_SHARE), IMPOSSIBLE),
                *(((flip or 1.0) * (1.0 + k * rng.between(*BORDER_SHARE)), BORDER) for k in sides),
            ]
            own += [_clipped(family, number, *amplitude) for amplitude in asked]
            number += 1
        more += own
    found = [*(one for one in questions(borders) if one.family.is_dynamic), *more]
    return list({question.name: question for question in found}.values())


def _clipped(family: Family, number: int, amplitude: float, stratum: str) -> Question:
    """A motion whose amplitude lies between the family's bounds."""
    s = round(min(max(amplitude, family.low), family.high), 4)
    return Question(family, number, s, stratum)


def _around(family: Family, number: int, flip: float | None) -> Iterator[Question]:
    """The motions that belong to one border."""
    rng = Draw(f"strata of {family.name}", number)
    count, fresh = (1, FRESH + number) if family.is_dynamic else (2, FRESH + 2 * number)
    below, above = (1.0 + side * rng.between(*BORDER_SHARE) for side in (-1.0, 1.0))
    asked: list[tuple[int, float, str]] = []
    if flip is not None:
        asked += [(number, flip * below, BORDER), (number, flip * above, BORDER)]
    for draw in range(fresh, fresh + count):
        easy, beyond = rng.between(*EASY_SHARE), rng.between(*IMPOSSIBLE_SHARE)
        asked.append((draw, (flip or 2.0 * family.low) * easy, EASY))
        asked.append((draw, (flip or family.high) * beyond, IMPOSSIBLE))
    for draw, amplitude, stratum in asked:
        yield _clipped(family, draw, amplitude, stratum)


def draw_name(family: Family, number: int) -> str:
    """The key of a draw in the file of borders."""
    return f"{family.name} {number}"
