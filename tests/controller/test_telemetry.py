"""Telemetry keeps the newest ticks, thins them evenly, and remembers the peaks of the whole run."""

from dataclasses import replace

import numpy as np
import pytest

from controller.telemetry import BLOCK, Telemetry
from go2_wbc.errors import CommandError
from go2_wbc.planning.height_map import DOWNS, HeightMap, fuse
from go2_wbc.records import layout_of
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.condensed import Decision
from go2_wbc.wbc.controller import WbcSolution
from tests.controller.plants import lying_state

CAPACITY = 50
PERIOD = 0.002
ALL = np.ones(4, dtype=bool)


HUGE_PAGES = 4 << 20  #: Memory [bytes] from which on numpy asks for huge pages


@pytest.fixture(autouse=True, params=[BLOCK, 7])
def _in_blocks(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("controller.telemetry.BLOCK", request.param)


def recorded(model: RobotModel, ticks: int, first: int = 0) -> Telemetry:
    telemetry = Telemetry(model, CAPACITY)
    for tick in range(first, first + ticks):
        snapshot = model.snapshot(lying_state(tick * PERIOD))
        telemetry.record(snapshot, ALL, f"tick {tick}")
    return telemetry


def test_a_recording_is_empty_without_a_tick_bears_silence_and_does_not_change_later(
    model: RobotModel,
) -> None:
    recording = Telemetry(model, CAPACITY).samples().recording()
    assert len(recording.time) == 0
    assert recording.duration == 0.0
    telemetry = Telemetry(model, CAPACITY)
    snapshot = model.snapshot(lying_state(1.0))
    for _ in range(5):
        telemetry.record(snapshot, ALL, "silent")
    assert set(telemetry.samples().recording().time) == {1.0}
    telemetry = recorded(model, CAPACITY)
    recording = telemetry.samples().recording()
    before = recording.time.copy(), recording.q.copy()
    state = lying_state(9.0)
    for _ in range(CAPACITY):
        telemetry.record(model.snapshot(replace(state, q=state.q + 0.1)), ALL, "later")
    assert np.array_equal(recording.time, before[0])
    assert np.array_equal(recording.q, before[1])


def test_peaks_are_the_same_for_a_plant_that_reuses_its_arrays(model: RobotModel) -> None:
    # The speeds of the tick before were those of this one: motors seemed to be above their limit.
    own, reused, v = Telemetry(model, CAPACITY), Telemetry(model, CAPACITY), np.zeros(18)
    tau = np.zeros(12)
    tau[0] = 10.0
    for tick in range(1, 5):
        v[6] = 7.0 * tick
        for telemetry, given in ((own, v.copy()), (reused, v)):
            state = replace(lying_state(tick * PERIOD), v=given, tau=tau)
            telemetry.record(model.snapshot(state), ALL, "")
    assert reused.peak_motor_ratio == own.peak_motor_ratio > 0.0


@pytest.mark.parametrize("ticks", [1, 2, CAPACITY - 1, CAPACITY, CAPACITY + 1, 3 * CAPACITY + 7])
def test_the_newest_ticks_are_kept_in_order(model: RobotModel, ticks: int) -> None:
    recording = recorded(model, ticks).samples(rate=1 / PERIOD).recording()
    kept = range(max(0, ticks - CAPACITY), ticks)
    assert recording.time == pytest.approx(PERIOD * np.array(kept))
    assert recording.labels == tuple(f"tick {tick}" for tick in kept)


@pytest.mark.parametrize(("rate", "count"), [(500.0, 50), (250.0, 25), (100.0, 10), (1e6, 50)])
def test_a_recording_is_thinned_evenly_to_about_the_rate(
    model: RobotModel, rate: float, count: int
) -> None:
    time = recorded(model, CAPACITY).samples(rate).recording().time
    assert len(time) == count
    assert np.ptp(np.diff(time)) < 1e-9


@pytest.mark.parametrize("ticks", [CAPACITY // 2, 2 * CAPACITY + 3])
def test_a_recording_may_begin_at_a_time(model: RobotModel, ticks: int) -> None:
    telemetry = recorded(model, ticks)
    whole = telemetry.samples(rate=1 / PERIOD).recording()
    part = telemetry.samples(rate=1 / PERIOD, since=float(whole.time[4])).recording()
    assert np.array_equal(part.time, whole.time[4:])
    assert np.array_equal(part.q, whole.q[4:])
    assert part.labels == whole.labels[4:]


def test_the_peaks_are_those_of_the_whole_run_as_shares_of_the_limits(model: RobotModel) -> None:
    telemetry = Telemetry(model, CAPACITY)
    tau, v = np.zeros(12), np.zeros(18)
    tau[4] = -0.8 * model.torque_limits[4]
    v[6 + 2] = 0.6 * model.speed_limits[2]
    telemetry.record(model.snapshot(replace(lying_state(0.0), tau=tau, v=v)), ALL, "peak")
    for tick in range(1, 2 * CAPACITY):
        telemetry.record(model.snapshot(lying_state(tick * PERIOD)), ALL, "calm")
    assert telemetry.peak_torque_ratio == pytest.approx(0.8)
    assert telemetry.peak_speed_ratio == pytest.approx(0.6)
    assert telemetry.peak_motor_ratio == pytest.approx(0.8), "it acted on a joint at rest"


@pytest.mark.parametrize(("direction", "ratio"), [(1.0, 0.6), (-1.0, 0.3)])
def test_a_torque_is_compared_with_the_line_at_the_speed_from_which_it_acted(
    model: RobotModel, direction: float, ratio: float
) -> None:
    telemetry, tau, v = Telemetry(model, CAPACITY), np.zeros(12), np.zeros(18)
    v[6 + 4] = direction * 0.725 * model.speed_limits[4]  # half way from the knee to no load
    telemetry.record(model.snapshot(replace(lying_state(0.0), v=v)), ALL, "fast")
    tau[4] = 0.3 * model.torque_limits[4]
    telemetry.record(model.snapshot(replace(lying_state(PERIOD), tau=tau)), ALL, "driven, braked")
    assert telemetry.peak_motor_ratio == pytest.approx(ratio)
    assert telemetry.peak_torque_ratio == pytest.approx(0.3)


def test_the_support_margin_is_that_of_the_planned_stance_feet(model: RobotModel) -> None:
    telemetry = Telemetry(model, CAPACITY)
    stances = ALL, np.array([True, False, True, True]), np.array([True, False, False, True])
    for tick, stance in enumerate(stances):
        telemetry.record(model.snapshot(lying_state(tick * PERIOD)), stance, "stance")
    four, three, two = telemetry.samples(rate=1e6).recording().support_margin
    assert four > three
    assert np.isnan(two)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_a_rate_that_is_not_positive_is_refused(model: RobotModel, rate: float) -> None:
    with pytest.raises(CommandError, match="rate must be positive"):
        recorded(model, 3).samples(rate).recording()


def test_memory_is_asked_for_in_pieces_too_small_for_huge_pages(model: RobotModel) -> None:
    telemetry = Telemetry(model, 2 * BLOCK)
    telemetry.record(model.snapshot(lying_state(0.0)), ALL, "first")
    assert telemetry._blocks[0].nbytes < HUGE_PAGES
    assert len(telemetry._blocks) == 1


def test_ground_is_kept_when_it_is_left_behind_and_told_as_it_was_found_last(
    model: RobotModel,
) -> None:
    telemetry, heights = Telemetry(model, CAPACITY), HeightMap()
    for x, z in ((0.0, 0.1), (0.5, 0.2), (20.0, 0.3), (20.25, 0.4), (0.0, 0.15)):
        point, place = np.array([[0.5, 0.0, z]]), np.array([x, 0.0, 0.0])
        for _ in range(DOWNS):
            fuse(heights, point, place, np.eye(3), 0.01)
        telemetry.see(heights, place)
    ground = telemetry.samples().recording().ground
    found = dict(zip(ground[:, 0].round(2).tolist(), ground[:, 2].round(3).tolist(), strict=True))
    assert found == {0.51: 0.15, 1.01: 0.2, 20.51: 0.3, 20.76: 0.4}


def solved(number: float, *, is_relaxed: bool = False) -> WbcSolution:
    """One whose multipliers are all that number."""
    row = np.full(layout_of(Decision).size, number)
    solution = WbcSolution.of_row(row, 0.0, "condensed", lambda: None)  # type: ignore[arg-type]
    return replace(solution, is_relaxed=is_relaxed)


def test_multipliers_are_kept_of_the_ticks_in_which_they_were_wanted(model: RobotModel) -> None:
    telemetry = recorded(model, 4)
    assert not telemetry.samples().recording().is_explained
    for tick in range(4, 12):
        telemetry.record(model.snapshot(lying_state(tick * PERIOD)), ALL, "explained")
        telemetry.note(solved(float(tick)) if tick != 8 else None)
    recording = telemetry.samples(rate=1 / PERIOD).recording()
    wanted = [*[np.nan] * 4, *range(4, 8), np.nan, *range(9, 12)]
    np.testing.assert_array_equal(recording.multipliers, np.tile(wanted, (48, 1)).T)
    assert not recording.gave_way.any()


def test_a_tick_that_was_overwritten_is_not_told_by_its_successor(model: RobotModel) -> None:
    telemetry = Telemetry(model, CAPACITY)
    for tick in range(CAPACITY + 10):
        telemetry.record(model.snapshot(lying_state(tick * PERIOD)), ALL, "")
        if tick < CAPACITY:
            telemetry.note(solved(1.0))
    multipliers = telemetry.samples(rate=1 / PERIOD).recording().multipliers
    assert np.isnan(multipliers[-10:]).all()
    assert (multipliers[:-10] == 1.0).all()


def test_a_limit_that_binds_for_one_tick_is_in_the_thinned_recording(model: RobotModel) -> None:
    telemetry = Telemetry(model, CAPACITY)
    for tick in range(40):
        telemetry.record(model.snapshot(lying_state(tick * PERIOD)), ALL, "")
        telemetry.note(solved({7: -3.0, 8: 2.0}.get(tick, 0.0), is_relaxed=tick == 23))
    recording = telemetry.samples(rate=100.0).recording()
    assert len(recording.time) == 8
    assert recording.multipliers[:, 0].tolist() == [0.0, -3.0, *[0.0] * 6]
    assert recording.gave_way.tolist() == [k == 4 for k in range(8)]
