"""The server as others see it: plain rclpy in another process than the robot's."""

import math
import signal
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest

from go2_wbc.plant.sensors import EXACT
from tests.controller.bridges.processes import Process, wait_until
from tests.controller.bridges.ros2_graph import needs_ros2
from tests.controller.bridges.ros2_probe import Place, WatchingProbe, without
from tests.controller.bridges.ros2_processes import ANSWER, DISCOVERY, serving

pytestmark = needs_ros2

AT_REST = 0.008  # m in half a second: the trunk still goes over its feet, at 10 mm/s
SPEED_TOLERANCE = 0.02  #: Share of the commanded speed, over several strides
DRIVES = 4
"""How often a busy machine gets the chance to send commands without a gap of half a second."""
RATE_TOLERANCE = 0.05
"""Share of a rate: a few messages are on their way when the counting begins and ends."""


def test_a_behaviour_is_answered_when_odometry_bears_it_out(probe: WatchingProbe) -> None:
    low = probe.height()
    answer = probe.call("UP")
    assert answer.success, answer.message
    assert probe.height() > 0.29 > low
    assert probe.statistics()["position"] == pytest.approx(probe.state().q[:3], abs=0.01)
    answer = probe.call("Sit")
    assert answer.success, answer.message
    assert probe.height() == pytest.approx(0.235, abs=0.02)


def test_velocities_are_real_ones_and_end_with_silence(probe: WatchingProbe) -> None:
    assert probe.call("walk").success
    start, end = driven(probe, 5.0, 0.3)
    assert end.speed_from(start) == pytest.approx(0.3, rel=SPEED_TOLERANCE)
    before = probe.statistics()["cmd_vel"]
    probe.let_pass(1.5)
    resting = probe.place()
    probe.let_pass(0.5)
    assert probe.place().way_from(resting) < AT_REST
    after = probe.statistics()["cmd_vel"]
    assert after["silences"] == before["silences"] + 1
    assert after["followed"] == before["followed"]


def driven(
    probe: WatchingProbe, seconds: float, x: float, turn: float = 0.0, *, y: float = 0.0
) -> tuple[Place, Place]:
    """Start and end of a drive without a gap; if the machine made one, of another drive."""
    for left in reversed(range(DRIVES)):
        probe.drive(1.0, x, turn, y=y)
        silences, start = probe.statistics()["cmd_vel"]["silences"], probe.place()
        probe.drive(seconds, x, turn, y=y)
        end = probe.place()
        if probe.statistics()["cmd_vel"]["silences"] == silences or not left:
            return start, end
    raise AssertionError("no drive")


def test_an_order_ends_the_velocity_that_came_before_it(probe: WatchingProbe) -> None:
    # A robot that was told to walk while it walked forgot to stop when the commands ceased.
    assert probe.call("walk").success
    probe.drive(1.0, 0.3)
    assert probe.call("walk").success
    probe.let_pass(1.5)
    resting = probe.place()
    probe.let_pass(0.5)
    assert probe.place().way_from(resting) < AT_REST


def test_sideways_and_turning_velocities_are_followed_too(probe: WatchingProbe) -> None:
    assert probe.call("walk").success
    start, end = driven(probe, 3.0, 0.0, 0.5)
    turned = math.remainder(end.yaw - start.yaw, math.tau)
    assert turned / (end.time - start.time) == pytest.approx(0.5, rel=0.05)
    start, end = driven(probe, 3.0, 0.0, y=0.2)
    dx, dy = end.xy[0] - start.xy[0], end.xy[1] - start.xy[1]
    aside = -math.sin(start.yaw) * dx + math.cos(start.yaw) * dy
    assert aside / (end.time - start.time) == pytest.approx(0.2, rel=0.1)


def test_every_topic_comes_at_its_rate(probe: WatchingProbe) -> None:
    first = probe.statistics()
    probe.let_pass(3.0)
    second = probe.statistics()
    time_passed = second["robot_time"] - first["robot_time"]
    rates = {
        name: (second["published"][name] - first["published"][name]) / time_passed
        for name in second["published"]
    }
    expected = dict.fromkeys(("joint_states", "odom", "imu", "foot_contact"), 100.0)
    assert rates.pop("/tf") == pytest.approx(50.0, rel=RATE_TOLERANCE)
    assert rates.keys() == {f"/robot1/{name}" for name in expected}
    assert all(rate == pytest.approx(100.0, rel=RATE_TOLERANCE) for rate in rates.values())
    assert second["errors"] == 0


