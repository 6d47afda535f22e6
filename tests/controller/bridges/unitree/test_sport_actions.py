"""The sport service on a robot that obeys the test: order and codes of answers. Needs no DDS."""

import json
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import create_autospec

import pytest

from controller.bridges.unitree import sport_api, sport_robot, sport_service
from controller.bridges.unitree.messages import Request
from controller.bridges.unitree.sport_api import Api, Code, SportMode
from controller.bridges.unitree.sport_robot import MOTIONS, WALKS, SportRobot
from controller.bridges.unitree.sport_service import WAITING, SportService
from controller.modes import Aborted, Mode
from controller.navigation import APPROACH
from go2_wbc.contacts import GAITS
from go2_wbc.errors import ClosedError, CommandError, MissingDependency, PlantError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion, motion_names
from tests.controller.bridges.processes import wait_until
from tests.controller.plants import HANG_GUARD, lying_state, wait_for

LEAN = '{"x": 0.1, "y": 0.1, "z": 0.0}'


class Stage:
    """A service, its robot, and what it has answered."""

    def __init__(self) -> None:
        self.robot: Any = create_autospec(SportRobot, instance=True)
        self.robot.state, self.robot.mode = lying_state(0.0), Mode.STANDING
        self.robot.is_locked = self.robot.is_leaning = False
        self.robot.excess.return_value = 0, ""
        self.robot.pose = LEVEL
        self.robot.unsupported = frozenset({Api.FRONT_JUMP})
        self.robot.damp.side_effect = lambda: self.is_limp.set()
        self.is_limp, self.is_released = threading.Event(), False
        self.service = SportService(self.robot, lambda: self.is_released)
        self.codes: list[tuple[str, int]] = []
        self.data = ""
        self.news = threading.Condition()

    def ask(self, api: Api, parameter: str = "", name: str = "") -> None:
        def reply(code: int, data: str) -> None:
            with self.news:
                self.data = data
                self.codes.append((name or api.name, code))
                self.news.notify_all()

        self.service.handle(Request(1, api, parameter=parameter), reply)

    def answers(self, count: int) -> list[tuple[str, int]]:
        """The first answers, in the order in which they came; waits for them."""
        with self.news:
            assert self.news.wait_for(lambda: len(self.codes) >= count, HANG_GUARD)
            return self.codes[:count]

    def code(self, api: Api, parameter: str = "") -> int:
        """The answer to a request with nothing before it."""
        count = len(self.codes)
        self.ask(api, parameter)
        return self.answers(count + 1)[-1][1]

    def acting(self, api: Api, meanwhile: Callable[[], None]) -> None:
        """Do something in the middle of an action."""
        self.robot.perform.side_effect = lambda _api: meanwhile()
        self.ask(api)


@pytest.fixture
def stage() -> Iterator[Stage]:
    stage = Stage()
    yield stage
    stage.service.close()


def test_an_action_is_answered_when_it_is_done(stage: Stage) -> None:
    assert stage.code(Api.SIT) == Code.OK
    stage.robot.perform.assert_called_once_with(Api.SIT)


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (Aborted("sit not done"), Code.ACTION_TIMEOUT),
        (ClosedError("closed"), Code.INTERNAL),
        (ValueError("a bug"), Code.INTERNAL),
    ],
)
def test_an_action_that_was_not_done_is_answered_why(
    stage: Stage, error: Exception, code: Code
) -> None:
    stage.robot.perform.side_effect = error
    assert stage.code(Api.SIT) == code
    assert stage.service.status.error_code == code
    stage.robot.perform.side_effect = None
    assert stage.code(Api.SIT) == Code.OK
    assert stage.service.status.error_code == 0


def test_a_robot_whose_loop_has_ended_cannot_begin(stage: Stage) -> None:
    stage.robot.begin.side_effect = PlantError("the loop has ended")
    assert stage.code(Api.SIT) == Code.INTERNAL
    stage.robot.perform.assert_not_called()


