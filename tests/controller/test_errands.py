"""What threads ask of a loop is done between its ticks, and none waits for a log handler."""

import threading
from collections.abc import Callable, Iterator
from itertools import count

import pytest

from controller.pacing import NOT_YET, BackgroundLog, Errands, LoopEnded, LoopHangs, Pending
from tests.controller.plants import HANG_GUARD, in_thread


@pytest.fixture
def errands() -> Errands:
    return Errands()


@pytest.fixture
def serving(errands: Errands) -> Iterator[threading.Thread]:
    """A thread that serves all the time."""
    is_over = threading.Event()

    def serve() -> None:
        while not is_over.wait(1e-4):
            errands.serve()
        errands.end()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield thread
    is_over.set()
    thread.join(HANG_GUARD)


def counting(end: int) -> Callable[[], int | Pending]:
    """An errand that answers when it is done for the ``end``-th time, and keeps counting."""
    counter = count(1)

    def work() -> int | Pending:
        number = next(counter)
        return NOT_YET if number < end else number

    return work


def test_the_thread_that_serves_does_the_work_once_a_round_until_it_answers(
    errands: Errands, serving: threading.Thread
) -> None:
    assert errands.ask(threading.current_thread, HANG_GUARD) is serving
    assert errands.ask(lambda: None, HANG_GUARD) is None
    work = counting(5)
    assert errands.ask(work, HANG_GUARD) == 5
    assert errands.ask(lambda: None, HANG_GUARD) is None
    assert work() == 6
    asked = [in_thread(lambda end=end: errands.ask(counting(end), HANG_GUARD)) for end in (9, 3, 6)]
    assert [answer.result(HANG_GUARD) for answer in asked] == [9, 3, 6]


@pytest.mark.parametrize("error", [ValueError("a bug"), SystemExit(3)])
def test_an_error_is_raised_where_the_errand_was_asked_for_and_the_thread_goes_on(
    errands: Errands, serving: threading.Thread, error: BaseException
) -> None:
    def fail() -> None:
        raise error

    with pytest.raises(type(error)) as caught:
        errands.ask(fail, HANG_GUARD)
    assert caught.value is error
    assert errands.ask(lambda: 1, HANG_GUARD) == 1


def test_who_is_not_served_is_told_and_what_was_asked_is_not_done_later(errands: Errands) -> None:
    done: list[int] = []
    with pytest.raises(LoopHangs):
        errands.ask(lambda: done.append(1), 0.1)
    errands.serve()
    assert not done


def test_an_errand_that_takes_long_is_no_loop_that_hangs(
    errands: Errands, serving: threading.Thread
) -> None:
    began = threading.Event()
    answer = in_thread(lambda: errands.ask(lambda: True if began.is_set() else NOT_YET, 0.1))
    assert not began.wait(0.5)
    began.set()
    assert answer.result(HANG_GUARD) is True


def test_what_was_asked_before_the_end_is_done_and_later_or_unserved_not(errands: Errands) -> None:
    answer = in_thread(lambda: errands.ask(lambda: 1, HANG_GUARD))
    while errands._asked.empty():
        pass
    errands.end()
    assert answer.result(HANG_GUARD) == 1
    done: list[int] = []
    errands.end()
    with pytest.raises(LoopEnded):
        errands.ask(lambda: done.append(1), HANG_GUARD)
    assert not done


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
