"""A sweep gives every row once, whatever carries it, ends it, or goes wrong in it."""

import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from controller import sweep
from controller.sweeps import Progress, read_sweep
from controller.sweeps.sweep_file import Row
from controller.sweeps.targets import LoadedFunction, checked_row
from go2_wbc.errors import CommandError, ConfigError, SweepError
from tests.controller.sweeps import swept
from tests.script_server import ROOT, python

HANG_GUARD = 120.0  #: Seconds after which a process that should have ended fails its test
SWEEP = (
    "from controller import sweep; from tests.controller.sweeps import swept; "
    "sweep(swept.slow, {n}, workers=2, out={out!r})"
)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "rows.sqlite"


def expected(n: int, function: Callable[[int], dict] = swept.trial) -> list[Row]:
    return [{"seed": seed, **function(seed)} for seed in range(n)]


def known(rows: list[Row]) -> list[Row]:
    """Without what depends on the threads of BLAS, of which this process may have several."""
    return [{name: value for name, value in row.items() if name != "norm"} for row in rows]


def test_every_seed_gives_one_row_whatever_the_number_of_workers(tmp_path: Path) -> None:
    one = sweep(swept.trial, 20, workers=1, out=tmp_path / "one.sqlite")
    three = sweep(swept.trial, 20, workers=3, out=tmp_path / "three.sqlite")
    assert known(one.rows) == known(expected(20))
    assert one.rows == three.rows  # bit by bit
    assert one.failures == {}
    assert one.name == "tests.controller.sweeps.swept:trial"


def test_a_word_stands_for_a_function_of_a_module_or_file(tmp_path: Path) -> None:
    word = f"{swept.__file__}:trial"
    of_file = sweep(word, 3, workers=1, out=tmp_path / "a.sqlite")
    of_module = sweep(f"{swept.__name__}:trial", 3, workers=1, out=tmp_path / "b.sqlite")
    assert of_file.rows == of_module.rows
    assert known(of_file.rows) == known(expected(3))


def test_more_seeds_add_to_what_is_there_fewer_take_of_it_and_fresh_begins_anew(out: Path) -> None:
    sweep(swept.process, 4, workers=1, out=out)
    told: list[Progress] = []
    first = read_sweep(out).rows
    later = sweep(swept.process, 6, workers=1, out=out, on_progress=told.append)
    assert later.rows[:4] == first
    assert {row["pid"] for row in later.rows[4:]}.isdisjoint(row["pid"] for row in first)
    assert [progress.done for progress in told] == [4, 5, 6]
    assert (told[0].rate, told[0].share, told[-1].remaining) == (0.0, 4 / 6, 0.0)
    assert (told[0].remaining, told[1].remaining) == (math.inf, 1 / told[1].rate)
    sweep(swept.trial, 6, workers=1, out=out, fresh=True)
    again = sweep(swept.trial, 2, first_seed=3, workers=1, out=out)
    assert [row["seed"] for row in again.rows] == [3, 4]
    process = sweep(swept.process, 2, workers=1, out=out, fresh=True)
    again = sweep(swept.process, 2, workers=1, out=out, fresh=True)
    assert process.rows[0]["pid"] != again.rows[0]["pid"]


def test_fresh_removes_no_file_that_is_something_else(tmp_path: Path) -> None:
    file = tmp_path / "letter.db"
    file.write_text("Dear reader, " * 100)
    with pytest.raises(ConfigError, match="no database of a sweep"):
        sweep(swept.trial, 2, workers=1, out=file, fresh=True)
    assert file.read_text().startswith("Dear reader")


def test_rows_of_something_else_are_not_mixed(out: Path) -> None:
    sweep(swept.trial, 2, workers=1, out=out)
    with pytest.raises(ConfigError, match=r"depend on something else \(what .*swept:trial, now"):
        sweep(swept.slow, 2, workers=1, out=out)


