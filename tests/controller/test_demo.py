"""The demo does its steps in order and judges each by what was measured."""

import json
import math
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from controller import GO2Controller
from controller.demo import DEMO_STEPS, DemoProgress, Measurement, StepResult, run_demo
from controller.demo.steps import StepRun, terrain_steps, three_leg_minima
from go2_wbc.errors import IkError, PlantTimeout
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import BOTH, Stairs
from go2_wbc.recording import Recording
from tests.controller.fake_go2 import FakeGo2
from tests.script_server import python

HEAVY = {"numpy", "pinocchio", "placo", "mujoco", "meshcat", "jaxtyping"}


def step_of(go2: FakeGo2, name: str) -> StepResult:
    return next(step for step in run_demo(go2).steps if step.name == name)


def figure_of(step: StepResult, name: str) -> Measurement:
    return next(figure for figure in step.figures if figure.name == name)


def test_the_demo_does_its_steps_and_leaves_the_controller_open_for_its_owner() -> None:
    go2 = FakeGo2()
    report = run_demo(go2)
    assert go2.calls == [
        *("stand", "sit", "walk", "move", "wait", "move", "stop", "wait"),
        *("turn_left", "high_five", "sit"),
    ]
    assert report.ok
    assert [step.reason for step in report.steps] == ["done"] * len(DEMO_STEPS)


