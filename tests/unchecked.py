"""Trials of a study in a process of their own, without run-time checks: three times as fast."""

import os
import pickle
from collections.abc import Iterable
from pathlib import Path

from benchmarks.study import Results
from controller.sweeps.engine import ONE_THREAD
from tests.script_server import ROOT, run_script

TRIALS = """
import importlib, pickle, sys
from benchmarks.study import chosen_studies

module, name, seeds, file = sys.argv[1:]
studies = chosen_studies(importlib.import_module(module).STUDIES, [name])
found = {study.name: {seed: study.run(seed) for seed in eval(seeds)} for study in studies}
with open(file, "wb") as out:
    pickle.dump(found, out)
"""


def run_trials(module: str, name: str, seeds: Iterable[int], folder: Path) -> Results:
    """What the trials of a study, or of a group, gave; ``folder`` is for files."""
    file = folder / "trials.pickle"
    words = ["-c", TRIALS, f"benchmarks.{module}", name, str(list(seeds)), str(file)]
    ended = run_script(words, ROOT, {**os.environ, **ONE_THREAD})
    assert ended.returncode == 0, ended.stderr
    return pickle.loads(file.read_bytes())
