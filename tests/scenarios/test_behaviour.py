"""What the robot must show, in MuJoCo: every bar of the behaviour bench, on a few seeds.

The trials run in spawned processes, without the run-time checks of array shapes: three times as
fast. The full numbers, over 20 and 100 seeds, come from ``go2-wbc bench behaviour``.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.families import FAMILIES, find_families
from benchmarks.report import render, summarise
from benchmarks.runner import run_families

SEEDS = {
    "model": 3,
    "solutions": 1,
    "stand": 3,
    "stand-pushes": 1,
    "trot": 1,
    "trot-pushes": 1,
    "goals": 2,
    "high-five": 2,
    "slaps": 1,
    "sequence": 2,
    "library": 1,
}
"""How many seeds of each family fit into a few minutes."""
NOT_JUDGED = frozenset({"demo.pace"})
"""Processor time on a machine that runs tests at the same time says nothing."""


def test_every_family_has_its_scenario() -> None:
    assert {family.name for family in FAMILIES} == set(SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seeds"), SEEDS.items(), ids=list(SEEDS))
def test_the_robot_meets_every_bar_and_never_falls(name: str, seeds: int) -> None:
    families = [replace(family, seed_factor=1) for family in find_families([name])]
    report = summarise(families, run_families(families, seeds, jobs=1))
    failed = {result.row.name for result in report.rows if result.passed is False}
    assert failed - NOT_JUDGED == set(), render(report)
