"""Each call of the sport service does what Unitree's does, or is answered why not."""

import json
import time
from collections.abc import Iterator

import numpy as np
import pytest

from controller.bridges.unitree.sport_api import (
    LEASE_TERM,
    PATH_FIELDS,
    PATH_POINTS,
    SWITCHER_SERVICE,
    Api,
    Code,
    SportMode,
    SwitcherApi,
)
from controller.bridges.unitree.sport_robot import POSE
from controller.bridges.unitree.sport_service import PATIENCE
from tests.controller.bridges.processes import wait_until
from tests.controller.bridges.unitree.scenes import WatchedScene, watched
from tests.controller.bridges.unitree.support import needs_dds
from tests.controller.bridges.unitree_processes import client_of

pytestmark = [needs_dds, pytest.mark.slow]
FRONT = slice(0, 2)  # of the feet in Unitree's order: FR FL RR RL
FAST = json.dumps({"x": 3.8, "y": 0.0, "z": 0.0})
LIMIT = 60.0  # s; only ends a test that hangs


@pytest.fixture(scope="module")
def simulated() -> Iterator[WatchedScene]:
    with watched() as at:
        yield at


@pytest.fixture
def at(simulated: WatchedScene) -> WatchedScene:
    """A robot that stands, ready for anything."""
    simulated.stand_up()
    return simulated


def progress(at: WatchedScene) -> float:
    return float(at.now()["progress"][0])


def while_acting(at: WatchedScene) -> Iterator[None]:
    """As long as the action goes on; one that never ends fails."""
    deadline = time.monotonic() + LIMIT
    while progress(at):
        assert time.monotonic() < deadline
        yield


def passing(at: WatchedScene, seconds: float) -> Iterator[None]:
    """Again and again until so much of the robot's own time has passed."""
    deadline, end = time.monotonic() + LIMIT, robot_time(at) + seconds
    while robot_time(at) < end:
        assert time.monotonic() < deadline
        yield


def robot_time(at: WatchedScene) -> float:
    stamp = at.now()["stamp"][0]
    return float(stamp["sec"]) + 1e-9 * float(stamp["nanosec"])


def rpy(at: WatchedScene) -> np.ndarray:
    return np.array(at.now()["imu_state"]["rpy"][0])


def begin(at: WatchedScene, api: Api) -> None:
    """Start an action that takes longer than its answer."""
    assert at.call(api) == Code.OK
    assert progress(at) == 1


def test_after_stand_up_it_does_not_walk_until_balance_stand(simulated: WatchedScene) -> None:
    at = simulated
    assert at.call(Api.STAND_UP) == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.JOINT_LOCK
    assert at.call(Api.MOVE, FAST) == Code.OK
    for _ in passing(at, 0.5):
        assert at.speed < 0.05
    assert at.call(Api.BALANCE_STAND) == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.BALANCE_STAND


def test_sit_and_rise(at: WatchedScene) -> None:
    assert at.call(Api.RISE_SIT) == Code.NOT_READY  # it does not sit
    assert at.call(Api.SIT) == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.SIT
    assert rpy(at)[1] < -0.4
    assert at.call(Api.HELLO) == Code.NOT_READY
    assert at.call(Api.EULER, '{"x": 0, "y": 0, "z": 0}') == Code.NOT_READY
    assert at.call(Api.RISE_SIT) == Code.OK
    at.wait_for_rest()
    at.require_standing()


@pytest.mark.parametrize("api", [Api.HELLO, Api.SCRAPE])
def test_a_front_paw_is_raised_and_put_back(at: WatchedScene, api: Api) -> None:
    begin(at, api)
    least = np.inf
    for _ in while_acting(at):
        least = min(least, float(at.now()["foot_force"][0, FRONT].min()))
    assert least == 0.0
    at.require_standing()
    assert at.now()["error_code"][0] == Code.OK


