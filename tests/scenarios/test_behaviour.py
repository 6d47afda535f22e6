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
from benchmarks.study import Study
from controller.sweeps.engine import ONE_THREAD
from tests.script_server import run_script

ROOT = Path(__file__).resolve().parents[2]
TRIALS = """
import pickle, sys
from benchmarks.behaviour import STUDIES
from benchmarks.study import run_tasks

name, seeds, file = sys.argv[1:]
(scenario,) = (scenario for scenario in STUDIES if scenario.name == name)
done = run_tasks([(scenario, seed) for seed in range(int(seeds))], jobs=0)
with open(file, "wb") as out:
    pickle.dump({seed: measurement for _, seed, measurement in done}, out)
"""
"""Runs the trials of a scenario; what they measured goes to a file."""

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
    assert {scenario.name for scenario in STUDIES} == set(SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", STUDIES, ids=lambda scenario: scenario.name)
def test_the_robot_meets_every_threshold_and_never_falls(scenario: Study, tmp_path: Path) -> None:
    file, seeds = tmp_path / "trials.pickle", SEEDS[scenario.name]
    words = ["-c", TRIALS, scenario.name, str(seeds), str(file)]
    ended = run_script(words, ROOT, {**os.environ, **ONE_THREAD})
    assert ended.returncode == 0, ended.stderr
    trials = pickle.loads(file.read_bytes())
    assert sorted(trials) == list(range(seeds))
    report = summarise([scenario], {scenario.name: trials})
    failed = {result.metric.name for result in report.rows if result.passed is False}
    assert failed - NOT_JUDGED == set(), render(report)
