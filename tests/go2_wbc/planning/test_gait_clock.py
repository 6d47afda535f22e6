"""A gait becomes another at any moment, and no foot notices but by when it lands."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, ContactPhase, Gait, Stride
from go2_wbc.planning.gait_clock import (
    WIDTH_RATE,
    Cadence,
    Clock,
    GaitForm,
    adapt,
    alignment,
    foot_phase,
    restart,
    resting_gait,
    shifted,
    stride_at,
    time_between,
)
from go2_wbc.planning.ground import RoughConfig

TICK = 0.002
SECONDS = 2.0
JUMP = 0.03  # of a swing's progress in one tick; the fastest swing takes 0.132 s


class GaitClock:
    """A clock and what it is told."""

    def __init__(self, gait: Gait) -> None:
        self.clock = Clock()
        self.change(gait)
        restart(self.clock, self.cadence)

    def change(self, gait: Gait) -> None:
        self.cadence = Cadence.of(gait)

    @property
    def gait(self) -> GaitForm:
        c = self.clock
        return GaitForm(c.period, c.duty, tuple(c.offsets.tolist()), c.width)

    def adapt(self, dt: float, speed: float, *, is_resting: bool, is_thrown: bool) -> None:
        adapt(self.clock, self.cadence, dt, speed, is_resting, is_thrown)

    def now(self) -> ContactPhase:
        phases = [foot_phase(self.clock, leg) for leg in range(4)]
        return ContactPhase(*map(np.array, zip(*phases, strict=True)))


def aligned(offsets: Sequence[float], goal: Sequence[float]) -> tuple[float, ...]:
    shift = alignment(np.array(offsets), np.array(goal))
    return tuple(shifted(phase, shift) for phase in offsets)


@pytest.mark.parametrize("gait", GAITS.values(), ids=lambda gait: gait.name)
def test_a_gait_is_reached_from_the_one_at_rest_and_left_again(gait: Gait) -> None:
    gait = replace(gait, stride=None)
    clock = GaitClock(gait)
    assert clock.gait == GaitForm.of(resting_gait(gait))
    for wanted, is_resting in ((gait, False), (resting_gait(gait), True)):
        run(clock, is_resting=is_resting)
        assert clock.gait == GaitForm.of(wanted)


def test_a_gait_that_starts_at_once_is_not_preceded_by_the_trot() -> None:
    flying = Gait("flying", 0.3, 0.4, (0.0, 0.5, 0.5, 0.0))
    assert GaitClock(flying).gait == GaitForm.of(GAITS["trot"])
    at_once = replace(flying, starts_at_once=True)
    assert GaitClock(at_once).gait == GaitForm.of(at_once)


@pytest.mark.parametrize("gait", GAITS.values(), ids=lambda gait: gait.name)
def test_no_foot_is_put_back_in_its_stride_while_the_gait_changes(gait: Gait) -> None:
    rng = np.random.default_rng(5)
    clock = GaitClock(gait)
    phases = []
    for _ in range(6):
        phases += run(clock, seconds=rng.uniform(0.2, 1.0), is_resting=rng.random() < 0.5)
    for before, after in pairwise(phases):
        swings = ~before.stance & ~after.stance
        steps = (after.progress - before.progress)[swings]
        assert (steps > 0.0).all()
        assert (steps < JUMP).all()
        landed = ~before.stance & after.stance
        assert (before.progress[landed] > 1.0 - JUMP).all()


@pytest.mark.parametrize("there", ["pace", "bound"])
def test_between_walk_and_pairs_neither_is_walked_at_the_pace_of_the_other(there: str) -> None:
    """A pace or bound at half a second a stride tipped over a pair; a fast walk's swings missed."""
    gait, walk = replace(GAITS[there], stride=None), GAITS["walk"]
    clock = GaitClock(gait)
    run(clock, is_resting=False)
    for wanted in (walk, gait):
        clock.change(wanted)
        whole = longest_way(aligned(clock.gait.offsets, wanted.offsets), wanted.offsets)
        for _ in range(int(SECONDS / TICK)):
            run(clock, seconds=TICK, is_resting=False)
            now = clock.gait
            share = (now.period - gait.period) / (walk.period - gait.period)
            assert now.duty == pytest.approx(gait.duty + share * (walk.duty - gait.duty))
            left = share if wanted is gait else 1.0 - share
            way = longest_way(now.offsets, wanted.offsets)
            assert way == pytest.approx(left * whole, abs=1e-9)
        assert clock.gait == GaitForm.of(wanted)


@pytest.mark.parametrize("there", GAITS.values(), ids=lambda gait: gait.name)
@pytest.mark.parametrize("here", GAITS.values(), ids=lambda gait: gait.name)
def test_the_longest_way_of_a_foot_to_another_gait_is_the_shortest_there_is(
    here: Gait, there: Gait
) -> None:
    found = longest_way(aligned(here.offsets, there.offsets), there.offsets)
    others = [
        longest_way([(o + shift) % 1.0 for o in here.offsets], there.offsets)
        for shift in np.linspace(0.0, 1.0, 201)
    ]
    assert found <= min(others) + 1e-9
    back = aligned(aligned(here.offsets, there.offsets), here.offsets)
    assert back == pytest.approx(here.offsets)  # the same gait, named otherwise


