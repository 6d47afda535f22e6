"""``go2-wbc sweep``: what is printed and written, which exit code."""

import csv
import inspect
import json
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import pytest

from controller.cli.common import ExitCode, ProgressLine
from controller.cli.sweep import sweep_command, tell
from controller.sweeps import read_sweep
from controller.sweeps.run import Progress
from tests.controller.cli.conftest import Run
from tests.controller.sweeps import swept

WIDTH = 80
ODD = f"{swept.__name__}:odd_floats"
TRIAL = f"{swept.__name__}:trial"


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run) -> Run:
    """Sweeps with two workers, in a folder of the test's own."""
    monkeypatch.syspath_prepend(str(Path.cwd()))
    monkeypatch.chdir(tmp_path)
    return partial(run, "sweep", "--workers", 2)


def test_the_summary_fits_and_the_rows_are_kept(sweep: Run) -> None:
    told = sweep(TRIAL, "--n", 12)
    assert "ok                      33.3 %   95 %: 9.9 to 65.1 %" in told.out
    assert max(map(len, told.out.splitlines())) <= WIDTH
    assert "12/12, " in told.err
    assert " a second, 0 s left" in told.err
    (file,) = Path("out/sweeps").glob("*.sqlite")
    assert f"rows: {file}" in told.out
    assert len(read_sweep(file).rows) == 12
    assert inspect.signature(sweep_command).parameters["n"].default == 1000, "see its help"


def test_on_its_way_a_sweep_tells_twenty_times_how_long_the_rest_will_take(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ProgressLine() as line:
        for done in range(401):
            tell(line, Progress(done, 400, 1.0 if done else 0.0))
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 20
    assert told[0] == "20/400, 1 a second, 6.3 min left"
    assert told[13:15] == ["280/400, 1 a second, 2.0 min left", "300/400, 1 a second, 100 s left"]


def test_json_has_the_same_for_a_program(sweep: Run) -> None:
    told = json.loads(sweep(TRIAL, "--n", 6, "--json", "--out", "a.db").out)
    assert (told["n"], told["failures"], told["what"]) == (6, {}, TRIAL)
    assert told["rates"][0]["rate"] == pytest.approx(1 / 3)
    assert [item["name"] for item in told["spreads"]] == ["x", "norm", "n"]
    assert told["file"].endswith("a.db")


def test_csv_keeps_every_number_to_the_last_bit(sweep: Run) -> None:
    sweep(ODD, "--n", 7, "--out", "a.db", "--export", "rows.csv")
    with Path("rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["seed", "value"]
    assert [repr(float(row["value"])) for row in rows] == [repr(value) for value in swept.ODD]


@pytest.mark.parametrize("name", ["a.svg", "a.png", "a.pdf"])
def test_a_plot_shows_rates_and_numbers(name: str, sweep: Run) -> None:
    sweep(TRIAL, "--n", 6, "--plot", name)
    assert Path(name).stat().st_size > 1000
    if name.endswith(".svg"):
        words = Path(name).read_text(encoding="utf-8")
        assert all(word in words for word in ("share of the runs", ">norm<", "6 seeds"))


def test_a_plot_over_a_column_shows_the_relation(sweep: Run) -> None:
    sweep(TRIAL, "--n", 6, "--plot", "over.svg", "--over", "norm")
    words = Path("over.svg").read_text(encoding="utf-8")
    assert all(word in words for word in (">norm<", "rate, 95 %", "6 seeds"))
    told = sweep(TRIAL, "--n", 6, "--over", "norm", code=ExitCode.USAGE)
    assert "give --plot FILE, too" in told.err


def test_seeds_that_fail_are_told_and_are_a_failure(sweep: Run) -> None:
    word = f"{swept.__name__}:raise_on_5"
    told = sweep(word, "--n", 8, "--keep-going", code=ExitCode.FAILED)
    assert "seed 5 gave no row: ValueError: five is too much" in told.out
    assert "ValueError: five is too much" in told.err
    told = sweep(word, "--n", 8, code=ExitCode.RUNTIME)
    assert "seed 5: ValueError: five is too much; 7 finished rows" in told.err


@pytest.mark.skipif(find_spec("pyarrow") is not None, reason="pyarrow is installed")
def test_parquet_without_pyarrow_names_the_extra(sweep: Run) -> None:
    told = sweep(TRIAL, "--export", "rows.parquet", code=ExitCode.RUNTIME)
    assert 'pip install "go2-wbc[sweep]"' in told.err


@pytest.mark.skipif(find_spec("ray") is not None, reason="Ray is installed")
def test_ray_without_ray_names_the_extra(sweep: Run) -> None:
    told = sweep(TRIAL, "--engine", "ray", code=ExitCode.RUNTIME)
    assert 'pip install "go2-wbc[cluster]"' in told.err


def test_parquet_keeps_every_number_and_kind(sweep: Run) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra [sweep]")
    sweep(TRIAL, "--n", 9, "--out", "a.db", "--export", "a.parquet")
    table = parquet.read_table("a.parquet")
    assert table.to_pylist() == read_sweep("a.db").rows
    assert [str(kind) for kind in table.schema.types] == [
        "int64", "double", "double", "int64", "bool", "string",
    ]  # fmt: skip
