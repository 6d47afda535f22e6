"""Workers are forked from one process, and are as if each had been started anew."""

from __future__ import annotations

import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from controller import sweep
from controller.sweeps.processes import start_process
from controller.sweeps.rows import Row
from controller.sweeps.targets import job_of, target_of
from controller.sweeps.worker import modules_of, order_of, read_message, write_message
from tests.controller.sweeps import swept

HANG_GUARD = 120.0
"""Seconds after which a process that should have ended fails its test."""
ROBOT = ("controller.sweeps.studies",)


@pytest.fixture(autouse=True)
def _own_server(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server for each test, for no two have the same environment."""
    monkeypatch.setenv("GO2_WBC_TEST_VARIABLE", request.node.name)


def asked(function: Callable[[int], object], modules: tuple[str, ...] = ()) -> dict:
    """What a worker gives for seed 0 that was told of these modules."""
    worker = start_process(modules)
    for message in (order_of(function), pickle.dumps(0)):
        write_message(worker.stdin, message)
    content = read_message(worker.stdout)
    worker.kill()
    worker.close()
    assert content is not None
    value, failure = pickle.loads(content)
    assert failure is None
    return value


def row_of_sweep(function: Callable[[int], object], out: Path, **arguments: object) -> Row:
    (row,) = sweep(function, 1, workers=1, out=out, fresh=True, **arguments).rows  # type: ignore[arg-type]
    return row


def test_later_workers_come_from_the_same_process_in_a_process_of_their_own() -> None:
    first, later = asked(swept.process), asked(swept.process)
    assert first["parent"] == later["parent"] != os.getpid()
    assert first["pid"] != later["pid"]


def test_a_worker_has_the_surroundings_of_the_moment_it_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        (folder := tmp_path / name).mkdir()
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "path", [*sys.path, str(folder)])
        found = asked(swept.surroundings)
        assert (found["folder"], found["place"]) == (str(folder), str(folder))
    monkeypatch.setenv("GO2_WBC_TEST_VARIABLE", "another")
    assert asked(swept.surroundings)["variable"] == "another"


def test_a_place_at_the_end_of_the_path_needs_no_other_process_one_at_its_head_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = asked(swept.process)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    assert asked(swept.process)["parent"] == first["parent"]
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert asked(swept.process)["parent"] != first["parent"]


def test_only_what_a_function_needs_is_loaded_and_that_before_the_fork() -> None:
    light = asked(swept.surroundings)
    assert (light["robot"], light["kernels"]) == (False, False)
    heavy = asked(swept.surroundings, ROBOT)
    assert (heavy["robot"], heavy["kernels"]) == (True, True)
    assert heavy["threads"] == 1  # no other thread may hold a lock when it forks


def test_numbers_that_nobody_seeds_are_others_in_every_worker() -> None:
    first, other = (asked(swept.surroundings, ROBOT) for _ in range(2))
    assert first["number"] != other["number"]


def test_modules_are_those_of_this_project_that_a_function_names() -> None:
    assert ROBOT[0] in modules_of(pickle.dumps(job_of(target_of("gait:trot"))))
    light = modules_of(pickle.dumps(job_of(target_of(swept.trial))), pickle.dumps(swept.trial))
    assert light == ("controller.sweeps.targets",)


def test_a_module_that_cannot_be_loaded_is_left_to_the_function() -> None:
    assert asked(swept.trial, ("controller.no_such_module",))["n"] == 0


def test_the_process_that_forks_may_die(tmp_path: Path) -> None:
    first = row_of_sweep(swept.process, tmp_path / "rows.sqlite")
    os.kill(int(first["parent"]), signal.SIGKILL)
    again = row_of_sweep(swept.process, tmp_path / "rows.sqlite")
    assert again["parent"] != first["parent"]


@pytest.mark.parametrize("is_left", [False, True])
def test_the_process_that_forks_ends_with_nothing_to_do_or_without_its_parent(
    *, is_left: bool
) -> None:
    mine, control = socket.socketpair()
    patience = 600.0 if is_left else 0.01
    code = (
        "from controller.sweeps import fork_server; "
        f"fork_server.PATIENCE = {patience}; fork_server.serve({control.fileno()})"
    )
    with mine, control:
        server = subprocess.Popen([sys.executable, "-c", code], pass_fds=[control.fileno()])
        control.close()
        if is_left:
            mine.close()
        assert server.wait(HANG_GUARD) == 0


def test_a_worker_ends_if_the_process_that_has_forked_it_is_dead() -> None:
    worker = start_process(())
    for message in (order_of(swept.process), pickle.dumps(0)):
        write_message(worker.stdin, message)
    content = read_message(worker.stdout)
    assert content is not None
    os.kill(pickle.loads(content)[0]["parent"], signal.SIGKILL)
    worker.kill()
    assert worker.stdout.read() == b""  # until it has ended
    assert "has ended" in worker.close()


def test_a_worker_that_lets_no_other_thread_run_is_ended_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pid")
    monkeypatch.setenv("GO2_WBC_TEST_FILE", str(tmp_path / "pid"))
    worker = start_process(())
    for message in (order_of(swept.stuck), pickle.dumps(0)):
        write_message(worker.stdin, message)
    process = Path("/proc", (tmp_path / "pid").read_text())
    assert process.exists()
    worker.kill()
    closing = threading.Thread(target=worker.close, daemon=True)
    closing.start()
    closing.join(HANG_GUARD)
    assert not process.exists()


def test_where_nothing_forks_every_worker_is_started_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forked = sweep(swept.trial, 3, workers=2, out=tmp_path / "a.sqlite").rows
    monkeypatch.setattr(sys, "platform", "darwin")
    assert sweep(swept.trial, 3, workers=2, out=tmp_path / "b.sqlite").rows == forked
    assert row_of_sweep(swept.process, tmp_path / "c.sqlite")["parent"] == os.getpid()