@pytest.mark.parametrize(
    ("mode", "api", "code"),
    [
        (Mode.STANDING, Api.RISE_SIT, Code.NOT_READY),
        (Mode.SITTING, Api.HELLO, Code.NOT_READY),
        (Mode.FALLEN, Api.STAND_UP, Code.NOT_READY),
        (Mode.FALLEN, Api.RECOVERY_STAND, Code.OK),
        (Mode.LYING, Api.STAND_UP, Code.OK),
    ],
)
def test_an_action_begins_only_from_where_it_can(
    stage: Stage, mode: Mode, api: Api, code: Code
) -> None:
    stage.robot.mode = mode
    assert stage.code(api) == code
    assert stage.robot.perform.called == (code == Code.OK)


def test_low_level_commands_keep_the_robot_from_the_service(stage: Stage) -> None:
    stage.acting(Api.DANCE1, lambda: setattr(stage, "is_released", True))
    stage.ask(Api.SIT)  # the robot is taken while this one waits
    assert dict(stage.answers(2))["SIT"] == Code.NOT_READY
    assert stage.code(Api.STOP_MOVE) == Code.NOT_READY
    assert stage.code(Api.DAMP) == Code.OK


def test_an_attitude_is_checked_after_the_action_has_begun(stage: Stage) -> None:
    # What Damp must end is an action that has begun: the check takes a third of a second.
    def check(_rpy: object) -> bool:
        stage.robot.begin.assert_called_once()
        stage.ask(Api.DAMP)
        return True

    stage.robot.can_lean_to.side_effect = check
    stage.robot.lean_to.side_effect = Aborted("damped")
    stage.ask(Api.EULER, LEAN)
    assert stage.answers(2) == [("DAMP", Code.OK), ("EULER", Code.ACTION_TIMEOUT)]


def test_an_attitude_out_of_reach_is_refused(stage: Stage) -> None:
    stage.robot.can_lean_to.return_value = False
    assert stage.code(Api.EULER, LEAN) == Code.POSE_REFUSED
    stage.robot.lean_to.assert_not_called()


def test_what_is_asked_of_a_rising_robot_is_done_at_the_end_of_the_same_action(
    stage: Stage,
) -> None:
    asked = iter((Api.BALANCE_STAND, Api.STAND_UP))

    def meanwhile() -> None:
        for api in asked:
            stage.ask(api)
            assert stage.codes[-1] == (api.name, Code.OK)

    stage.acting(Api.STAND_UP, meanwhile)
    assert [name for name, _ in stage.answers(3)] == ["BALANCE_STAND", "STAND_UP", "STAND_UP"]
    performed = [call.args[0] for call in stage.robot.perform.call_args_list]
    assert performed == [Api.STAND_UP, Api.BALANCE_STAND]


