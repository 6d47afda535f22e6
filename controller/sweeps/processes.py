"""Processes of workers: forked by a server that has loaded what they need, or started anew.

A server takes the time of one start, its workers next to none: later sweeps of a process are under
way at once. Where a fork is not safe (macOS) or unknown (Windows), every worker is started anew.
"""

from __future__ import annotations

import os
import pickle
import socket
import subprocess
import sys
import threading
import weakref
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from typing import IO, final

from controller.sweeps.engine import ONE_THREAD
from controller.sweeps.fork_server import LENGTH, Request
from controller.sweeps.worker import cause_of

_PATH = "import sys; sys.path[:] = {}; "
"""A worker finds the same modules as its parent."""
_WORKER = _PATH + "from controller.sweeps.worker import main; main()"
_SERVER = _PATH + "from controller.sweeps.fork_server import serve; serve({})"
_ERRORS = 2
"""The file to which workers tell what goes wrong: this process's standard error."""
_OF_A_TEST = "PYTEST_CURRENT_TEST"
"""A variable that pytest sets anew for every test, and that nothing reads when it is loaded."""


class WorkerProcess(ABC):
    """A process that does a worker's work.

    Attributes:
        stdin: takes the order and items.
        stdout: gives the answers.
    """

    def __init__(self, stdin: IO[bytes], stdout: IO[bytes]) -> None:
        """A process with these streams."""
        self.stdin, self.stdout = stdin, stdout

    @abstractmethod
    def kill(self) -> None:
        """End it at once."""

    @abstractmethod
    def wait(self) -> str:
        """Until it has ended: how that came."""

    def close(self) -> str:
        """Close the streams, and wait."""
        for stream in (self.stdin, self.stdout):
            with suppress(OSError):  # what was written did not get there
                stream.close()
        return self.wait()


def start_process(modules: Sequence[str]) -> WorkerProcess:
    """A process that runs ``worker.main``, in the folder and environment of this one.

    Args:
        modules: which it will use, as far as is known: those of a server are loaded once.
    """
    return _Forked(modules) if sys.platform == "linux" else _Started()


def _environment() -> dict[str, str]:
    return {**os.environ, **ONE_THREAD}


@final
class _Started(WorkerProcess):
    """A Python that is started anew."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _WORKER.format(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
            process_group=0,  # out of reach of Ctrl-C
        )
        super().__init__(_pipe(self._process.stdin), _pipe(self._process.stdout))

    def kill(self) -> None:
        self._process.kill()

    def wait(self) -> str:
        return cause_of(self._process.wait())


def _pipe(stream: IO[bytes] | None) -> IO[bytes]:
    if stream is None:
        raise ValueError("a worker was started without pipes")
    return stream


@final
class _Forked(WorkerProcess):
    """A fork of the server, which tells how it ends, and kills it if the channel is closed."""

    def __init__(self, modules: Sequence[str]) -> None:
        source, stdin = os.pipe()
        stdout, sink = os.pipe()
        super().__init__(os.fdopen(stdin, "wb"), os.fdopen(stdout, "rb"))
        self._channel, channel = socket.socketpair()
        folder = os.open(".", os.O_PATH)
        with ExitStack() as theirs:
            theirs.enter_context(channel)
            for file in (source, sink, folder):
                theirs.callback(os.close, file)
            _ask(modules, [source, sink, _ERRORS, folder, channel.fileno()])

    def kill(self) -> None:
        with suppress(OSError):  # it has ended
            self._channel.shutdown(socket.SHUT_WR)
            self.stdin.close()  # if there is no server any more

    def wait(self) -> str:
        with self._channel, self._channel.makefile("rb") as told:
            return told.read().decode() or "the process that had started it has ended"


def _ask(modules: Sequence[str], files: Sequence[int]) -> None:
    """Have the server fork; one is started if there is none of use."""
    path, environment = tuple(sys.path), _environment()
    processors = frozenset(os.sched_getaffinity(0))
    request = pickle.dumps(Request(tuple(modules), path, environment, processors))
    with _turn:
        if _servers and not _servers[0].is_of_use():
            _servers.pop().leave()
        try:
            _server().send(request, files)
        except (
            BrokenPipeError,
            ConnectionResetError,
        ):  # it has ended meanwhile, for nothing came for long
            _servers.pop().leave()
            _server().send(request, files)


@final
class _Server:
    """The process that forks, and what it had from this one when it was started."""

    def __init__(self) -> None:
        self._inherited, self._path = _inherited(), list(sys.path)
        self._control, control = socket.socketpair()
        with control:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVER.format(self._path, control.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=_ERRORS,
                env=_environment(),
                pass_fds=[control.fileno()],
                process_group=0,  # out of reach of Ctrl-C
            )
        self._end = weakref.finalize(self, _end, os.getpid(), self._control, self._process)

    def is_of_use(self) -> bool:
        """Whether what it has loaded is what a new process would load.

        Places that were added to the end of the path hide no module that is loaded.
        """
        return self._inherited == _inherited() and self._path == sys.path[: len(self._path)]

    def send(self, request: bytes, files: Sequence[int]) -> None:
        """Have it fork."""
        socket.send_fds(self._control, [LENGTH.pack(len(request))], files)
        self._control.sendall(request)

    def leave(self) -> None:
        """Ask for no more: it ends after its workers."""
        self._end.detach()
        self._control.close()
        threading.Thread(target=self._process.wait, name="fork server", daemon=True).start()


def _end(parent: int, control: socket.socket, process: subprocess.Popen[bytes]) -> None:
    """End a server at once; its workers end with its parent, of which this may be a fork."""
    control.close()
    if os.getpid() == parent:
        process.kill()
        process.wait()


def _inherited() -> tuple[object, ...]:
    """What a server has from its parent and its workers do not get anew."""
    environment = {name: value for name, value in os.environ.items() if name != _OF_A_TEST}
    return os.getpid(), environment, sys.executable, os.getpriority(os.PRIO_PROCESS, 0)


_servers: list[_Server] = []
"""The server of this process, if there is one."""
_turn = threading.Lock()


def _server() -> _Server:
    if not _servers:
        _servers.append(_Server())
    return _servers[0]
