"""A fork server: a process that loads what workers need, once, and forks for each of them.

It has one thread, so that a fork is safe. It ends when its parent has and its workers have ended,
or when nothing has come for a while. A worker whose channel its parent closes, it kills.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import selectors
import signal
import socket
import struct
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import final

from controller.sweeps import worker

PATIENCE = 600.0
"""Time [s] without a worker or a request after which a server ends: it may hold 200 MB."""
LENGTH = struct.Struct("<Q")
"""What comes before the pickle of a request: its length, and with it the files of a worker."""
FILES = 5
"""The files of a worker: its input, output and errors, its folder, and its channel."""
_KERNELS = "go2_wbc.compilation"


@dataclass(frozen=True, slots=True)
class Request:
    """What a worker is started with.

    Attributes:
        modules: what it will use, as far as is known: loaded before the fork.
        path: where it looks for modules.
        environment: its variables.
        processors: those on which it may run.
    """

    modules: tuple[str, ...]
    path: tuple[str, ...]
    environment: dict[str, str]
    processors: frozenset[int]


def serve(control: int) -> None:
    """Fork for every request on the socket that has this file descriptor."""
    gc.disable()  # nothing that is loaded can go
    server = _Server(socket.socket(fileno=control))
    while server.is_needed:
        if server.is_now_a_worker():
            gc.enable()
            worker.main()
    os._exit(0)


@final
class _Server:
    """The workers that run, and what may happen next: a request, or the end of one of them."""

    def __init__(self, control: socket.socket) -> None:
        self._control = control
        self._ends, self._alarm = socket.socketpair()
        self._channels: dict[int, socket.socket] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(control, selectors.EVENT_READ)
        self._selector.register(self._ends, selectors.EVENT_READ)
        self._is_called = True
        for side in (self._ends, self._alarm):
            side.setblocking(False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(self._alarm.fileno(), warn_on_full_buffer=False)

    @property
    def is_needed(self) -> bool:
        """Whether there may be requests, or there are workers."""
        return self._is_called or bool(self._channels)

    def is_now_a_worker(self) -> bool:
        """Do what is next; whether this process is a fork now, and is to do a worker's work."""
        ready = self._selector.select(None if self._channels else PATIENCE)
        if not ready:
            self._is_called = False
        for key, _ in ready:
            if key.fileobj is self._ends:
                self._reap()
            elif key.fileobj is not self._control:  # a channel: its worker is to end
                self._selector.unregister(key.fileobj)
                if key.data in self._channels:
                    os.kill(key.data, signal.SIGKILL)
            elif self._has_forked():
                return True
        return False

    def _has_forked(self) -> bool:
        """Do what a request asks for; true in the fork."""
        received = _received(self._control)
        if received is None:
            self._selector.unregister(self._control)
            self._is_called = False
            return False
        request, files = received
        sys.path[:] = request.path
        _load(request.modules)
        channel = socket.socket(fileno=files.pop())
        try:
            pid = os.fork()
        except OSError as error:
            _tell(channel, f"it cannot be started: {error}")
        else:
            if not pid:
                self._leave(channel)
                _become(request, files)
                return True
            self._channels[pid] = channel
            self._selector.register(channel, selectors.EVENT_READ, pid)
        _close(files)
        return False

    def _reap(self) -> None:
        """Tell the parent how workers have ended."""
        with suppress(BlockingIOError):
            self._ends.recv(4096)
        while self._channels:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if not pid:
                return
            channel = self._channels.pop(pid)
            with suppress(KeyError):  # its parent wanted no more of it
                self._selector.unregister(channel)
            _tell(channel, worker.cause_of(os.waitstatus_to_exitcode(status)))

    def _leave(self, channel: socket.socket) -> None:
        """Close in a fork what is the server's."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self._selector.close()
        for own in (self._control, self._ends, self._alarm, channel, *self._channels.values()):
            own.close()


def _received(control: socket.socket) -> tuple[Request, list[int]] | None:
    """The next request and its files; None if the parent has ended."""
    head, files, _, _ = socket.recv_fds(control, LENGTH.size, FILES, socket.MSG_CMSG_CLOEXEC)
    if len(head) == LENGTH.size and len(files) == FILES:
        (length,) = LENGTH.unpack(head)
        content = control.recv(length, socket.MSG_WAITALL)
        if len(content) == length:
            return pickle.loads(content), files
    _close(files)
    return None


def _load(modules: Sequence[str]) -> None:
    """Load modules and, if there are robots among them, kernels; a worker tells what is wrong."""
    new = [name for name in modules if name not in sys.modules]
    for name in new:
        with suppress(Exception):
            importlib.import_module(name)
    if new and _KERNELS in sys.modules:
        with suppress(Exception):
            sys.modules[_KERNELS].load_kernels()
    gc.freeze()  # so that a worker's collector passes over it


def _become(request: Request, files: Sequence[int]) -> None:
    """Make a fork what a new process would be."""
    *streams, folder = files
    for target, source in enumerate(streams):
        os.dup2(source, target)
    os.fchdir(folder)
    _close(files)
    os.setpgid(0, 0)  # out of reach of Ctrl-C
    os.sched_setaffinity(0, request.processors)
    os.environ.clear()
    os.environ.update(request.environment)
    importlib.invalidate_caches()
    if (random := sys.modules.get("numpy.random")) is not None:
        random.seed()  # Python's own numbers are seeded anew by a fork


def _tell(channel: socket.socket, text: str) -> None:
    """Say how a worker has ended, if its parent still listens."""
    with suppress(OSError), channel:
        channel.sendall(text.encode())


def _close(files: Iterable[int]) -> None:
    for file in files:
        os.close(file)