def test_over_a_terrain_the_robot_walks_by_sight_and_its_recording_has_the_ground() -> None:
    step = Stairs(0.12, count=1, way=BOTH, landing=0.8)
    plant = MujocoPlant(terrain=step, lidar=True, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        report = run_demo(go2, steps=terrain_steps(step))
        ground = go2.recording().ground
    assert report.ok, report.steps
    assert [item.name for item in report.steps] == ["stand", "walk", "cross", "stand_again"]
    assert figure_of(report.steps[2], "way ahead").measured > step.end
    assert figure_of(report.steps[2], "up and down").measured == pytest.approx(0.12, abs=0.03)
    on_it = (np.abs(ground[:, 0] - 1.2) < 0.3) & (np.abs(ground[:, 1]) < 0.5)
    assert np.median(ground[on_it, 2]) == pytest.approx(0.12, abs=0.015)


@pytest.mark.parametrize(("off", "is_met"), [(0.0, True), (0.09, True), (-0.11, False)])
def test_a_way_over_a_terrain_is_asked_for_ahead_and_told_aside(
    off: float, *, is_met: bool
) -> None:
    step = Stairs(0.12, count=1, way=BOTH, landing=0.8)
    q = np.zeros((3, 19))
    q[:, 6] = 1.0
    q[1, 2], q[2, :2] = 0.12, (step.end + 0.6 + off, 0.3)
    run = Mock(spec=StepRun, recording=Mock(spec=Recording, q=q))
    ahead, aside, up = terrain_steps(step)[2].measure(run)
    assert (ahead.asked, ahead.is_met) == (step.end + 0.6, is_met)
    assert ahead.measured == pytest.approx(step.end + 0.6 + off)
    assert (aside.measured, aside.asked, aside.is_met) == (0.3, 0.0, True)
    assert (up.measured, up.asked) == (0.12, None)


def test_the_walking_speed_is_measured_and_who_creeps_on_has_not_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    step = step_of(FakeGo2(speed_share=0.75), "forward")
    assert figure_of(step, "mean speed").measured == pytest.approx(0.15, rel=1e-6)
    assert not step.ok
    assert step.reason == "mean speed 0.15 m/s, asked 0.2 +- 0.02"
    with monkeypatch.context() as patch:
        patch.setattr("controller.demo.steps.SPEED_UP_TIME", 100.0)
        assert math.isnan(figure_of(step_of(FakeGo2(), "forward"), "mean speed").measured)
    monkeypatch.setattr(FakeGo2, "stop", lambda self: None)
    step = step_of(FakeGo2(), "stop")
    assert not step.ok
    assert "speed at the end 0.2 m/s" in step.reason


@pytest.mark.parametrize("yaw", [0.0, 3.0, -2.0])
def test_way_and_turn_are_seen_from_the_robot_whatever_its_heading(yaw: float) -> None:
    report = run_demo(FakeGo2(yaw=yaw))
    steps = {step.name: step for step in report.steps}
    assert figure_of(steps["forward"], "mean speed").measured == pytest.approx(0.2, rel=1e-6)
    assert figure_of(steps["forward"], "way aside").measured == pytest.approx(0.0, abs=1e-9)
    assert figure_of(steps["turn"], "turned left").measured == pytest.approx(90.0, abs=1e-6)


def test_a_step_that_fails_is_told_why_and_the_demo_goes_on() -> None:
    report = run_demo(FakeGo2(refusals={"high_five": "the paw was not held at 0.62 m"}))
    failed = [step for step in report.steps if not step.ok]
    assert [step.name for step in failed] == ["high_five"]
    assert failed[0].reason == "the paw was not held at 0.62 m"
    assert not report.ok
    report = run_demo(FakeGo2(errors={"high_five": IkError("paw 0.1 m off\ntable")}))
    assert [step.ok for step in report.steps] == [True] * 6 + [False, True]
    assert report.steps[6].reason == "paw 0.1 m off"
    assert report.steps[6].figures == ()


def test_a_plant_that_fails_ends_the_demo() -> None:
    with pytest.raises(PlantTimeout, match="silent"):
        run_demo(FakeGo2(errors={"walk": PlantTimeout("silent")}))


def test_after_a_fall_and_while_nothing_walks_steps_are_told_as_not_done() -> None:
    go2 = FakeGo2(falls_in="walk")
    report = run_demo(go2)
    assert [step.ok for step in report.steps] == [True, True] + [False] * 6
    assert report.steps[2].reason.startswith("fell at t=3.20 s")
    assert {step.reason for step in report.steps[3:]} == {"not run: the robot has fallen"}
    assert "move" not in go2.calls
    step = step_of(FakeGo2(falls_in="wait"), "forward")
    assert not step.ok
    assert step.reason.startswith("fell at")
    stop = next(step for step in DEMO_STEPS if step.name == "stop")
    report = run_demo(FakeGo2(), steps=[stop])
    assert report.steps[0].reason == "move() needs walking mode, not lying"


def test_progress_is_told_when_a_step_begins_and_when_it_ends() -> None:
    told: list[DemoProgress] = []
    report = run_demo(FakeGo2(), told.append)
    assert [progress.index for progress in told] == [i for i in range(8) for _ in range(2)]
    assert all(progress.result is None for progress in told[::2])
    assert tuple(progress.result for progress in told[1::2]) == report.steps
    assert {progress.count for progress in told} == {8}


def test_margin_and_load_count_on_three_legs_only_and_for_supporting_feet() -> None:
    totals = run_demo(FakeGo2()).totals
    # Elsewhere the margin is 0.15 m; the raised foot itself carries 0 N.
    assert totals.least_support_margin == 0.06
    assert totals.least_foot_load == 40.0
    assert all(math.isnan(value) for value in three_leg_minima(FakeGo2().recording()))


def test_only_its_own_failures_and_times_count_and_add_up() -> None:
    go2 = FakeGo2()
    go2.telemetry.qp_failures += 1
    assert run_demo(go2).totals.qp_failures == 0
    report = run_demo(FakeGo2())
    assert report.totals.robot_time == pytest.approx(sum(step.duration for step in report.steps))
    starts = np.array([step.start for step in report.steps])
    ends = starts + [step.duration for step in report.steps]
    np.testing.assert_allclose(starts[1:], ends[:-1])
    totals = run_demo(FakeGo2()).totals
    assert replace(totals, robot_time=24.0, cpu_time=8.0).real_time_factor == 3.0
    assert math.isnan(replace(totals, cpu_time=0.0).real_time_factor)


def test_the_report_is_strict_json_even_with_what_could_not_be_measured() -> None:
    values = run_demo(FakeGo2(), steps=DEMO_STEPS[:2]).as_dict()
    again = json.loads(json.dumps(values, allow_nan=False))
    assert again["totals"]["least_support_margin"] is None
    assert again["ok"] is True
    assert [step["name"] for step in again["steps"]] == ["stand", "sit"]
    assert again["steps"][1]["figures"][1]["unit"] == "deg"


@pytest.mark.parametrize(
    ("measured", "asked", "tolerance", "met"),
    [
        (1.0, None, None, True),
        (5.0, 1.0, None, True),
        (1.1, 1.0, 0.2, True),
        (1.3, 1.0, 0.2, False),
        (math.nan, 1.0, 0.2, False),
    ],
)
def test_a_figure_is_met_within_its_tolerance(
    measured: float, asked: float | None, tolerance: float | None, met: bool
) -> None:
    assert Measurement("x", measured, "m", asked, tolerance).is_met is met


def test_the_module_of_the_console_script_imports_no_library_and_knows_its_names() -> None:
    """A broken library must end in a message that names ``doctor``, not in a traceback."""
    code = "import sys, controller.demo; print(*sys.modules)"
    loaded = set(python("-c", code).stdout.split())
    assert "controller.demo" in loaded
    assert HEAVY & loaded == set()
    import controller.demo

    with pytest.raises(AttributeError, match="no_such_name"):
        _ = controller.demo.no_such_name
