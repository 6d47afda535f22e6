"""The bench counts honestly: means, worst seeds, falls, exit codes; and draws what it says."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.bench import families as registry
from controller.bench.families import FAMILIES, find_families
from controller.bench.high_fives import highest_window, largest_slip, longest_run
from controller.bench.pushes import CLIMB, RUNG, highest_rung
from controller.bench.report import WIDTH, bar_text, render, summarise, summarise_row
from controller.bench.rows import Direction, Family, Measurement, Row
from controller.bench.runner import run_families
from controller.bench.sequence import FAULTS, Judge
from controller.bench.trials import (
    FRICTION_RANGE,
    MASS_RANGE,
    NOMINAL_FRICTION,
    YAW_RANGE,
    Failed,
    Subject,
    Trial,
)
from controller.bench.witness import Track
from controller.cli import main as cli
from controller.cli.common import ExitCode
from controller.demo.report import StepResult
from controller.demo.run import DemoProgress
from controller.demo.steps import DEMO_STEPS
from go2_wbc.errors import CommandError, PlantError
from go2_wbc.legs import LEGS, Leg

SPEED = Row("fake.speed", "fake item", "speed", "m/s", 1.0, Direction.AT_LEAST)
ERROR = Row("fake.error", "fake item", "error", "%", 2.0)
NOTE = Row("fake.note", "fake item", "note", "mm", None)
NEEDED = {
    *("name", "item", "quantity", "unit", "bar", "direction", "n", "mean", "worst"),
    *("worst_seed", "falls", "passed", "values", "failures"),
}
"""Keys of a row in the JSON that programs rely on."""


def measure_well(trial: Trial) -> Measurement:
    return Measurement({"fake.speed": 1.5 + trial.seed, "fake.error": 1.0, "fake.note": 99.0})


def measure_badly(trial: Trial) -> Measurement:
    return Measurement({"fake.speed": 0.5, "fake.error": 1.0, "fake.note": 0.0})


def fall_on_seed_1(trial: Trial) -> Measurement:
    if trial.seed == 1:
        return Measurement({}, reason="fell at t=3.20 s: roll 71 deg")
    return measure_well(trial)


def break_the_plant(trial: Trial) -> Measurement:
    raise PlantError("physics failed")


def have_a_bug(trial: Trial) -> Measurement:
    raise ZeroDivisionError("a bug")


def fake(measure: Callable[[Trial], Measurement] = measure_well, factor: int = 1) -> Family:
    return Family("fake", (SPEED, ERROR, NOTE), measure, factor)


def measured(*values: float, row: str = "fake.speed") -> dict[int, Measurement]:
    return {seed: Measurement({row: value}) for seed, value in enumerate(values)}


# --- arithmetic of a row ------------------------------------------------------------------------


def test_mean_and_worst_of_a_row_that_wants_much() -> None:
    result = summarise_row(SPEED, measured(3.0, 0.5, 1.0))
    assert (result.n, result.mean, result.worst, result.worst_seed) == (3, 1.5, 0.5, 1)
    assert result.passed  # the bar is for the mean


def test_mean_and_worst_of_a_row_that_wants_little() -> None:
    result = summarise_row(ERROR, measured(3.0, 0.5, 4.0, row="fake.error"))
    assert (result.mean, result.worst, result.worst_seed) == (2.5, 4.0, 2)
    assert result.passed is False


@pytest.mark.parametrize(("row", "mean"), [(SPEED, 1.0), (ERROR, 2.0)])
def test_a_mean_on_the_bar_passes(row: Row, mean: float) -> None:
    assert summarise_row(row, measured(mean, row=row.name)).passed


def test_a_fall_is_never_a_pass_however_good_the_other_seeds() -> None:
    trials = {0: Measurement({"fake.speed": 100.0}), 7: Measurement({}, reason="fell")}
    result = summarise_row(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.failures) == (1, {7: "fell"})
    assert (result.n, result.mean, result.worst, result.worst_seed) == (2, 100.0, None, 7)


def test_a_failure_with_a_good_value_is_no_pass_either() -> None:
    trials = {0: Measurement({"fake.speed": 100.0}, {"fake.speed": "said False"})}
    result = summarise_row(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.worst) == (1, 100.0)


def test_a_nan_is_a_failure() -> None:
    result = summarise_row(SPEED, measured(2.0, math.nan))
    assert result.passed is False
    assert (result.mean, result.worst_seed, set(result.failures)) == (2.0, 1, {1})


def test_a_row_without_any_seed_does_not_pass() -> None:
    assert summarise_row(SPEED, {}).passed is False


def test_a_row_without_a_bar_is_not_judged() -> None:
    result = summarise_row(NOTE, measured(5.0, row="fake.note"))
    assert result.passed is None
    assert summarise(
        [Family("fake", (NOTE,), measure_well)], {"fake": {0: measure_well(Trial(0))}}
    ).ok


# --- report -------------------------------------------------------------------------------------


def test_the_table_fits_80_columns_and_names_the_fallen_seed() -> None:
    long_reason = "fell at t=3.20 s: " + "roll 71 deg, pitch -3 deg, " * 20
    trials = {s: Measurement({}, reason=long_reason) for s in range(9)}
    widest = {s: Measurement({row: -1.23456e-123}) for s in range(999) for row in ("fake.speed",)}
    for results in (trials, widest, measured(1.0)):
        text = render(summarise([fake()], {"fake": results}))
        assert max(map(len, text.splitlines())) <= WIDTH
    assert "seed 2: fell at t=3.20 s" in render(summarise([fake()], {"fake": trials}))


def test_every_real_row_fits_the_table_and_has_its_own_name() -> None:
    rows = [row for family in FAMILIES for row in family.rows]
    assert len({row.name for row in rows}) == len(rows)
    assert [row.quantity for row in rows if len(row.quantity) > 28] == []
    assert [row.item for row in rows if len(row.item) > WIDTH] == []
    assert [bar_text(row) for row in rows if len(bar_text(row)) > 15] == []
    results = {f.name: {0: Measurement({r.name: -1.2e-12 for r in f.rows})} for f in FAMILIES}
    text = render(summarise(FAMILIES, results))
    assert max(map(len, text.splitlines())) <= WIDTH


def test_the_json_has_every_key_and_no_nan() -> None:
    results = {"fake": {0: measure_well(Trial(0)), 1: Measurement({"fake.speed": math.inf})}}
    value = summarise([fake()], results).as_dict()
    text = json.dumps(value, allow_nan=False)
    rows = json.loads(text)["rows"]
    assert all(set(row) == NEEDED for row in rows)
    assert [row["name"] for row in rows] == ["fake.speed", "fake.error", "fake.note"]
    assert value["passed"] is False


# --- runner -------------------------------------------------------------------------------------


def test_an_error_of_the_project_is_a_failed_trial_with_its_reason() -> None:
    results = run_families([fake(break_the_plant)], seeds=1, jobs=0)
    report = summarise([fake()], results)
    assert report.rows[0].failures == {0: "PlantError: physics failed"}
    assert not report.ok


def test_a_bug_is_raised_and_not_counted() -> None:
    with pytest.raises(ZeroDivisionError):
        run_families([fake(have_a_bug)], seeds=1, jobs=0)


def test_every_seed_of_every_family_is_run_once_and_told() -> None:
    told: list[tuple[int, int]] = []
    families = [fake(), Family("more", (SPEED,), measure_badly, seed_factor=2)]
    results = run_families(families, 2, 0, lambda p: told.append((p.done, p.count)))
    assert {name: sorted(trials) for name, trials in results.items()} == {
        "fake": [0, 1],
        "more": [0, 1, 2, 3],
    }
    assert told == [(done, 6) for done in range(1, 7)]


def test_processes_give_the_same_as_one_after_the_other() -> None:
    in_turn = run_families([fake()], seeds=3, jobs=0)
    assert run_families([fake()], seeds=3, jobs=2) == in_turn


# --- command line -------------------------------------------------------------------------------


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> Callable[[Family], None]:
    """Makes a family the only one, and runs it in this process."""

    def install(family: Family) -> None:
        monkeypatch.setattr(registry, "FAMILIES", (family,))
        monkeypatch.setattr(
            "controller.bench.runner._in_processes",
            lambda tasks, _jobs: ((f, s, f.measure(Trial(s))) for f, s in tasks),
        )

    return install


@pytest.mark.parametrize(
    ("measure", "code"),
    [
        (measure_well, ExitCode.OK),
        (measure_badly, ExitCode.FAILED),
        (fall_on_seed_1, ExitCode.FAILED),
    ],
)
def test_the_exit_code_says_whether_every_row_passes(
    only: Callable[[Family], None],
    capsys: pytest.CaptureFixture[str],
    measure: Callable[[Trial], Measurement],
    code: ExitCode,
) -> None:
    only(fake(measure))
    assert cli.main(["bench", "behaviour", "--seeds", "2"]) == code
    assert "rows pass" in capsys.readouterr().out


def test_json_goes_to_stdout_and_to_the_file_alike(
    only: Callable[[Family], None], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake())
    file = tmp_path / "bench.json"
    file.write_text("old")
    assert cli.main(["bench", "behaviour", "--quick", "--json", "--out", str(file)]) == ExitCode.OK
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(file.read_text())
    assert printed["rows"][0]["n"] == 3
    assert list(tmp_path.iterdir()) == [file]


def test_an_interrupt_leaves_the_old_results(
    only: Callable[[Family], None], tmp_path: Path
) -> None:
    def interrupt(trial: Trial) -> Measurement:
        raise KeyboardInterrupt

    only(fake(interrupt))
    file = tmp_path / "bench.json"
    file.write_text("old")
    assert cli.main(["bench", "behaviour", "--out", str(file)]) == ExitCode.INTERRUPTED
    assert file.read_text() == "old"


def test_a_missing_folder_is_told_before_anything_runs(
    only: Callable[[Family], None], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake(have_a_bug))
    missing = tmp_path / "none" / "bench.json"
    assert cli.main(["bench", "behaviour", "--out", str(missing)]) == ExitCode.USAGE
    assert "does not exist" in capsys.readouterr().err


def test_list_names_every_family_and_bar(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bench", "behaviour", "--list"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert all(family.name in out.splitlines() for family in FAMILIES)
    assert "<= 0.025 m/s" in out
    assert max(map(len, out.splitlines())) <= WIDTH


def test_an_unknown_row_is_a_usage_error_that_lists_the_valid_ones() -> None:
    with pytest.raises(CommandError, match=r"unknown row 'gallop'.*high-five.*trot"):
        find_families(["gallop"])
    assert cli.main(["bench", "behaviour", "--rows", "gallop"]) == ExitCode.USAGE


# --- trials -------------------------------------------------------------------------------------


def test_trials_draw_inside_their_ranges_and_fill_them() -> None:
    trials = [Trial(seed) for seed in range(200)]
    for values, (low, high) in (
        ([t.friction for t in trials], FRICTION_RANGE),
        ([t.mass_scale for t in trials], MASS_RANGE),
        ([t.yaw for t in trials], YAW_RANGE),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high


def test_a_trial_is_decided_by_its_seed() -> None:
    a, b, other = Trial(5), Trial(5), Trial(6)
    assert (a.friction, a.mass_scale, a.yaw) == (b.friction, b.mass_scale, b.yaw)
    assert a.mass_scale != other.mass_scale


def test_nominal_friction_changes_nothing_else() -> None:
    drawn, nominal = Trial(3), Trial(3, has_nominal_friction=True)
    assert nominal.friction == NOMINAL_FRICTION
    assert (nominal.mass_scale, nominal.yaw) == (drawn.mass_scale, drawn.yaw)


def test_the_plant_of_a_trial_is_what_the_trial_says() -> None:
    nominal_mass = 16.085
    trial = Trial(4)
    plant = trial.plant()
    assert plant.total_mass == pytest.approx(nominal_mass * trial.mass_scale, rel=1e-3)
    assert plant.read().rpy[2] == pytest.approx(trial.yaw, abs=0.1)
    plant.close()


# --- measures -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("greatest", "first", "found"),
    [
        (14.0, 14.0, 14.0),
        (15.0, 14.0, 14.0),
        (100.0, 14.0, 14.0 + CLIMB * RUNG),
        (13.0, 14.0, 12.0),
        (0.0, 14.0, 0.0),
        (1.0, 3.0, 1.0),
    ],
)
def test_the_ladder_ends_below_the_first_impulse_that_is_not_survived(
    greatest: float, first: float, found: float
) -> None:
    assert highest_rung(lambda impulse: impulse <= greatest, first) == found


def test_the_longest_run_is_found() -> None:
    flags = np.array([1, 0, 1, 1, 0, 1, 1, 1], dtype=bool)
    assert longest_run(flags) == slice(5, 8)
    assert longest_run(np.zeros(3, dtype=bool)) == slice(0, 0)


def test_the_held_height_is_the_best_that_was_kept_for_the_whole_time() -> None:
    heights = np.array([0.0, 0.9, 0.59, 0.61, 0.62, 0.6, 0.0])
    assert highest_window(heights, 3) == slice(3, 6)
    with pytest.raises(Failed):
        highest_window(heights, 8)


def test_slip_is_the_largest_excursion_and_not_the_final_one() -> None:
    v = np.zeros((201, 4, 3))
    v[1:101, Leg.RL, 0], v[101:, Leg.RL, 0] = 0.02, -0.02  # 4 mm there and back
    track = empty_track(201, v)
    assert largest_slip(track, list(LEGS)) == pytest.approx(0.004)
    assert largest_slip(track, [Leg.FL]) == 0.0


def test_a_track_gives_the_velocity_in_the_frame_of_the_heading() -> None:
    track = empty_track(11, np.zeros((11, 4, 3)))
    track.rpy[:, 2] = math.pi / 2
    track.p_world_com[:, 1] = 0.5 * track.time  # along world y is ahead
    assert track.com_velocity == pytest.approx(np.tile([0.5, 0.0, 0.0], (10, 1)))


def test_every_step_of_the_demo_has_a_criterion_of_the_bench() -> None:
    assert {step.name for step in DEMO_STEPS} <= set(FAULTS)


def test_a_true_that_the_simulator_does_not_bear_out_is_found_for_every_step() -> None:
    with Subject(Trial(0)) as robot:
        judge = Judge(robot)
        for name in FAULTS:
            judge(DemoProgress(0, 1, name))
            robot.go2.wait(0.01)
            judge(
                DemoProgress(
                    0,
                    1,
                    name,
                    StepResult(name, name, ok=True, reason="done", start=0.0, duration=0.0),
                )
            )
        assert [line.split(":")[0] for line in judge.untrue] == list(FAULTS)


def empty_track(n: int, v_contacts: np.ndarray) -> Track:
    three, twelve = np.zeros((n, 3)), np.zeros((n, 12))
    return Track(
        time=0.002 * np.arange(n),
        q=np.zeros((n, 19)),
        v=np.zeros((n, 18)),
        rpy=three.copy(),
        tau=twelve,
        foot_forces=np.zeros((n, 4)),
        p_world_com=three.copy(),
        p_world_feet=np.zeros((n, 4, 3)),
        p_world_contacts=np.zeros((n, 4, 3)),
        v_world_contacts=v_contacts,
        trunk_force=np.zeros(n),
    )