@pytest.mark.parametrize(
    ("api", "axis", "least"),
    [
        (Api.CONTENT, 0, 0.08),
        (Api.WIGGLE_HIPS, 1, 0.08),
        (Api.HEART, 1, 0.08),
        (Api.STRETCH, 1, 0.15),
    ],
)
def test_it_bows_or_shows_how_it_feels_and_stands_again(
    at: WatchedScene, api: Api, axis: int, least: float
) -> None:
    begin(at, api)
    most = np.zeros(3)
    for _ in while_acting(at):
        most = np.maximum(most, np.abs(rpy(at)))
    assert most[axis] > least
    at.require_standing()
    assert at.now()["error_code"][0] == Code.OK


def test_a_path_is_followed_in_the_frame_of_the_state(at: WatchedScene) -> None:
    x0, y0, _ = at.now()["position"][0]
    yaw0 = rpy(at)[2]
    c, s = np.cos(yaw0), np.sin(yaw0)
    times = np.linspace(0.0, 4.0, PATH_POINTS)
    ahead, aside, turned = 0.25 * times, 0.05 * times, 0.1 * times
    rows = np.column_stack(
        [
            times,
            x0 + c * ahead - s * aside,
            y0 + s * ahead + c * aside,
            yaw0 + turned,
            np.full(PATH_POINTS, c * 0.25 - s * 0.05),
            np.full(PATH_POINTS, s * 0.25 + c * 0.05),
            np.full(PATH_POINTS, 0.1),
        ]
    )
    path = [dict(zip(PATH_FIELDS, row, strict=True)) for row in rows.tolist()]
    assert at.call(Api.TRAJECTORY_FOLLOW, json.dumps(path)) == Code.OK
    for _ in passing(at, 7.0):
        pass
    place = at.now()["position"][0][:2]
    assert np.linalg.norm(place - rows[-1, 1:3]) < 0.05
    assert np.sin(rpy(at)[2] - rows[-1, 3]) == pytest.approx(0.0, abs=0.06)
    assert at.speed < 0.1


def test_trot_run_walks_and_the_speed_level_can_be_asked_for(at: WatchedScene) -> None:
    assert at.call(Api.TROT_RUN) == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.LOCOMOTION
    assert at.call(Api.SPEED_LEVEL, '{"data": -1}') == Code.OK
    assert json.loads(at.client.call(Api.GET_SPEED_LEVEL, "").data) == {"data": -1}
    assert at.call(Api.SPEED_LEVEL, '{"data": 0}') == Code.OK


def test_pose_is_held_until_it_is_taken_back(at: WatchedScene) -> None:
    assert at.call(Api.POSE, '{"data": true}') == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.POSE
    assert rpy(at)[:2] == pytest.approx(POSE[:2], abs=0.05)
    assert at.call(Api.POSE, '{"data": false}') == Code.OK
    at.wait_for_rest()
    assert at.mode == SportMode.BALANCE_STAND
    assert rpy(at)[:2] == pytest.approx([0.0, 0.0], abs=0.03)


@pytest.mark.parametrize(
    ("angles", "code"),
    [
        ((0.1, 0.15, 0.1), Code.OK),
        ((0.8, 0.0, 0.0), Code.POSE_REFUSED),  # beyond Unitree's range
        ((0.74, 0.74, 0.59), Code.POSE_REFUSED),  # within it, beyond the legs'
    ],
)
def test_an_attitude_is_taken_or_refused(
    at: WatchedScene, angles: tuple[float, float, float], code: Code
) -> None:
    before = rpy(at)
    assert at.call(Api.EULER, json.dumps(dict(zip("xyz", angles, strict=True)))) == code
    at.wait_for_rest()
    there = angles if code == Code.OK else before
    assert rpy(at)[:2] == pytest.approx(there[:2], abs=0.06)


