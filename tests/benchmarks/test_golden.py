"""Golden runs: what is equal, what is told of a difference, and that each stage is looked at."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import golden, golden_runs
from benchmarks.__main__ import main
from benchmarks.golden_runs import KEPT_EVERY, RUNS, STAGES, Ledger, RobotRun
from controller import GO2Controller
from controller.cli.common import ExitCode
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import JointCommand
from tests.benchmarks.conftest import Here


@pytest.fixture(autouse=True, scope="module")
def _one_process() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(golden, "LocalEngine", lambda _workers: Here())
        yield


def wait(go2: GO2Controller) -> None:
    go2.wait(0.1)


def runs(config: Config) -> dict[str, RobotRun]:
    """A robot that begins to rise, and one that walks until it is told to wait."""
    return {"rise": RobotRun((wait,)), "walk": RobotRun((GO2Controller.walk, wait), config=config)}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("golden")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(golden, "RUNS", runs(Config()))
        assert main(["golden", "record", str(folder)]) == ExitCode.OK
    return folder


def compared(
    folder: Path, patch: pytest.MonkeyPatch, config: Config | None = None, *options: str
) -> int:
    patch.setattr(golden, "RUNS", runs(config or Config()))
    return main(["golden", "compare", str(folder), *options])


def heavier() -> Config:
    """The configuration, but for a millionth of the weight of the forces."""
    wbc = Config().wbc
    return Config(wbc=replace(wbc, force_weight=wbc.force_weight * (1.0 + 1e-6)))


def test_the_same_runs_are_equal_and_what_is_near_within_a_tolerance(
    recorded: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compared(recorded, monkeypatch) == ExitCode.OK
    assert capsys.readouterr().out.split() == ["rise", "equal", "walk", "equal"]
    names = ("--runs", "walk", "--tolerance")
    assert compared(recorded, monkeypatch, heavier(), *names, "1e-2") == ExitCode.OK
    assert compared(recorded, monkeypatch, heavier(), *names, "1e-300") == ExitCode.FAILED


def test_a_weight_that_differs_by_a_millionth_is_found_in_the_solution(
    recorded: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compared(recorded, monkeypatch, heavier()) == ExitCode.FAILED
    rise, walk = capsys.readouterr().out.splitlines()
    assert rise.split() == ["rise", "equal"]
    assert "first in the solution: " in walk
    assert re.search(r"\] by \d\S*, \S+ for \S+ at tick \d+$", walk), walk


def test_an_unknown_run_and_a_missing_record_are_told(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert compared(recorded, monkeypatch, None, "--runs", "gallop") == ExitCode.USAGE
    assert compared(tmp_path, monkeypatch) == ExitCode.USAGE


def test_every_field_of_every_stage_counts() -> None:
    made = {
        stage: {name: np.array([1.0, 2.0]) for name in names} for stage, names in STAGES.items()
    }
    made["report"] = {"torque": np.array([1.0, 2.0])}
    before = Ledger(Path())
    before.tick(made)
    for stage, values in made.items():
        for name in values:
            now = Ledger(Path())
            now.tick({**made, stage: {**values, name: np.array([1.0, np.nextafter(2.0, 3.0)])}})
            told = golden.difference(before, now, 0.0)
            assert told is not None
            assert told.startswith(
                f"differs from tick 0 on, first in the {stage}: {name}[1] by 4.44"
            )


def test_a_digest_tells_minus_zero_from_zero_and_the_tick_is_named() -> None:
    def ledger(tau: float) -> Ledger:
        found = Ledger(Path())
        for number in range(2 * KEPT_EVERY):
            found.tick({"command": JointCommand.torque(np.full(12, tau if number == 7 else 0.0))})
        return found

    told = golden.difference(ledger(0.0), ledger(-0.0), 0.0)
    assert told == "differs from tick 7 on, first in the command: equal again at tick 20"


def test_a_run_that_is_shorter_or_says_something_else_is_told() -> None:
    def ledger(ticks: int, line: str) -> Ledger:
        found = Ledger(Path(), lines=[line])
        for _ in range(ticks):
            found.tick({"command": JointCommand.damping(1.0)})
        return found

    stored = ledger(3, "done")
    assert golden.difference(stored, ledger(3, "done"), 0.0) is None
    assert golden.difference(stored, ledger(2, "done"), 0.0) == "has 2 ticks instead of 3"
    assert golden.difference(stored, ledger(3, "fell"), 0.0) == "says 'fell' instead of 'done'"


def test_a_record_keeps_everything(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path, lines=["a line"])
    runs(Config())["rise"](ledger)
    golden.written(ledger, tmp_path / "run")
    read = golden.read(tmp_path / "run")
    assert (read.digests, read.lines) == (ledger.digests, ledger.lines)
    assert len(read.kept) == len(ledger.kept) > 1
    for name in ("digests", "kept", "lines"):
        np.testing.assert_equal(getattr(read, name), getattr(ledger, name))
    (tmp_path / "run").write_bytes(b"damaged")
    with pytest.raises(ConfigError, match="cannot read the golden run"):
        golden.read(tmp_path / "run")


def test_what_was_patched_is_as_it_was() -> None:
    read, write = MujocoPlant.read, MujocoPlant.write
    with golden_runs.noted(Ledger(Path())):
        assert MujocoPlant.read is not read
    assert (MujocoPlant.read, MujocoPlant.write) == (read, write)


def test_readings_of_the_sensors_are_kept_with_the_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = (wait,)
    short = RobotRun(steps, partial(MujocoPlant, sensors="imu"))
    monkeypatch.setattr(golden_runs, "RobotRun", lambda *_: short)
    monkeypatch.setattr(golden, "RUNS", {"estimator": RUNS["estimator"]})
    assert main(["golden", "record", str(tmp_path)]) == ExitCode.OK
    rows = np.load(tmp_path / "estimator.npy")
    np.save(tmp_path / "estimator.npy", rows[:-1])
    assert main(["golden", "compare", str(tmp_path)]) == ExitCode.FAILED
