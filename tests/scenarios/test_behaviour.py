"""What the robot must show, in MuJoCo: every threshold of the behaviour benchmark.

The trials of a scenario run in a process of their own, without the run-time checks of array shapes:
three times as fast. The full numbers, over 20 and 100 seeds, come from
``python -m benchmarks behaviour``.
"""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest

from benchmarks.behaviour import STUDIES
from benchmarks.report import render, summarise
from benchmarks.study import chosen_studies
from controller.sweeps.engine import ONE_THREAD
from tests.script_server import run_script

ROOT = Path(__file__).resolve().parents[2]
TRIALS = """
import pickle, sys
from benchmarks.behaviour import STUDIES
from benchmarks.study import chosen_studies

name, seeds, file = sys.argv[1:]
studies = chosen_studies(STUDIES, [name])
found = {study.name: {seed: study.run(seed) for seed in range(int(seeds))} for study in studies}
with open(file, "wb") as out:
    pickle.dump(found, out)
"""
"""Runs the trials of a scenario, or of a group; what they measured goes to a file."""

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
"""How many seeds of each scenario fit into a few minutes."""
NOT_JUDGED = frozenset({"demo.pace"})
"""Processor time on a machine that runs tests at the same time says nothing."""


def test_every_scenario_has_its_seeds() -> None:
    assert {study.group or study.name for study in STUDIES} == set(SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seeds"), SEEDS.items(), ids=list(SEEDS))
def test_the_robot_meets_every_threshold_and_never_falls(
    name: str, seeds: int, tmp_path: Path
) -> None:
    file, studies = tmp_path / "trials.pickle", chosen_studies(STUDIES, [name])
    words = ["-c", TRIALS, name, str(seeds), str(file)]
    ended = run_script(words, ROOT, {**os.environ, **ONE_THREAD})
    assert ended.returncode == 0, ended.stderr
    report = summarise(studies, pickle.loads(file.read_bytes()))
    assert {result.n for result in report.rows} == {seeds}
    failed = {result.metric.name for result in report.rows if result.passed is False}
    assert failed - NOT_JUDGED == set(), render(report)
