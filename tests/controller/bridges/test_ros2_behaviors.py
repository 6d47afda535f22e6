"""What can be ordered over ROS 2, carried out by a job server. No ROS is needed."""

import logging
import math
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from controller.bridges.ros2.behaviors import COMMANDS, Jobs, motion_job, order
from controller.bridges.ros2.velocity import CMD_VEL_SILENCE, VelocityInput
from controller.go2_controller import GO2Controller
from controller.jobs import JobServer
from controller.modes import Mode, Outcome
from controller.pacing import LogThrottle
from go2_wbc.config import Config
from go2_wbc.errors import CommandError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternion_from_rpy
from motions import FeasibilityChecker, Playable
from motions.authoring import parse_values
from motions.feasibility.report import FeasibilityReport
from motions.plan.timeline_compiler import compile_timeline
from tests.controller.fake_go2 import FakeGo2
from tests.controller.plants import PERIOD, WatchedPlant

HANG_GUARD = 30.0


def jobs_of(go2: GO2Controller) -> Jobs:
    return JobServer(go2)


def ordered(jobs: Jobs, command: str) -> list[Outcome]:
    """The answers to an order, after the server has worked."""
    answers: list[Outcome] = []
    order(jobs, command, answers.append)
    jobs.work()
    return answers


@pytest.mark.parametrize(
    ("command", "call"), [("up", "stand"), ("stand", "stand"), (" SIT ", "sit"), ("Walk", "walk")]
)
def test_an_order_is_answered_after_it_has_happened(command: str, call: str) -> None:
    go2 = FakeGo2()
    jobs, answers = jobs_of(go2), []
    order(jobs, command, answers.append)
    assert answers == []
    assert jobs.work()
    assert go2.calls == [call]
    assert [answer.ok for answer in answers] == [True]
    assert "done in" in answers[0].reason


def test_an_unknown_order_is_refused_with_the_valid_names() -> None:
    (answer,) = ordered(jobs_of(FakeGo2()), "levitate")
    assert not answer.ok
    assert "'levitate'" in answer.reason
    assert all(name in answer.reason for name in COMMANDS)


def test_what_did_not_happen_is_answered_with_the_reason() -> None:
    (answer,) = ordered(jobs_of(FakeGo2(refusals={"sit": "sit not done within 3.0 s"})), "sit")
    assert (answer.ok, answer.reason) == (False, "sit not done within 3.0 s")


def test_a_robot_that_lies_is_not_taken_over_and_one_that_stands_is(go2: GO2Controller) -> None:
    (answer,) = ordered(jobs_of(go2), "take_over")
    assert not answer.ok
    assert answer.reason.startswith("the robot does not stand: it lies, its base 0.")
    assert go2.mode is Mode.LYING
    assert ordered(jobs_of(go2), "up")[0].ok
    assert ordered(jobs_of(go2), "take_over")[0].ok


def test_stop_in_a_motion_leaves_it_and_is_answered_when_the_robot_stands() -> None:
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        jobs, answers = jobs_of(go2), {}
        job = motion_job("nod", [], go2, lambda answer: answers.setdefault("nod", answer))
        assert jobs.submit(job)
        stop = lambda: order(jobs, "stop", lambda answer: answers.setdefault("stop", answer))  # noqa: E731
        plant.once_at(go2.state.time + 2.0, stop)
        while not jobs.work():
            time.sleep(0.01)
        assert not answers["nod"].ok
        assert "cancelled" in answers["nod"].reason
        assert answers["stop"].ok
        assert go2.mode is Mode.STANDING


def test_damp_in_a_posture_ends_it() -> None:
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        jobs, answers = jobs_of(go2), {}
        order(jobs, "up", lambda answer: answers.setdefault("up", answer))
        damp = lambda: order(jobs, "damp", lambda answer: answers.setdefault("damp", answer))  # noqa: E731
        plant.once_at(1.2, damp)
        jobs.work()
        assert not answers["up"].ok
        assert answers["damp"].ok
        assert go2.mode is Mode.DAMPED


def played(go2: GO2Controller, motion: str, *settings: str) -> Outcome:
    jobs, answers, answered = jobs_of(go2), [], threading.Event()
    assert jobs.submit(motion_job(motion, settings, go2, answers.append))
    while not jobs.work():
        answered.wait(0.01)
    return answers[0]


def test_a_motion_is_prepared_beside_the_loop_and_played_from_lying(go2: GO2Controller) -> None:
    answer = played(go2, "nod", "times=1")
    assert answer.ok, answer.reason
    assert go2.mode is Mode.STANDING


def test_a_motion_is_prepared_for_the_robot_that_is_driven(monkeypatch: pytest.MonkeyPatch) -> None:
    # It was compiled and checked for the installed Go2, whatever its motors were taken for.
    models: list[RobotModel] = []
    plan = FeasibilityChecker.plan

    def noted(checker: FeasibilityChecker, motion: Playable, *, check: bool = True) -> MotionPlan:
        models.append(checker.model)
        return plan(checker, motion, check=check)

    monkeypatch.setattr(FeasibilityChecker, "plan", noted)
    plant = WatchedPlant(MujocoPlant(motor="ideal"))
    with GO2Controller(plant=plant, config=Config(motor="ideal")) as go2:
        assert played(go2, "nod", "times=1").ok
    assert [np.isinf(model.motor.no_load_speed).all() for model in models] == [True, True]