def test_the_messages_say_what_a_standing_robot_measures(probe: WatchingProbe) -> None:
    from quadropted_msgs.msg import RobotFootContact
    from sensor_msgs.msg import Imu, JointState
    from tf2_msgs.msg import TFMessage

    assert probe.call("up").success
    heard = listen(
        probe,
        {
            "joint_states": (JointState, "/robot1/joint_states"),
            "imu": (Imu, "/robot1/imu"),
            "contacts": (RobotFootContact, "/robot1/foot_contact"),
            "tf": (TFMessage, "/tf"),
        },
    )
    joints = heard["joint_states"]
    assert joints.name[:3] == ["FL_hip_joint", "FL_thigh_joint", "FL_calf_joint"]
    assert len(joints.position) == len(joints.velocity) == len(joints.effort) == 12
    assert heard["imu"].linear_acceleration.z == pytest.approx(9.81, abs=0.5)
    assert list(heard["contacts"].contacts) == [True] * 4
    (transform,) = heard["tf"].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == (
        "robot1/odom",
        "robot1/base_link",
    )
    assert transform.transform.translation.z == pytest.approx(probe.height(), abs=0.01)


def test_odometry_says_how_sure_it_is_and_a_pose_is_taken_on_the_way(probe: WatchingProbe) -> None:
    from geometry_msgs.msg import Pose
    from nav_msgs.msg import Odometry

    odometry = listen(probe, {"odom": (Odometry, "/robot1/odom")})["odom"]
    for covariance in (odometry.pose.covariance, odometry.twist.covariance):
        assert covariance == pytest.approx(EXACT**2 * np.eye(6).ravel())
    asked = Pose()
    asked.position.z = -0.04
    asked.orientation.x, asked.orientation.w = math.sin(0.05), math.cos(0.05)
    publisher = probe.node.create_publisher(Pose, "/robot1/body_pose", 10)
    assert wait_until(lambda: publisher.get_subscription_count() > 0, DISCOVERY)
    assert probe.call("walk").success
    before = probe.height()
    publisher.publish(asked)
    probe.drive(2.0, 0.2)
    assert probe.height() - before == pytest.approx(-0.04, abs=0.01)
    assert probe.state().rpy[0] == pytest.approx(0.1, abs=0.03)
    asked.position.z, asked.orientation.x, asked.orientation.w = 0.0, 0.0, 1.0
    publisher.publish(asked)
    probe.let_pass(1.0)


def listen(probe: WatchingProbe, topics: dict[str, tuple[Any, str]]) -> dict[str, Any]:
    heard: dict[str, Any] = {}
    for key, (kind, name) in topics.items():
        note = lambda message, key=key: heard.setdefault(key, message)  # noqa: E731
        probe.node.create_subscription(kind, name, note, 10)
    wait_until(lambda: len(heard) == len(topics), DISCOVERY)
    assert heard.keys() == topics.keys()
    return heard


def goal_of(probe: WatchingProbe, motion: str, *settings: str) -> tuple[Any, list[Any]]:
    """The goal's handle and the list that its feedback goes to."""
    from quadropted_msgs.action import PlayMotion
    from rclpy.action import ActionClient

    client, feedback = ActionClient(probe.node, PlayMotion, "/robot1/play_motion"), []
    assert client.wait_for_server(DISCOVERY)
    goal = PlayMotion.Goal(motion=motion, settings=list(settings))
    note = lambda message: feedback.append(message.feedback)  # noqa: E731
    return probe.result(client.send_goal_async(goal, feedback_callback=note)), feedback


def test_a_motion_has_feedback_with_progress_and_a_result(probe: WatchingProbe) -> None:
    handle, feedback = goal_of(probe, "nod", "times=1")
    assert handle.accepted
    answer = probe.result(handle.get_result_async())
    assert answer.status == 4  # succeeded
    assert answer.result.success, answer.result.message
    assert answer.result.duration > 1.0
    shares = [message.progress for message in feedback]
    assert shares == sorted(shares)
    assert shares[-1] > 0.5
    assert {message.phase for message in feedback} >= {"playing"}


