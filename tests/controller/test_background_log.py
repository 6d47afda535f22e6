"""Who logs in the background never waits for a log handler."""

from __future__ import annotations

import threading

from controller.background_log import BackgroundLog
from tests.controller.plants import HANG_GUARD, in_thread


def test_lines_are_written_in_order_until_it_is_closed() -> None:
    written: list[str] = []
    log = BackgroundLog(lambda message, *args: written.append(message % args))
    for number in range(50):
        log.warning("line %d", number)
    log.close()
    assert written == [f"line {number}" for number in range(50)]


def test_neither_a_line_nor_the_end_waits_for_a_handler_that_is_taken() -> None:
    handler, written = threading.Lock(), threading.Event()

    def warn(_message: str) -> None:
        with handler:
            written.set()

    log = BackgroundLog(warn)
    with handler:
        in_thread(lambda: log.warning("fell")).result(HANG_GUARD)
        in_thread(log.close).result(HANG_GUARD)
        assert not written.is_set()
    assert written.wait(HANG_GUARD)
