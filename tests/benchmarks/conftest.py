"""Benchmarks under test run in this process and write where the test says."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import behaviour, command, store
from benchmarks.study import Study

Only = Callable[[Study], None]


@pytest.fixture
def results_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Where the finished trials are kept during a test."""
    folder = tmp_path / "benchmarks"
    monkeypatch.setattr(store, "FOLDER", folder)
    return folder


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch, results_folder: Path) -> Only:
    """Makes a study the only one of ``behaviour``, and runs it in this process."""

    def install(study: Study) -> None:
        monkeypatch.setattr(behaviour, "run", replace(behaviour.BENCHMARK, studies=(study,)).run)
        monkeypatch.setattr(
            command, "run_tasks", lambda tasks, _jobs: ((s, seed, s.run(seed)) for s, seed in tasks)
        )

    return install
