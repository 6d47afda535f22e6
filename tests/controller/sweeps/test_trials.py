"""Trials draw what they say."""

from __future__ import annotations

import json
import math
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from controller import sweep
from controller.cli.common import ExitCode
from controller.modes import Mode
from controller.sweeps import trials
from controller.sweeps.motion_study import MotionStudy, archive_of, replay
from controller.sweeps.run import SweepResult
from controller.sweeps.sweep_file import Row, SweepFile, row_of
from controller.sweeps.targets import target_of
from controller.sweeps.trials import (
    FRICTION_RANGE,
    MASS_RANGE,
    NOMINAL_FRICTION,
    YAW_RANGE,
    GaitStudy,
    PushStudy,
    Trial,
    TrialRobot,
)
from go2_wbc import World
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.errors import CommandError
from go2_wbc.motion_plan import Posture
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline
from tests.controller.cli.conftest import Run
from tests.controller.sweeps import swept
from tests.viz.page_reader import read_data


def test_a_trial_is_drawn_by_its_seed_inside_its_ranges() -> None:
    trials = [Trial(seed) for seed in range(200)]
    for values, (low, high) in (
        ([t.friction for t in trials], FRICTION_RANGE),
        ([t.mass_scale for t in trials], MASS_RANGE),
        ([t.initial_yaw for t in trials], YAW_RANGE),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high
    each = np.corrcoef([(t.friction, t.mass_scale, t.initial_yaw) for t in trials], rowvar=False)
    assert np.abs(each - np.eye(3)).max() < 0.3
    a, b, other = Trial(5), Trial(5), Trial(6)
    assert (a.friction, a.mass_scale, a.initial_yaw) == (b.friction, b.mass_scale, b.initial_yaw)
    assert a.mass_scale != other.mass_scale
    drawn, nominal = Trial(3), Trial(3, has_nominal_friction=True)
    assert nominal.friction == NOMINAL_FRICTION
    assert (nominal.mass_scale, nominal.initial_yaw) == (drawn.mass_scale, drawn.initial_yaw)
    nominal_mass = 16.085
    trial = Trial(4)
    plant = trial.plant()
    assert plant.total_mass == pytest.approx(nominal_mass * trial.mass_scale, rel=1e-3)
    assert plant.read().rpy[2] == pytest.approx(trial.initial_yaw, abs=0.1)
    plant.close()


class Recorded:
    """Of a robot that goes ahead ever faster, as the time, and left at 0.1 m/s."""

    def __init__(self, time: np.ndarray) -> None:
        self.time = time
        self.com_velocity = np.stack([time, np.full_like(time, 0.1), 0.0 * time], axis=1)
        self.rpy = np.stack([0.0 * time, 0.0 * time, 0.3 * time], axis=1)

    def since(self, time: float) -> Recorded:
        return Recorded(self.time[self.time >= time - 1e-9])

    def torque_shares(self, _: object) -> np.ndarray:
        return np.array([0.2, 0.7, 0.4])


class Untried(TrialRobot):
    """On trial, with no robot: it notes what is asked of it."""

    _motor = Config().motor

    def __init__(
        self, *, ok: bool = True, mode: Mode = Mode.WALKING, fall: str | None = None
    ) -> None:
        self.asked, self.now = list[object](), 10.0
        self.go2: Any = SimpleNamespace(
            sit=lambda: self._ask("sit", ok=ok),
            stand=lambda: self._ask("stand", ok=ok),
            walk=lambda gait: self._ask("walk", gait, ok=ok),
            move=lambda *given, **more: self._ask(*given, *more.values()),
            wait=self._wait,
            mode=mode,
            last_outcome=SimpleNamespace(reason="told"),
        )
        self.truth: Any = SimpleNamespace(
            fall=lambda: fall, clear=lambda: self._ask("clear"), recording=self._recording
        )
        self.plant: Any = SimpleNamespace(
            robot=Config().robot,
            truth=lambda: SimpleNamespace(rpy=np.array([0.0, 0.0, math.pi / 6.0])),
            push=lambda force, *more: self._ask(*np.round(force, 9), *more),
        )

    def _ask(self, *words: object, ok: bool = True) -> bool:
        self.asked += words
        return ok

    def _wait(self, seconds: float) -> None:
        """It goes 0.1 m left a second, all the time."""
        self.now += seconds
        self.plant.time = self.now
        self.truth.p_world_com = 0.1 * self.now * np.array([0.0, 1.0, 5.0])

    def _recording(self, since: float = 10.0) -> Recorded:
        return Recorded(np.linspace(since, self.now, 131))


@pytest.mark.parametrize(
    ("mode", "fall", "why"),
    [
        (Mode.WALKING, None, ""),
        (Mode.FALLEN, None, "told"),
        (Mode.DAMPED, None, "told"),
        (Mode.WALKING, "on its back", "on its back"),
    ],
)
def test_a_robot_that_falls_while_time_passes_has_failed(
    mode: Mode, fall: str | None, why: str
) -> None:
    robot = Untried(mode=mode, fall=fall)
    with pytest.raises(trials.TrialFailed, match=f"^{why}$") if why else nullcontext():
        robot.wait(2.0)
    assert robot.now == 12.0


@pytest.mark.parametrize("ok", [True, False])
@pytest.mark.parametrize(("posture", "asked"), [(Posture.SIT, "sit"), (Posture.STAND, "stand")])
def test_it_gets_ready_for_a_motion_or_has_failed(
    posture: Posture, asked: str, *, ok: bool
) -> None:
    robot = Untried(ok=ok)
    with nullcontext() if ok else pytest.raises(trials.TrialFailed, match="told"):
        robot.get_ready(posture)
    assert robot.asked == [asked]


def test_a_gait_is_measured_once_it_follows_its_command() -> None:
    robot = Untried()
    found = GaitStudy("trot", VelocityCommand(0.5, 0.3, 0.2))._measured(robot)
    assert robot.asked == ["walk", "trot", 0.5, 0.2, 0.3, "clear"]
    ripple = np.linspace(11.5, 16.5, 101).std()
    errors = {"speed_error": 13.5, "side_error": -0.2, "turn_error": 0.1}
    assert found == pytest.approx({"ok": True, **errors, "speed_ripple": ripple, "torque": 0.7})


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_push_comes_from_its_angle_at_its_time_of_the_stride(speed: float) -> None:
    """The robot looks 30 degrees left, and goes 0.1 m/s to the left of the world."""
    robot = Untried()
    found = PushStudy(12.0, speed)._pushed(robot, math.pi / 3.0, 0.25)
    begun = ["walk", "trot", speed, 0.0, 0.0, "clear"] if speed else ["stand"]
    assert robot.asked == [*begun, 0.0, 120.0, 0.0, 0.1, "base"]
    period = GAITS["trot"].period
    assert robot.now == pytest.approx(13.5 + 0.25 * period)
    ahead = speed * np.array([math.cos(math.pi / 6.0), 0.5])
    distance = 2.0 * np.linalg.norm(np.array([0.0, 0.1]) - ahead)
    expected = {"ok": True, "distance": distance, "speed_error": robot.now - period - speed}
    assert found == pytest.approx(expected)


SEEDS = 3
SLOW_TROT = 0.05  #: Error of the mean velocity [m/s] that is no gross mistake


@pytest.fixture(scope="module")
def dip() -> CompiledPlan:
    """A short motion."""
    line = Timeline(name="dip").body(z=-0.03, over=0.4).home(over=0.4)
    return compile_timeline(line, RobotModel())


@pytest.fixture(scope="module")
def dips(dip: CompiledPlan, tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """Its rows, by two workers."""
    out = tmp_path_factory.mktemp("dips") / "dips.sqlite"
    return sweep(dip, SEEDS, workers=2, out=out)


def test_a_motion_is_done_in_every_world_that_is_drawn(dips: SweepResult) -> None:
    assert [row["ok"] for row in dips.rows] == [True] * SEEDS
    assert len({row["friction"] for row in dips.rows}) == SEEDS
    assert all(0.0 < float(row["tracking"]) < 0.02 for row in dips.rows)


def test_a_row_does_not_depend_on_the_rows_before_it(
    dips: SweepResult, dip: CompiledPlan, tmp_path: Path
) -> None:
    """One worker for all seeds, in order; and one that has done none before."""
    alone = sweep(dip, 1, first_seed=SEEDS - 1, workers=1, out=tmp_path / "alone.sqlite")
    in_a_row = sweep(dip, SEEDS, workers=1, out=tmp_path / "row.sqlite")
    assert in_a_row.rows == dips.rows
    assert alone.rows == dips.rows[-1:]


def test_a_plan_is_carried_number_by_number(dip: CompiledPlan) -> None:
    study = target_of(dip).function
    assert isinstance(study, MotionStudy)
    assert study.archive == archive_of(dip)


def test_a_robot_that_does_not_get_up_is_a_row_that_says_why(dip: CompiledPlan) -> None:
    study = MotionStudy(archive_of(dip), World())
    world, plant = study.drawn(0)
    with TrialRobot(plant) as robot:
        robot.go2.close()
        row = row_of(study.row(world, robot))
    assert (row["ok"], row["fall"]) == (False, "this GO2Controller is closed")
    assert (row["done"], row["harm"]) == (False, "fell; not done")
    assert math.isnan(float(row["slip"]))


@pytest.mark.parametrize(
    ("word", "study"),
    [
        ("gait:trot", GaitStudy("trot", VelocityCommand(0.5))),
        ("gait:trot@0.3,-0.1,0.2", GaitStudy("trot", VelocityCommand(0.3, -0.1, 0.2))),
        ("push:12", PushStudy(12.0, 0.5)),
        ("push:8@0", PushStudy(8.0, 0.0)),
    ],
)
def test_words_stand_for_gaits_and_pushes(word: str, study: object) -> None:
    assert target_of(word).function == study


@pytest.mark.parametrize("why", ["", "it fell"])
def test_a_row_has_what_is_measured_or_why_nothing_is(
    why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def measured(_: trials.TrialRobot) -> Row:
        if why:
            raise trials.TrialFailed(why)
        return {"ok": True, "speed": 0.9}

    monkeypatch.setattr(trials, "TrialRobot", nullcontext)
    trial = Trial(5)
    drawn: Row = {"friction": trial.friction, "mass_scale": trial.mass_scale}
    found: Row = {"ok": not why, "fall": why, "speed": 0.1 if why else 0.9}
    assert trials._row(trial, {"speed": 0.1}, measured) == {**drawn, **found}


def test_what_lies_beside_a_swept_file_can_be_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "beside_swept.py").write_text("NUMBER = 3\n", encoding="utf-8")
    file = tmp_path / "swept_file.py"
    file.write_text("from beside_swept import NUMBER\n\ndef f(seed):\n    return {'n': NUMBER}\n")
    monkeypatch.setattr(sys, "path", [*sys.path])
    for _ in range(2):
        target_of(f"{file}:f")
    assert sys.path.count(str(tmp_path)) == 1


@pytest.mark.slow
def test_a_trot_follows_its_velocity() -> None:
    row = row_of(GaitStudy("trot", VelocityCommand(0.4, 0.1, 0.3))(4))
    assert (row["ok"], row["fall"]) == (True, "")
    for name in ("speed_error", "side_error", "turn_error"):
        assert abs(float(row[name])) < SLOW_TROT, name


@pytest.mark.slow
def test_a_small_push_is_survived_and_a_monstrous_one_is_not() -> None:
    """At 500 N s a robot of 15 kg flies off at 33 m/s."""
    small, monstrous = (row_of(PushStudy(size, 0.0)(5)) for size in (4.0, 500.0))
    assert small["ok"] is True
    assert monstrous["ok"] is False
    assert monstrous["fall"]
    assert small["angle"] == monstrous["angle"]


def test_a_row_is_replayed_to_the_last_bit_and_shown(
    dips: SweepResult, tmp_path: Path, run: Run
) -> None:
    page = tmp_path / "page.html"
    told = json.loads(run("replay", dips.path, 1, "--html", page, "--json").out)
    assert told["differences"] == []
    assert told["row"] == dips.rows[1]
    text = page.read_text(encoding="utf-8")
    header, arrays = read_data(text)
    assert "<title>dip, seed 1" in text
    assert len(arrays) > 3
    assert header


@pytest.mark.slow
def test_a_row_that_has_become_another_one_is_told(
    dips: SweepResult, tmp_path: Path, run: Run
) -> None:
    with SweepFile(dips.path) as file, SweepFile(tmp_path / "b.db", file.about) as other:
        row: Row = {name: value for name, value in file.rows([0])[0].items() if name != "seed"}
        other.add(0, {**row, "slip": math.nextafter(float(row["slip"]), 1.0)})
    text = run("replay", tmp_path / "b.db", 0, code=ExitCode.FAILED).out
    (marked,) = [line for line in text.splitlines() if "another" in line]
    assert marked.split()[0] == "slip"


def test_only_rows_that_are_there_and_those_of_motions_are_replayed(
    dips: SweepResult, tmp_path: Path
) -> None:
    with pytest.raises(CommandError, match="no row of seed 99; it has 0 to 2"):
        replay(dips.path, 99)
    result = sweep(swept.trial, 1, workers=1, out=tmp_path / "rows.sqlite")
    with pytest.raises(CommandError, match="only motions are replayed"):
        replay(result.path, 0)
