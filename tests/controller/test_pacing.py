"""The wall clock, played by the tests: a pace that is kept or given up, warnings that are few."""

import logging

import pytest

from controller import pacing
from controller.pacing import LogThrottle, Pacer


class Clock:
    """Passes only in sleeps, each of which takes ``overrun`` [s] longer than asked."""

    def __init__(self) -> None:
        self.now, self.overrun = 100.0, 0.0
        self.naps: list[float] = []

    def sleep(self, seconds: float) -> None:
        self.naps.append(seconds)
        self.now += seconds + self.overrun

    def taken(self) -> list[float]:
        naps, self.naps = self.naps, []
        return naps


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(pacing.time, "monotonic", lambda: clock.now)
    monkeypatch.setattr(pacing.time, "sleep", clock.sleep)
    return clock


def test_a_pace_is_kept_on_the_average_although_sleeps_take_too_long(clock: Clock) -> None:
    pacer, clock.overrun = Pacer(0.004, late=0.25), 0.0005
    for _ in range(10):
        pacer.wait()
    assert clock.now == pytest.approx(100.04, abs=0.001)
    assert len(clock.naps) == 10


def test_a_tick_that_is_done_after_its_period_has_missed_its_deadline(clock: Clock) -> None:
    pacer = Pacer(0.002, late=0.1)
    for work in (0.001, 0.003, 0.0015, 0.0):  # the third makes up for half a millisecond only
        clock.now += work
        pacer.wait()
    assert pacer.missed == 2
    assert clock.now == pytest.approx(100.008)


def test_meanwhile_others_have_their_turn_between_short_sleeps(clock: Clock) -> None:
    pacer, turns = Pacer(0.004, late=0.25), []
    for _ in range(10):
        pacer.wait(lambda: turns.append(clock.now))
    assert clock.now == pytest.approx(100.04)
    assert max(clock.naps) <= pacing.NAP
    assert len(turns) >= 20


def test_a_short_lag_is_made_up_for_and_a_long_one_is_given_up(clock: Clock) -> None:
    pacer = Pacer(0.004, late=0.25)
    clock.now += 0.1
    assert pacer.wait() == 0.0
    assert (clock.taken(), pacer.give_ups) == ([], 0)
    clock.now += 10.0
    assert pacer.wait() == pytest.approx(10.1 - 2 * 0.004)
    assert (clock.taken(), pacer.give_ups) == ([], 1)
    pacer.wait()
    assert clock.taken() == [pytest.approx(0.004)]


def test_without_patience_periods_never_come_closer_together(clock: Clock) -> None:
    pacer = Pacer(0.002, late=0.0)
    clock.now += 0.005
    pacer.wait()
    begin = clock.now
    pacer.wait()
    assert clock.now - begin == pytest.approx(0.002)


def test_a_late_loop_still_leaves_others_a_moment_to_get_the_lock(clock: Clock) -> None:
    pacer = Pacer(0.002, late=0.1, rest=1e-4)
    clock.now += 0.05
    pacer.wait()
    assert clock.taken() == [1e-4]
    clock.now += 10.0
    assert pacer.wait() > 9.0
    assert clock.taken() == [1e-4]


def test_a_warning_of_a_kind_is_written_once_in_a_while_with_how_many_were_left_out(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    throttle = LogThrottle(logging.getLogger("test"), 5.0, lambda: clock.now)
    for number in range(4):
        throttle.warn("clip", f"clipped {number}")
        throttle.warn("mode", f"ignored {number}")
        clock.now += 1.0
    clock.now += 1.0
    throttle.warn("clip", "clipped again")
    assert [record.message for record in caplog.records] == [
        "clipped 0",
        "ignored 0",
        "clipped again (3 more like this)",
    ]