def test_a_high_five_is_compiled_and_checked_once(
    monkeypatch: pytest.MonkeyPatch, go2: GO2Controller
) -> None:
    # It was compiled for the check, and again by the robot's own high five, in the loop's thread.
    done: list[str] = []

    def counted(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **named: Any) -> Any:
            done.append(f"{name} in {threading.current_thread().name}")
            return real(*args, **named)

        return call

    for module in [m for name, m in sys.modules.items() if name.startswith(("motions", "contro"))]:
        if vars(module).get("compile_timeline") is compile_timeline:
            monkeypatch.setattr(module, "compile_timeline", counted("compiled", compile_timeline))
    report = counted("checked", FeasibilityReport.of)
    monkeypatch.setattr(FeasibilityReport, "of", staticmethod(report))
    answer = played(go2, "high_five", "hold=0.5", "side=left")
    assert answer.ok, answer.reason
    assert "mean paw height" in answer.reason
    assert done == ["compiled in prepare", "checked in prepare"]


def test_a_high_five_at_another_height_is_measured_as_well(go2: GO2Controller) -> None:
    # It was played as any motion, and nobody looked at the paw: its name alone was known.
    answer = played(go2, "high_five", "hold=0.5", "height=0.62")
    assert answer.ok, answer.reason
    assert "planned paw height [m] 0.62," in answer.reason


def test_a_motion_that_does_not_exist_is_answered_with_those_that_do() -> None:
    answer = played(FakeGo2(), "levitate")
    assert not answer.ok
    assert answer.reason.startswith("unknown motion 'levitate'; valid: beckon,")


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [(["times=99"], "times"), (["times"], "NAME=VALUE"), (["size=1"], "size")],
)
def test_wrong_settings_are_answered_with_the_reason(settings: list[str], complaint: str) -> None:
    go2 = FakeGo2()
    answer = played(go2, "nod", *settings)
    assert not answer.ok
    assert complaint in answer.reason
    assert go2.calls == []


def test_settings_are_read_as_numbers_or_words() -> None:
    read = parse_values(["hold=2.5", "times = 3", "side=left"])
    assert read == {"hold": 2.5, "times": 3, "side": "left"}
    with pytest.raises(CommandError, match="'side='"):
        parse_values(["side="])


@pytest.fixture
def velocity(go2: GO2Controller) -> VelocityInput:
    return VelocityInput(go2, VelocityEnvelope())


def test_a_velocity_lasts_half_a_second(go2: GO2Controller, velocity: VelocityInput) -> None:
    assert go2.walk()
    velocity.accept(0.3, 0.1, 0.2, is_busy=False)
    assert go2.command == VelocityCommand(0.3, 0.1, 0.2)
    go2.wait(CMD_VEL_SILENCE - 2 * PERIOD)
    velocity.expire()
    assert not go2.command.is_zero
    go2.wait(3 * PERIOD)
    velocity.expire()
    assert go2.command.is_zero
    assert velocity.counts["silences"] == 1


def test_velocities_that_cannot_be_followed_are_counted_and_warned_of_once(
    caplog: pytest.LogCaptureFixture, go2: GO2Controller, velocity: VelocityInput
) -> None:
    velocity._throttle = LogThrottle(logging.getLogger("cmd_vel"), math.inf)
    for _ in range(5):
        velocity.accept(0.3, 0.0, 0.0, is_busy=False)
        velocity.accept(math.nan, 0.0, 0.0, is_busy=False)
    assert go2.walk()
    velocity.accept(0.3, 0.0, math.inf, is_busy=False)
    velocity.accept(0.3, 0.0, 0.0, is_busy=True)
    assert go2.command.is_zero
    velocity.accept(9.0, 0.0, 0.0, is_busy=False)
    assert go2.command.linear_x == pytest.approx(VelocityEnvelope().forward)
    counts = velocity.counts
    assert (counts["received"], counts["followed"]) == (13, 1)
    assert (counts["not_finite"], counts["out_of_mode"]) == (6, 6)
    warnings = [record.message for record in caplog.records if "cmd_vel" in record.message]
    assert len(warnings) == 3


LEVEL_QUATERNION = (0.0, 0.0, 0.0, 1.0)


def test_a_pose_lasts_beyond_the_velocities(go2: GO2Controller, velocity: VelocityInput) -> None:
    velocity.accept_pose(-0.03, tuple(quaternion_from_rpy(0.1, -0.05, 0.15).tolist()))
    assert go2.walk()
    velocity.accept(0.3, 0.0, 0.0, is_busy=False)
    pose = go2.body_pose
    assert pose.row == pytest.approx([-0.03, 0.1, -0.05, 0.15])
    velocity.end()
    assert go2.command.is_zero
    assert go2.body_pose == pose
    velocity.accept_pose(0.0, LEVEL_QUATERNION)
    assert go2.body_pose == LEVEL


@pytest.mark.parametrize(
    ("height", "quaternion"),
    [
        (math.nan, LEVEL_QUATERNION),
        (-0.5, LEVEL_QUATERNION),
        (0.0, (math.inf, 0.0, 0.0, 1.0)),
        (0.0, (1.0, 0.0, 0.0, 1.0)),  # a quarter turn
    ],
)
def test_a_pose_that_cannot_be_taken_is_counted_and_changes_nothing(
    height: float,
    quaternion: tuple[float, float, float, float],
    go2: GO2Controller,
    velocity: VelocityInput,
) -> None:
    assert go2.walk()
    velocity.accept_pose(0.01, (0.0, 0.0, 0.0, 0.0))  # nobody has set the orientation
    velocity.accept_pose(height, quaternion)
    assert go2.body_pose == BodyPose(0.01)
    assert velocity.counts["poses_refused"] == 1