@pytest.mark.parametrize(("level", "speed"), [(-1, 0.6), (0, 1.05)])
def test_the_speed_level_bounds_move(at: WatchedScene, level: int, speed: float) -> None:
    assert at.call(Api.SPEED_LEVEL, json.dumps({"data": level})) == Code.OK
    for _ in passing(at, 3.0):
        at.client.send(Api.MOVE, FAST)
    assert at.speed == pytest.approx(speed, abs=0.1)
    assert at.call(Api.STOP_MOVE) == Code.OK
    assert at.call(Api.SPEED_LEVEL, '{"data": 0}') == Code.OK


def test_an_action_that_meets_a_long_one_waits_a_while_then_is_refused(at: WatchedScene) -> None:
    begin(at, Api.DANCE1)
    start = time.monotonic()
    assert at.call(Api.HELLO) == Code.NOT_READY
    assert time.monotonic() - start > 0.9 * PATIENCE
    assert progress(at) == 1
    assert at.call(Api.DAMP) == Code.OK
    at.require_lying()
    assert at.now()["error_code"][0] == Code.ACTION_TIMEOUT


def test_who_has_the_lease_has_the_robot_until_it_ends(at: WatchedScene) -> None:
    lease = client_of(at.bus, "sport_lease")

    def codes_during_a_lease() -> list[int]:
        """Of a stop and another lease; none if the machine paused for as long as the lease."""
        start = time.monotonic()
        assert lease.call(Api.LEASE_APPLY, '{"name": "somebody else"}').code == Code.OK
        codes = [at.call(Api.STOP_MOVE), lease.call(Api.LEASE_APPLY, '{"name": "me"}').code]
        was_in_time = time.monotonic() - start < LEASE_TERM
        assert wait_until(lambda: at.call(Api.STOP_MOVE) == Code.OK, LIMIT)
        return codes if was_in_time else []

    codes: list[int] = []
    assert wait_until(lambda: bool(codes.extend(codes_during_a_lease()) or codes), LIMIT)
    assert codes == [Code.LEASE_DENIED, Code.LEASE_EXIST]


def test_the_switcher_releases_a_robot_that_lies_only(at: WatchedScene) -> None:
    switcher = client_of(at.bus, SWITCHER_SERVICE)
    assert json.loads(switcher.call(SwitcherApi.CHECK_MODE).data)["name"] == "normal"
    assert switcher.call(SwitcherApi.RELEASE_MODE).code == Code.NOT_READY
    assert at.call(Api.STAND_DOWN) == Code.OK
    at.wait_for_rest()
    assert wait_until(lambda: switcher.call(SwitcherApi.RELEASE_MODE).code == Code.OK, LIMIT)
    assert json.loads(switcher.call(SwitcherApi.CHECK_MODE).data)["name"] == ""
    assert at.call(Api.STAND_UP) == Code.NOT_READY
    assert switcher.call(SwitcherApi.SELECT_MODE, '{"name": "normal"}').code == Code.OK
    at.stand_up()


@pytest.mark.parametrize("api", [1011, 1021, 1030, 1042, 2044, 2049])
def test_what_the_library_lacks_is_not_supported(simulated: WatchedScene, api: int) -> None:
    assert simulated.call(api) == Code.NOT_SUPPORTED


@pytest.mark.parametrize(
    ("api", "parameter"),
    [
        (Api.MOVE, '{"x": NaN, "y": 0, "z": 0}'),
        (Api.MOVE, '{"x": 1}'),
        (Api.EULER, "rubbish"),
        (Api.POSE, '{"data": "yes"}'),
        (Api.SPEED_LEVEL, '{"data": 7}'),
        (Api.TRAJECTORY_FOLLOW, "[]"),
        (Api.AUTO_RECOVERY_SET, '{"data": 0.5}'),
    ],
)
def test_a_parameter_that_is_wrong_is_refused(
    simulated: WatchedScene, api: Api, parameter: str
) -> None:
    assert simulated.call(api, parameter) == Code.BAD_PARAMETER
