"""Contact schedules: phases cover the cycle, intervals are half-open, and times add up."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.contacts import GAITS, TIE, ContactSchedule, Gait, Stride, find_gait, standing
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.legs import LEGS

ROUNDING = 1e-9  # [s] times of order 10 s in sums of a few terms
BESIDE = 1e-6  # [s] clearly not the event, and far shorter than any interval here
TICK = 0.002  # [s] control period of the robot
TROT = GAITS["trot"]

GRID = 40  #: Phases on a grid, so that two events either coincide or are far apart
shares = st.integers(1, GRID - 1).map(lambda n: n / GRID)
offsets = st.tuples(*[st.integers(0, GRID - 1).map(lambda n: n / GRID)] * 4)
gaits = st.builds(Gait, st.just("some"), st.floats(0.2, 1.0), shares, offsets)


@given(gaits)
def test_the_events_of_a_gait_cover_its_cycle_and_its_feet_their_duty(gait: Gait) -> None:
    schedule = gait.schedule()
    assert schedule.times[0] == 0.0
    assert all(a < b for a, b in itertools.pairwise(schedule.times))
    assert schedule.times[-1] < gait.period
    assert schedule.period == gait.period
    lengths = np.diff([*schedule.times, gait.period])
    np.testing.assert_allclose(lengths @ schedule.modes, gait.stance_time, atol=ROUNDING)
    assert gait.stance_time + gait.swing_time == pytest.approx(gait.period)
    for leg in LEGS:
        touchdown = gait.offsets[leg] * gait.period
        assert not schedule.at(touchdown + gait.period - BESIDE).stance[leg]
        assert schedule.at(touchdown).stance[leg]
        assert schedule.at(touchdown + gait.stance_time - BESIDE).stance[leg]
        assert not schedule.at(touchdown + gait.stance_time).stance[leg]


@given(gaits, st.floats(0.0, 5.0))
def test_elapsed_and_remaining_span_the_present_interval(gait: Gait, t: float) -> None:
    phase = gait.schedule().at(t)
    span = np.where(phase.stance, gait.stance_time, gait.swing_time)
    np.testing.assert_allclose(phase.elapsed + phase.remaining, span, atol=2 * TIE)
    assert (phase.elapsed >= 0.0).all()
    assert (phase.remaining > 0.0).all()
    np.testing.assert_allclose(phase.progress, phase.elapsed / span, atol=ROUNDING / span.min())
    assert (phase.progress < 1.0).all()


@given(gaits, st.floats(0.0, 3.0))
def test_a_foot_changes_exactly_when_its_remaining_time_is_over(gait: Gait, t: float) -> None:
    schedule = gait.schedule()
    phase = schedule.at(t)
    for leg in LEGS:
        at_change = t + float(phase.remaining[leg])
        assert schedule.at(at_change).stance[leg] != phase.stance[leg]
        assert schedule.at(at_change - BESIDE).stance[leg] == phase.stance[leg] or (
            phase.remaining[leg] < BESIDE
        )


@given(gaits, st.integers(0, 3))
def test_the_new_mode_holds_from_the_event_on_and_the_old_one_until_it(
    gait: Gait, cycle: int
) -> None:
    schedule = gait.schedule()
    for index, time in enumerate(schedule.times):
        event = time + cycle * gait.period
        np.testing.assert_array_equal(schedule.at(event).stance, schedule.modes[index])
        before = schedule.at(event + gait.period - BESIDE).stance
        np.testing.assert_array_equal(before, schedule.modes[index - 1])


@pytest.mark.parametrize("early", [0.0, TIE / 4, TIE / 2])
def test_a_time_that_falls_short_of_an_event_by_rounding_counts_as_the_event(early: float) -> None:
    schedule = GAITS["trot"].schedule()
    for event in (0.18, 0.36, 0.54, 3.6):
        phase, exact = schedule.at(event - early), schedule.at(event)
        np.testing.assert_array_equal(phase.stance, exact.stance)
        np.testing.assert_allclose(phase.elapsed, 0.0, atol=TIE)
        np.testing.assert_allclose(phase.remaining, 0.18, atol=2 * TIE)


def test_an_event_is_met_by_a_time_that_falls_short_by_rounding_only() -> None:
    schedule = GAITS["trot"].schedule()
    for event in (0.18, 0.36, 3.6):
        old = schedule.at(event - 3 * TIE).stance
        np.testing.assert_array_equal(old, ~schedule.at(event).stance)
    gait = GAITS["trot"]
    schedule, ticks = gait.schedule(), round(gait.period / 2 / TICK)
    time = 0.0
    for tick in range(round(60.0 / TICK)):
        half_cycles = tick // ticks
        expected = schedule.modes[half_cycles % 2]
        np.testing.assert_array_equal(schedule.at(time).stance, expected, err_msg=f"{tick=}")
        time += TICK


def test_standing_never_changes_nor_does_a_schedule_by_what_it_hands_out() -> None:
    for t in (-1.0, 0.0, 1e6):
        phase = standing().at(t)
        assert phase.stance.all()
        assert np.isinf(phase.elapsed).all()
        assert np.isinf(phase.remaining).all()
        assert not phase.progress.any()
    schedule = standing()
    schedule.at(0.0).stance[:] = False
    assert schedule.at(0.0).stance.all()
    # Only a gait comes back to its start; a schedule without period does not.
    modes = np.ones((2, 4), dtype=bool)
    modes[1, 1] = False
    phase = ContactSchedule((0.0, 1.0), modes).at(0.25)
    assert np.isinf(phase.elapsed).all()
    assert phase.remaining[1] == 0.75


@pytest.fixture
def lift_of_fr() -> ContactSchedule:
    modes = np.ones((3, 4), dtype=bool)
    modes[1, 1] = False
    return ContactSchedule((0.0, 1.0, 3.0), modes)


def test_without_period_the_first_and_last_mode_are_held_without_end(
    lift_of_fr: ContactSchedule,
) -> None:
    for t, up in ((-5.0, False), (0.0, False), (0.999, False), (1.0, True), (2.999, True)):
        assert lift_of_fr.at(t).stance[1] != up
    for t in (3.0, 100.0):
        assert lift_of_fr.at(t).stance.all()
    assert all(lift_of_fr.at(t).stance[[0, 2, 3]].all() for t in (0.0, 2.0, 4.0))
    before, during, after = (lift_of_fr.at(t) for t in (0.25, 1.5, 4.0))
    assert (before.elapsed[1], before.remaining[1]) == (np.inf, 0.75)
    assert (during.elapsed[1], during.remaining[1]) == (0.5, 1.5)
    assert (after.elapsed[1], after.remaining[1]) == (1.0, np.inf)
    assert during.progress[1] == 0.25
    assert not before.progress.any()
    for phase in (before, during, after):
        assert np.isinf(phase.elapsed[[0, 2, 3]]).all()
        assert np.isinf(phase.remaining[[0, 2, 3]]).all()


@pytest.mark.parametrize(
    ("times", "rows"),
    [((), 0), ((0.0, 0.0), 2), ((1.0, 0.5), 2), ((0.0, 1.0), 3), ((0.0, float("nan")), 2)],
    ids=["none", "equal", "falling", "more modes", "nan"],
)
def test_events_out_of_order_are_refused(times: tuple[float, ...], rows: int) -> None:
    with pytest.raises(CommandError, match="increasing times"):
        ContactSchedule(times, np.ones((rows, 4), dtype=bool))


def test_a_gait_is_found_by_its_name_or_is_itself_and_an_unknown_one_told_the_known() -> None:
    with pytest.raises(CommandError, match=r"unknown gait 'moonwalk'; valid: .*trot"):
        find_gait("moonwalk")
    mine = replace(GAITS["trot"], name="mine")
    assert find_gait("trot") is GAITS["trot"]
    assert find_gait(mine) is mine


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"period": 0.0}, "Gait.period must be positive"),
        ({"apex": 0.0}, "Gait.apex must be positive"),
        ({"duty": 1.2}, "Gait.duty must be above 0 and at most 1"),
        ({"offsets": (0.0, 0.5, 1.0, 0.0)}, "Gait.offsets must be four phases"),
        ({"width": 0.0}, "Gait.width must be above 0 and at most 1"),
        ({"width": 1.1}, "Gait.width must be above 0 and at most 1"),
    ],
)
def test_a_gait_out_of_range_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        replace(GAITS["trot"], **changes)


@pytest.mark.parametrize("gait", GAITS.values(), ids=lambda gait: gait.name)
def test_a_gait_knows_whether_it_lands_on_four_feet_and_whether_it_flies(gait: Gait) -> None:
    times = np.arange(0.0, gait.period, 0.001)
    stance = gait.schedule().at_times(times).stance
    assert gait.has_flight == (~stance).all(axis=1).any()
    assert gait.lands_on_four == (gait.name in ("trot", "pronk"))


def test_whether_a_gait_needs_its_forces_planned_means_nothing_any_more() -> None:
    trot = "trot", 0.36, 0.5, (0.5, 0.0, 0.0, 0.5), Stride(), math.inf
    assert Gait(*trot, True, 0.5) == replace(TROT, envelope_share=0.5)
    with pytest.warns(FutureWarning, match="needs_mpc has no effect any more: the forces of every"):
        assert Gait(*trot, needs_mpc=False) == TROT
    assert replace(replace(TROT, apex=0.05), apex=TROT.apex) == TROT


@pytest.mark.parametrize(
    "changes", [{"stance_min": 0.3}, {"swing_slope": 0.2}, {"reach": 0.0}, {"swing_slope": -0.1}]
)
def test_a_stride_without_a_stance_or_a_swing_is_refused(changes: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="Stride"):
        Stride(**changes)


def test_a_periodic_schedule_that_outlasts_its_period_is_refused() -> None:
    for period in (0.4, 0.5):
        with pytest.raises(CommandError, match="before the period"):
            ContactSchedule((0.0, 0.5), np.ones((2, 4), dtype=bool), period=period)


@given(gaits, st.floats(0.0, 10.0), st.floats(0.01, 0.3))
def test_a_foot_takes_up_its_load_after_touchdown_and_gives_it_up_before_lift_off(
    gait: Gait, t: float, ramp: float
) -> None:
    phase = gait.schedule().at(t)
    share = phase.load_share(ramp)
    assert (share[~phase.stance] == 0.0).all()
    assert ((share >= 0.0) & (share <= 1.0)).all()
    np.testing.assert_allclose(
        share[phase.stance],
        np.clip(np.minimum(phase.elapsed, phase.remaining) / ramp, 0, 1)[phase.stance],
    )


def test_a_narrow_gait_places_its_feet_nearer_to_the_middle_and_no_farther_back() -> None:
    feet = np.array([[x, y, -0.3] for x in (0.2, -0.2) for y in (0.14, -0.14)])
    narrow = replace(GAITS["trot"], width=0.5).placed(feet)
    np.testing.assert_allclose(narrow[:, 1], feet[:, 1] / 2)
    np.testing.assert_array_equal(narrow[:, ::2], feet[:, ::2])
    np.testing.assert_array_equal(GAITS["trot"].placed(feet), feet)