def test_a_high_five_that_is_cancelled_ends_standing(probe: WatchingProbe) -> None:
    assert probe.call("up").success
    handle, feedback = goal_of(probe, "high_five", "hold=5.0")
    assert wait_until(lambda: bool(feedback) and feedback[-1].progress >= 0.4, ANSWER)
    busy, _ = goal_of(probe, "nod")
    assert not busy.accepted
    probe.result(handle.cancel_goal_async())
    answer = probe.result(handle.get_result_async())
    assert answer.status == 5  # canceled
    assert not answer.result.success
    assert probe.statistics()["mode"] == "standing"
    assert feedback[-1].phase == "returning"


def test_a_motion_that_does_not_exist_is_aborted_with_the_names(probe: WatchingProbe) -> None:
    handle, _ = goal_of(probe, "levitate")
    answer = probe.result(handle.get_result_async())
    assert answer.status == 6  # aborted
    assert "unknown motion 'levitate'; valid: beckon," in answer.result.message


@pytest.fixture(scope="module")
def free_runners(
    graph: None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Process, Process]]:
    """robot3 runs freely; so does robot4, which has no interfaces and no display either."""
    poor = without(tmp_path_factory.mktemp("hollow"), "quadropted_msgs", "tf2_msgs")
    poor |= {"DISPLAY": "", "WAYLAND_DISPLAY": ""}
    with (
        serving(namespace="robot3", realtime=False) as rich,
        serving("--viewer", namespace="robot4", realtime=False, environment=poor) as second,
    ):
        yield rich, second


def test_free_running_time_is_the_clock(free_runners: tuple[Process, Process]) -> None:
    from rosgraph_msgs.msg import Clock

    with closing(WatchingProbe("robot3")) as probe:
        assert probe.call("up").success
        first = listen(probe, {"clock": (Clock, "/clock")})["clock"].clock
        probe.let_pass(0.5)
        before = probe.place().time
        stamp = probe.state().time
        assert first.sec + 1e-9 * first.nanosec < stamp
        assert before - 1.0 <= stamp <= probe.place().time


def test_the_clock_is_left_to_the_first_of_two_servers(
    free_runners: tuple[Process, Process],
) -> None:
    first, second = free_runners
    with closing(WatchingProbe("robot3")) as one, closing(WatchingProbe("robot4")) as other:
        assert one.trigger("up").success
        assert other.trigger("up").success
        assert "another process publishes /clock" in second.text
        assert "/clock" not in first.text
        assert one.statistics()["published"]["/clock"] > 0
        assert "/clock" not in other.statistics()["published"]
        (publisher,) = one.node.get_publishers_info_by_topic("/clock")
        assert publisher.node_namespace == "/robot3"


def test_a_viewer_without_a_display_is_one_line_and_the_robot_is_served(
    free_runners: tuple[Process, Process],
) -> None:
    _, second = free_runners
    assert second.text.count("no viewer: cannot open the viewer: there is no display") == 1
    assert "Traceback" not in second.text
    assert second.code is None


def test_without_the_interfaces_the_triggers_remain_and_the_server_says_so(
    free_runners: tuple[Process, Process],
) -> None:
    _, second = free_runners
    with closing(WatchingProbe("robot4")) as probe:
        assert probe.trigger("up").success
        assert "without quadropted_msgs and tf2_msgs" in second.text
        assert "ros2/build_interfaces.sh" in second.text
        assert "/robot4/sit" in second.text
        published = probe.statistics()["published"]
        assert "/robot4/odom" in published
        assert "/tf" not in published


def test_a_free_running_server_ends_well_too(free_runners: tuple[Process, Process]) -> None:
    for server in free_runners:
        server.stop(signal.SIGINT)
        assert server.code == 0


def test_two_robots_live_side_by_side(probe: WatchingProbe) -> None:
    with serving(namespace="robot2") as second, closing(WatchingProbe("robot2")) as other:
        assert other.call("up").success
        assert probe.call("sit").success
        assert other.height() > 0.29
        assert probe.height() == pytest.approx(0.235, abs=0.02)
        second.stop(signal.SIGINT)
        assert second.code == 0