def test_a_changed_file_is_not_mixed_with_what_it_was(tmp_path: Path, out: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text("def f(seed):\n    return {'x': 1.0 * seed}\n")
    sweep(f"{file}:f", 2, workers=1, out=out)
    file.write_text("def f(seed):\n    return {'x': 2.0 * seed}\n")
    script = f"from controller import sweep; sweep({f'{file}:f'!r}, 4, workers=1, out={str(out)!r})"
    done = python("-c", script)
    assert done.returncode == 1
    assert "depend on something else (content" in done.stderr
    assert [row["x"] for row in read_sweep(out).rows] == [0.0, 1.0]


def test_a_function_that_raises_is_told_with_its_seed_and_traceback(out: Path) -> None:
    with pytest.raises(SweepError) as caught:
        sweep(swept.raise_on_5, 9, workers=1, out=out)
    text = str(caught.value)
    assert "seed 5: ValueError: five is too much; 5 finished rows are kept in" in text
    assert "in raise_on_5" in text
    assert not any(own in text for own in ("worker.py", "targets.py"))
    assert known(read_sweep(out).rows) == known(expected(5))


def test_with_keep_going_a_seed_that_fails_costs_no_other_one_its_row(out: Path) -> None:
    told: list[Progress] = []
    result = sweep(
        swept.raise_on_5, 9, workers=2, out=out, keep_going=True, on_progress=told.append
    )
    assert [row["seed"] for row in result.rows] == [0, 1, 2, 3, 4, 6, 7, 8]
    assert result.failures == {5: "ValueError: five is too much"}
    assert [p.failure.text for p in told if p.failure] == ["ValueError: five is too much"]


@pytest.mark.parametrize(
    ("function", "cause"), [(swept.die_on_5, "killed by SIGSEGV"), (swept.exit_on_5, "exit code 9")]
)
def test_a_worker_that_dies_is_told_with_its_cause(
    function: Callable[[int], dict], cause: str, out: Path
) -> None:
    with pytest.raises(
        SweepError, match=rf"seed 5: its process died 2 times: {cause}; \d finished"
    ):
        sweep(function, 9, workers=1, out=out)
    result = sweep(function, 9, workers=2, out=out, keep_going=True)
    assert known(result.rows) == known([row for row in expected(9) if row["seed"] != 5])
    assert list(result.failures) == [5]


def test_a_worker_that_dies_once_costs_nothing(
    tmp_path: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GO2_WBC_TEST_FILE", str(tmp_path / "died"))
    result = sweep(swept.die_once, 8, workers=2, out=out)
    assert (tmp_path / "died").exists()
    assert known(result.rows) == known(expected(8))


def test_what_a_function_prints_or_gives_that_is_no_row_is_kept_out(out: Path) -> None:
    assert known(sweep(swept.talk, 5, workers=1, out=out).rows) == known(expected(5))
    with pytest.raises(SweepError, match="must return a dict"):
        sweep(swept.no_row, 3, workers=1, out=out, fresh=True)


def test_workers_have_one_thread_for_blas_and_one_order_of_sets(out: Path) -> None:
    (row,) = sweep(swept.threads, 1, workers=1, out=out).rows
    assert (row["blas"], row["hash"]) == ("1", "0")


def running(command: list[str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, start_new_session=True)


def test_after_three_kills_at_random_moments_all_rows_are_there_once(out: Path) -> None:
    """``kill -9`` of the parent, each time after some more rows."""
    n, picked = 240, random.Random(4).sample(range(20, 200), 3)
    for least in sorted(picked):
        process = running([sys.executable, "-c", SWEEP.format(n=n, out=str(out))])
        wait_until(partial(has_rows, out, least))
        os.kill(process.pid, signal.SIGKILL)
        assert process.wait(HANG_GUARD) == -signal.SIGKILL
        assert least <= rows_in(out) < n
    result = sweep(swept.slow, n, workers=2, out=out)
    assert [row["seed"] for row in result.rows] == list(range(n))
    assert known(result.rows) == known(expected(n))


def test_workers_end_with_a_parent_that_was_killed(out: Path) -> None:
    code = (
        "from controller import sweep; from tests.controller.sweeps import swept; "
        f"sweep(swept.wait_for_ever, 4, workers=2, out={str(out)!r})"
    )
    process = running([sys.executable, "-c", code])
    wait_until(
        lambda: len(descendants(process.pid)) == 4
    )  # two workers, what forks them, and its tracker
    started = descendants(process.pid)
    os.kill(process.pid, signal.SIGKILL)
    process.wait(HANG_GUARD)
    wait_until(lambda: not any(is_running(pid) for pid in started))


def has_rows(out: Path, least: int) -> bool:
    return rows_in(out) >= least


def rows_in(out: Path) -> int:
    return len(read_sweep(out).rows) if out.is_file() and out.stat().st_size else 0


def descendants(pid: int) -> list[int]:
    """The processes that a running one has started, and those that they have."""
    own = [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return own + [later for child in own for later in descendants(child)]


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_until(condition: Callable[[], bool]) -> None:
    """Look again and again; only a hang ends it otherwise."""
    end = time.monotonic() + HANG_GUARD
    while not condition():
        if time.monotonic() > end:
            pytest.fail("waited in vain")
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"first_seed": -1}, "first_seed must be a whole number, at least 0"),
        ({"workers": 0}, "workers must be a whole number, at least 1"),
        ({"address": "auto"}, "choose the engine ray"),
    ],
)
def test_arguments_that_are_not_valid_are_refused(arguments: dict, message: str, out: Path) -> None:
    with pytest.raises(CommandError, match=message):
        sweep(swept.trial, **{"n": 1, "out": out, **arguments})
    assert not out.exists()


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("no_such_motion", "unknown motion 'no_such_motion'"),
        ("gait:no_such_gait", "unknown gait 'no_such_gait'"),
        ("gait:trot@fast", "'fast' is no finite number"),
        ("gait:trot@1,2,3,4", "at most 3 numbers, got 4"),
        ("push:", "'' is no finite number"),
        ("push:nan", "'nan' is no finite number"),
        ("none.py:trial", "there is no file none.py"),
        ("no_such_module:trial", "cannot load no_such_module: ModuleNotFoundError"),
        (f"{swept.__name__}:no_such", "unknown function 'no_such'; valid: die_on_5"),
        (f"{swept.__file__}:no_such", "unknown function 'no_such'; valid: die_on_5"),
        (lambda seed: {"x": seed}, "cannot be found by other processes"),
        (3, "motion must be a name"),
    ],
)
def test_what_cannot_be_swept_is_refused_with_what_can(
    what: object, message: str, out: Path
) -> None:
    with pytest.raises(CommandError, match=message):
        sweep(what, 1, out=out)
    assert not out.exists()


def test_a_file_that_changes_during_the_sweep_is_told(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text("def f(seed):\n    return {'x': 1.0}\n")
    with pytest.raises(SweepError, match="has changed since the sweep began"):
        LoadedFunction(str(file), "f", "another digest")(0)


def test_a_worker_with_other_code_is_told() -> None:
    with pytest.raises(SweepError, match="this worker has other code than the sweep"):
        checked_row(swept.trial, ("another digest", "numpy 1"), 0)