def test_a_walk_becomes_a_flying_trot_without_a_pace() -> None:
    """Its front feet went half a stride, and with both feet of a side together it fell."""
    clock = GaitClock(GAITS["walk"])
    run(clock, is_resting=False)
    clock.change(GAITS["flying_trot"])
    for _ in range(int(SECONDS / TICK)):
        run(clock, seconds=TICK, is_resting=False)
        fl, fr, rl, rr = clock.gait.offsets
        for diagonal in (fl - rr, fr - rl):
            assert abs((diagonal + 0.5) % 1.0 - 0.5) < 0.251
        for side in (fl - rl, fr - rr):
            assert abs((side + 0.5) % 1.0 - 0.5) > 0.249


def test_no_foot_notices_that_its_phase_is_named_otherwise() -> None:
    clock = GaitClock(GAITS["walk"])
    run(clock, is_resting=False)
    rng = np.random.default_rng(3)
    for wanted in (*GAITS.values(), *GAITS.values()):
        clock.clock.time += rng.uniform(0.0, 1.0)
        before = clock.now()
        clock.change(wanted)
        clock.adapt(1e-9, 1.0, is_resting=False, is_thrown=False)
        after = clock.now()
        np.testing.assert_array_equal(after.stance, before.stance)
        np.testing.assert_allclose(after.elapsed, before.elapsed, atol=1e-7)
        run(clock, seconds=rng.uniform(0.2, 1.0), is_resting=False)


def test_the_feet_come_together_and_apart_without_a_jump() -> None:
    clock = GaitClock(GAITS["pace"])
    widths = [clock.gait.width]
    for is_resting in (False, True):
        for _ in range(int(SECONDS / TICK)):
            run(clock, seconds=TICK, is_resting=is_resting)
            widths.append(clock.gait.width)
        assert clock.gait.width == (1.0 if is_resting else GAITS["pace"].width)
    assert np.abs(np.diff(widths)).max() == pytest.approx(WIDTH_RATE * TICK)


def test_a_robot_that_is_thrown_lifts_its_feet_sooner_at_once() -> None:
    """At the usual rate it fell over feet that stood on."""
    usual, thrown = (GaitClock(GAITS["trot"]) for _ in range(2))
    run(usual, seconds=0.06, is_resting=False)
    run(thrown, seconds=0.06, is_resting=False, is_thrown=True)
    assert usual.gait.duty > 0.46
    assert thrown.gait.duty < 0.42


def longest_way(offsets: Sequence[float], goal: Sequence[float]) -> float:
    """Greatest share of a stride by which a foot's phase is off."""
    return max(abs((b - a + 0.5) % 1.0 - 0.5) for a, b in zip(offsets, goal, strict=True))


def run(
    clock: GaitClock, seconds: float = SECONDS, *, is_resting: bool, is_thrown: bool = False
) -> list:
    phases = []
    for _ in range(int(seconds / TICK)):
        clock.clock.time += TICK
        clock.adapt(TICK, 2.0, is_resting=is_resting, is_thrown=is_thrown)
        phases.append(clock.now())
    return phases


@pytest.mark.parametrize(
    "gait",
    [
        GAITS["trot"],
        Gait("odd", period=0.37, duty=0.61, offsets=(0.13, 0.58, 0.0, 0.83)),
        Gait("walk", 0.5, 0.75, (0.0, 0.5, 0.75, 0.25)),
        Gait("all", 0.4, 1.0, (0.0, 0.0, 0.0, 0.0)),
    ],
    ids=lambda gait: gait.name,
)
def test_the_gait_is_that_of_the_contact_schedule(gait: Gait) -> None:
    schedule, clock = gait.schedule(), Clock(period=gait.period, duty=gait.duty)
    clock.offsets[:] = gait.offsets
    events = [event + shift for event in schedule.times for shift in (-2e-9, 0.0, 1e-10)]
    for t in (*np.arange(0.0, 3 * gait.period, 0.0007), *events, *np.add(events, gait.period)):
        time = max(float(t), 0.0)
        clock.time, phase = time, schedule.at(time)
        for leg in range(4):
            stance, elapsed, remaining = foot_phase(clock, leg)
            assert stance == phase.stance[leg], (t, leg)
            assert elapsed == pytest.approx(phase.elapsed[leg], abs=2e-9)
            assert remaining == pytest.approx(phase.remaining[leg], abs=2e-9)


@pytest.mark.parametrize("there", GAITS.values(), ids=lambda gait: gait.name)
@pytest.mark.parametrize("here", GAITS.values(), ids=lambda gait: gait.name)
def test_the_time_between_two_gaits_is_that_in_which_one_becomes_the_other(
    here: Gait, there: Gait
) -> None:
    here, there = replace(here, stride=None), replace(there, stride=None)
    clock, ticks = GaitClock(here), 0
    run(clock, is_resting=False)
    clock.change(there)
    while clock.gait != GaitForm.of(there):
        run(clock, seconds=1.01 * TICK, is_resting=False)
        ticks += 1
    assert ticks * TICK <= time_between(here, there) + 1.5 * TICK


def test_a_stride_gets_shorter_with_the_speed_until_the_foot_cannot() -> None:
    assert stride_at(Stride(), 0.0) == pytest.approx((0.39, 20 / 39))
    assert stride_at(Stride(), 2.0) == pytest.approx((0.31, 10 / 31))
    assert stride_at(Stride(), 4.0) == pytest.approx((0.31, 8 / 31))


@pytest.mark.parametrize("name", ["trot", "bound"])
def test_on_rough_ground_feet_swing_for_longer_and_do_not_stand_for_longer(name: str) -> None:
    rough, c = RoughConfig(), Cadence.of(GAITS[name])
    assert c.rough_stride.swing == pytest.approx(c.stride.swing + rough.swing)
    assert c.rough_stride.stance_max == min(c.stride.stance_max, rough.stance)
