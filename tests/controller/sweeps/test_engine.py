"""Workers are forked from one process, and are as if each had been started anew."""

import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import cast
from unittest.mock import Mock

import pytest

from controller import sweep
from controller.sweeps.engine import Worker, order_of, start
from controller.sweeps.sweep_file import Row
from tests.controller.sweeps import swept
from tests.script_server import python

HANG_GUARD = 120.0  #: Seconds after which a process that should have ended fails its test


def asked(function: Callable[[int], object], tmp_path: Path) -> Row:
    """What a worker gives for seed 0."""
    (row,) = sweep(function, 1, workers=1, out=tmp_path / "rows.sqlite", fresh=True).rows
    return row


def test_later_workers_come_from_the_same_process_until_it_dies(tmp_path: Path) -> None:
    first, later = asked(swept.process, tmp_path), asked(swept.process, tmp_path)
    assert first["parent"] == later["parent"] != os.getpid()
    assert first["pid"] != later["pid"]
    os.kill(int(first["parent"]), signal.SIGKILL)
    assert asked(swept.process, tmp_path)["parent"] != first["parent"]


def test_a_worker_has_the_surroundings_of_the_moment_it_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        (folder := tmp_path / name).mkdir()
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "path", [*sys.path, str(folder)])
        monkeypatch.setenv("GO2_WBC_TEST_VARIABLE", name)
        found = asked(swept.surroundings, tmp_path)
        assert (found["folder"], found["place"]) == (str(folder), str(folder))
        assert found["variable"] == name


def test_the_robot_is_loaded_before_the_fork_which_no_other_thread_disturbs(tmp_path: Path) -> None:
    found = asked(swept.surroundings, tmp_path)
    assert (found["robot"], found["threads"]) == (True, 1)


def test_numbers_that_nobody_seeds_are_others_in_every_worker(tmp_path: Path) -> None:
    first, other = (asked(swept.surroundings, tmp_path) for _ in range(2))
    assert first["number"] != other["number"]


def test_a_worker_that_lets_no_other_thread_run_is_ended_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pid")
    monkeypatch.setenv("GO2_WBC_TEST_FILE", str(tmp_path / "pid"))
    worker = Worker(order_of(swept.stuck))
    worker.give(pickle.dumps(0))
    process = Path("/proc", (tmp_path / "pid").read_text())
    assert process.exists()
    ending = threading.Thread(target=worker.end, daemon=True)
    ending.start()
    ending.join(HANG_GUARD)
    assert not process.exists()


def test_the_module_that_sweeps_is_not_run_again_in_its_workers(tmp_path: Path) -> None:
    """A script without ``if __name__ == "__main__"`` would sweep in each of its workers."""
    script = tmp_path / "mine.py"
    script.write_text(
        "from controller import sweep\n"
        f"rows = sweep('{swept.__file__}:trial', 2, workers=1, out='rows.sqlite').rows\n"
        "print(len(rows), 'rows')\n"
    )
    done = python(script.name, folder=tmp_path)
    assert (done.stdout, done.stderr) == ("2 rows\n", "")


def test_a_fork_server_with_another_order_of_sets_is_told(tmp_path: Path) -> None:
    code = (
        "import multiprocessing, time\n"
        "multiprocessing.get_context('forkserver').Process(target=time.sleep, args=(0,)).start()\n"
        "from controller import sweep\n"
        f"sweep('{swept.__file__}:trial', 1, workers=1, out='rows.sqlite')"
    )
    done = python("-c", code, folder=tmp_path, PYTHONHASHSEED="random")
    assert done.returncode == 1
    assert "sets in random order: sweep first" in done.stderr


def test_where_nothing_forks_every_worker_is_started_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forked = sweep(swept.trial, 3, workers=2, out=tmp_path / "a.sqlite").rows
    monkeypatch.setattr(sys, "platform", "darwin")
    assert sweep(swept.trial, 3, workers=2, out=tmp_path / "b.sqlite").rows == forked
    assert asked(swept.process, tmp_path)["parent"] == os.getpid()


def test_ctrl_c_waits_until_a_process_has_started_whichever_thread_takes_the_signal() -> None:
    is_over, reached = threading.Event(), list[str]()
    other = threading.Thread(target=is_over.wait)
    other.start()

    def begin() -> None:
        signal.pthread_kill(cast("int", other.ident), signal.SIGINT)
        time.sleep(0.1)
        reached.append("the end")

    process = Mock(spec=BaseProcess, start=begin)
    try:
        with pytest.raises(KeyboardInterrupt):
            start(process)
    finally:
        is_over.set()
        other.join()
    assert reached == ["the end"]