def test_after_the_patience_a_running_action_has_begun_and_a_waiting_one_is_refused(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_over = threading.Event()
    monkeypatch.setattr(stage.service._jobs, "_patience", -1.0)
    stage.acting(Api.DANCE1, lambda: wait_for(is_over))
    stage.ask(Api.HELLO)
    stage.service.patrol()
    assert stage.answers(2) == [("DANCE1", Code.OK), ("HELLO", Code.NOT_READY)]
    assert stage.service.status.is_acting
    is_over.set()
    assert sport_service.PATIENCE < 1.0  # s; Unitree's clients wait so long


def test_so_many_requests_may_wait_and_damp_answers_all_of_them(stage: Stage) -> None:
    has_begun = threading.Event()

    def dance() -> None:
        has_begun.set()
        wait_for(stage.is_limp)
        raise Aborted("damped")

    stage.acting(Api.DANCE1, dance)
    wait_for(has_begun)
    for number in range(WAITING):
        stage.ask(Api.HELLO, name=str(number))
    assert stage.codes == []
    stage.ask(Api.HELLO, name="too many")
    assert stage.answers(1) == [("too many", Code.NOT_READY)]
    stage.ask(Api.DAMP)
    codes = dict(stage.answers(WAITING + 3))
    assert codes.pop("DAMP") == Code.OK
    assert codes.pop("DANCE1") == Code.ACTION_TIMEOUT
    assert set(codes.values()) == {Code.NOT_READY}
    assert [call.args for call in stage.robot.perform.call_args_list] == [(Api.DANCE1,)]


def test_the_mode_is_that_of_the_action_that_runs(stage: Stage) -> None:
    modes: list[SportMode] = []
    stage.acting(Api.SIT, lambda: modes.append(stage.service.status.mode))
    stage.answers(1)
    assert modes == [SportMode.SIT]
    assert stage.service.status.mode == SportMode.BALANCE_STAND
    stage.robot.is_locked = True
    assert stage.service.status.mode == SportMode.JOINT_LOCK


def test_a_move_that_meets_a_standing_robot_starts_to_walk_first(stage: Stage) -> None:
    started = threading.Event()
    stage.robot.perform.side_effect = lambda _api: started.set()
    assert stage.code(Api.MOVE, LEAN) == Code.OK
    wait_for(started)
    stage.robot.perform.assert_called_once_with(Api.MOVE)
    stage.robot.steer.assert_not_called()


def test_what_the_library_has_no_motion_for_is_not_supported(stage: Stage) -> None:
    assert stage.code(Api.FRONT_JUMP) == Code.NOT_SUPPORTED
    assert stage.code(Api.FRONT_POUNCE) == Code.OK
    assert [call.args for call in stage.robot.perform.call_args_list] == [(Api.FRONT_POUNCE,)]


def test_at_least_twenty_eight_calls_do_what_they_say() -> None:
    assert WALKS[Api.FREE_BOUND] == "bound"
    there = motion_names()
    calls = {api for api in Api if api >= Api.DAMP}
    lacking = {api for api, name in MOTIONS.items() if name not in there}
    lacking |= {api for api, gait in WALKS.items() if gait not in GAITS}
    assert len(calls - lacking) >= 28


def test_a_motion_that_cannot_be_compiled_here_is_not_supported(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    plan = compile_timeline(load_motion("bow"), RobotModel())

    def compiled(name: str, _model: RobotModel) -> MotionPlan:
        if name == "heart":
            raise MissingDependency("install the extra")
        return plan

    monkeypatch.setattr(sport_robot, "compile_motion", compiled)
    plans = sport_robot.playable_plans(RobotModel())
    assert Api.HEART not in plans
    assert Api.HELLO in plans
    assert Api.FRONT_JUMP in plans or MOTIONS[Api.FRONT_JUMP] not in motion_names()
    assert "HEART will not be supported: install the extra" in caplog.text


@pytest.mark.parametrize(
    ("api", "after"), [(Api.CROSS_STEP, Api.BALANCE_STAND), (Api.FREE_BOUND, Api.TROT_RUN)]
)
def test_what_is_switched_on_is_switched_off_again(stage: Stage, api: Api, after: Api) -> None:
    assert stage.code(api, '{"data": true}') == Code.OK
    assert stage.code(api, '{"data": false}') == Code.OK
    assert [call.args[0] for call in stage.robot.perform.call_args_list] == [api, after]
    with pytest.raises(CommandError, match="true or false"):
        stage.ask(api, "{}")


def test_the_speed_level_and_the_recovery_can_be_asked_for(stage: Stage) -> None:
    for api, value in ((Api.GET_SPEED_LEVEL, 0), (Api.AUTO_RECOVERY_GET, False)):
        assert stage.code(api) == Code.OK
        assert json.loads(stage.data) == {"data": value}
    assert stage.code(Api.SPEED_LEVEL, '{"data": 1}') == Code.OK
    assert stage.code(Api.AUTO_RECOVERY_SET, '{"data": true}') == Code.OK
    for api, value in ((Api.GET_SPEED_LEVEL, 1), (Api.AUTO_RECOVERY_GET, True)):
        assert stage.code(api) == Code.OK
        assert json.loads(stage.data) == {"data": value}


def recoveries(stage: Stage) -> int:
    """How often the robot has been told to get up, once what was asked is over."""
    stage.service.patrol()
    stage.ask(Api.SIT)  # answered after what came before it
    stage.answers(len(stage.codes) + 1)
    return [call.args[0] for call in stage.robot.perform.call_args_list].count(Api.RECOVERY_STAND)


def test_a_fallen_robot_gets_up_by_itself_once_if_it_was_asked_to(stage: Stage) -> None:
    stage.robot.mode = Mode.FALLEN
    assert recoveries(stage) == 0
    assert stage.code(Api.AUTO_RECOVERY_SET, '{"data": true}') == Code.OK
    assert recoveries(stage) == 1
    assert recoveries(stage) == 1  # it has not got up: not again and again
    stage.robot.mode = Mode.DAMPED  # by Damp, which is no fall
    assert recoveries(stage) == 1
    stage.robot.mode = Mode.FALLEN
    assert recoveries(stage) == 2


def path_ahead(*, end: float = 1.0) -> str:
    point = dict.fromkeys(sport_api.PATH_FIELDS, 0.0)
    return json.dumps([point, {**point, "t_from_start": end, "x": 0.5, "vx": 0.5}])


def test_a_path_is_followed_until_it_ends_or_something_else_is_asked(stage: Stage) -> None:
    robot = stage.robot
    assert stage.code(Api.TRAJECTORY_FOLLOW, path_ahead()) == Code.OK
    assert wait_until(lambda: stage.service._jobs.job is None, HANG_GUARD)
    robot.perform.assert_called_once_with(Api.MOVE)
    robot.mode = Mode.WALKING
    stage.service.patrol()
    robot.state = replace(robot.state, time=0.5)
    stage.service.patrol()
    command, share = robot.steer.call_args.args
    assert (command.linear_x, share) == (pytest.approx(0.25 + APPROACH * 0.25), 1.0)
    assert stage.code(Api.STOP_MOVE) == Code.OK
    assert robot.steer.call_args.args[0].is_zero
    assert stage.code(Api.TRAJECTORY_FOLLOW, path_ahead(end=0.1)) == Code.OK
    assert stage.code(Api.MOVE, '{"x": 0.3, "y": 0, "z": 0}') == Code.OK
    stage.service.patrol()
    assert robot.steer.call_args.args[0].linear_x == 0.3
    assert stage.code(Api.TRAJECTORY_FOLLOW, path_ahead(end=9.0)) == Code.OK
    assert stage.code(Api.STAND_DOWN) == Code.OK
    stage.service.patrol()
    assert robot.steer.call_args.args[0].linear_x == 0.3  # Move's still, and no path's


@pytest.mark.parametrize(
    "path",
    [
        "",
        "[]",
        "{}",
        "[3]",
        '[{"t_from_start": 0, "x": 0}]',
        path_ahead(end=0.0),
        path_ahead(end=-1.0),
        path_ahead().replace("0.5", "NaN"),
        path_ahead().replace("0.5", "1e7"),
        json.dumps([dict.fromkeys(sport_api.PATH_FIELDS, 0.0)] * 31),
    ],
)
def test_a_path_that_is_none_is_refused(stage: Stage, path: str) -> None:
    with pytest.raises(CommandError):
        stage.ask(Api.TRAJECTORY_FOLLOW, path)


def test_a_walking_robot_takes_an_attitude_on_its_way(stage: Stage) -> None:
    # It stopped, stood and leaned.
    stage.robot.mode, stage.robot.can_hold.return_value = Mode.WALKING, True
    assert stage.code(Api.BODY_HEIGHT, '{"data": -0.03}') == Code.OK
    assert stage.code(Api.EULER, LEAN) == Code.OK
    assert stage.robot.pose == BodyPose(-0.03, 0.1, 0.1, 0.0)
    stage.robot.lean_to.assert_not_called()
    stage.robot.perform.assert_not_called()


def test_an_attitude_that_is_not_held_on_the_way_is_taken_standing(stage: Stage) -> None:
    stage.robot.mode, stage.robot.can_hold.return_value = Mode.WALKING, False
    assert stage.code(Api.EULER, LEAN) == Code.OK
    stage.robot.lean_to.assert_called_once_with((0.1, 0.1, 0.0))
    assert stage.robot.pose == LEVEL


@pytest.mark.parametrize(
    ("parameter", "code"),
    [('{"data": 0.05}', Code.BAD_PARAMETER), ('{"data": -0.15}', Code.POSE_REFUSED)],
)
def test_a_height_beyond_a_range_is_refused(stage: Stage, parameter: str, code: Code) -> None:
    stage.robot.can_hold.return_value = False
    if code is Code.BAD_PARAMETER:
        with pytest.raises(CommandError, match=r"-0\.18 to 0\.03 m, got 0\.05"):
            stage.ask(Api.BODY_HEIGHT, parameter)
    else:
        assert stage.code(Api.BODY_HEIGHT, parameter) == code
    assert stage.robot.pose == LEVEL
