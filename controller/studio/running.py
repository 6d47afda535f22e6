"""Has an author's file run in a process of its own, where its motion is checked and played.

A file that never ends is ended there, and what it breaks is not the studio. The text need not be
saved: while a bar is dragged, the text as it would be runs.
"""

from __future__ import annotations

import os
import threading
import time
import weakref
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.process import BaseProcess
from typing import cast, final

from controller.studio.orders import Answer, Doing, Order
from controller.studio.working import serve
from controller.sweeps.engine import ONE_THREAD, processes, start
from go2_wbc.errors import StudioError

LONGEST_WAIT = 10.0
"""Time [s] after which a file is ended that waits, or goes on when its own time is over."""
PRELOADED = ("controller.studio.jumping", "controller.studio.making", "viz.replay.page_data")
"""Modules that its processes need, loaded once for all of them."""
LONGEST_WORK = 120.0  #: Time [s] that solving, checking or playing may take


@final
class Runner:
    """Has texts run, one after the other.

    Attributes:
        tell: hears how far an order is, and ``None`` when it has ended.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.tell: Callable[[Doing | None], None] = lambda _: None
        self._is_over = False
        self._start()

    def _start(self) -> None:
        context = processes()
        self._pipe, there = context.Pipe()
        self._stop = context.Event()
        environment = {**os.environ, **ONE_THREAD}  # more threads would wait for each other, busily
        arguments = (there, self._stop, environment)
        self._process = context.Process(target=serve, args=arguments, daemon=True)
        # Also if this is interrupted: one that still loads would miss its pipe, with a traceback.
        self._killer = weakref.finalize(self, _kill, self._process)
        start(self._process, *PRELOADED)
        there.close()
        self._is_warm = False

    def warm(self) -> None:
        """Load all that playing takes, meanwhile; the first order waits for it."""
        with self._lock, suppress(OSError):  # of a process that has ended the next order tells
            if not self._is_warm:
                self._pipe.send(None)

    def run(self, order: Order) -> Answer:
        """What came of the order.

        Raises:
            StudioError: if the text is no motion, says the line; if it takes too long, or ends the
                process: the next one runs in another.
        """
        with self._lock:
            if self._is_over:
                raise StudioError("the studio has ended")
            self._stop.clear()
            try:
                self._pipe.send(order)
                if not self._is_warm:  # importing the robot takes its time
                    self.tell(Doing("loading"))
                    self._received(LONGEST_WORK, "could not be loaded")
                    self._is_warm = True
                self._received(LONGEST_WAIT, f"ran for longer than {LONGEST_WAIT:g} s")
                answer = self._received(LONGEST_WORK, f"was at it for {LONGEST_WORK:g} s")
            except (EOFError, OSError) as error:
                self._restart()
                name = order.path.name
                raise StudioError(f"{name} has ended the process that runs it") from error
            finally:
                self.tell(None)
        if isinstance(answer, StudioError):
            raise answer
        return cast("Answer", answer)

    def stop(self) -> None:
        """Have what is solved or played end: ``run`` then raises StudioError."""
        self._stop.set()

    def _received(self, patience: float, otherwise: str) -> object:
        latest = time.monotonic() + patience
        while self._pipe.poll(max(latest - time.monotonic(), 0.0)):
            if not isinstance(told := self._pipe.recv(), Doing):
                return told
            self.tell(told)
        self._restart()
        raise StudioError(f"the file {otherwise}; it was stopped")

    def _restart(self) -> None:
        self._end()
        if not self._is_over:
            self._start()

    def close(self) -> None:
        """End the process."""
        self._is_over = True
        self._end()

    def _end(self) -> None:
        self._killer()
        self._process.join()
        self._pipe.close()


def _kill(process: BaseProcess) -> None:
    if process.is_alive():
        process.kill()
