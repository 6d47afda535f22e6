"""Which motion is played in which world: the order of the motions, and the seeds of each."""

from __future__ import annotations

from collections import Counter

import pytest

from benchmarks.probability_runs import WORLDS, exam, mixed, runs
from benchmarks.validation_set.drawing import TEST, TRAIN


def test_every_motion_has_the_worlds_of_its_half() -> None:
    asked, worlds = exam(), Counter(runs())
    assert {asked[number].family.half: count for number, count in worlds.items()} == WORLDS
    assert WORLDS[TEST] >= 5
    assert [worlds[number] for number in range(len(asked))] == [
        WORLDS[one.family.half] for one in asked
    ]
    assert runs(3) == runs()[: len(runs(3))]
    assert max(runs(3)) == 2


@pytest.mark.parametrize("count", [40, 100, 300])
def test_every_beginning_of_the_exam_is_mixed_evenly(count: int) -> None:
    asked = exam()
    assert len({one.name for one in asked}) == len(asked)
    shares = Counter((one.family.half, one.stratum) for one in asked)
    first = Counter((one.family.half, one.stratum) for one in asked[:count])
    for kind, total in shares.items():
        assert first[kind] == pytest.approx(total * count / len(asked), abs=2.0)


def test_no_family_comes_again_in_a_stratum_before_all_have_come() -> None:
    of_one = [q for q in exam() if (q.family.half, q.stratum) == (TRAIN, "easy")]
    quasi_static = [q.family.name for q in of_one if not q.family.is_dynamic]
    families = set(quasi_static)
    assert set(quasi_static[: len(families)]) == families


def test_mixing_loses_no_motion() -> None:
    asked = exam()
    assert sorted(q.name for q in mixed(asked[:50])) == sorted(q.name for q in asked[:50])
