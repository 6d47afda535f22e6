"""Benchmarks under test run in this process and write where the test says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks import behaviour, session
from benchmarks.scenario import Scenario
from controller.sweeps.trials import Trial

Only = Callable[[Scenario], None]


@pytest.fixture
def results_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Where the finished trials are kept during a test."""
    folder = tmp_path / "benchmarks"
    monkeypatch.setattr(session, "LOG_FOLDER", folder)
    return folder


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch, results_folder: Path) -> Only:
    """Makes a scenario the only one of ``behaviour``, and runs it in this process."""

    def install(scenario: Scenario) -> None:
        monkeypatch.setattr(behaviour, "SCENARIOS", (scenario,))
        monkeypatch.setattr(
            session,
            "run_tasks",
            lambda tasks, _jobs: ((s, seed, s.measure(Trial(seed))) for s, seed in tasks),
        )

    return install
