"""Whatever the middleware does, the robot stands or lies, and somebody says why."""

from __future__ import annotations

import math
import subprocess
import sys
import threading
import time

import pytest

from tests.controller.bridges.ros2_graph import (
    DISCOVERY,
    ROOT,
    Probe,
    Server,
    needs_ros2,
    serving,
    wait_until,
)

pytestmark = needs_ros2

WALKER = """
import time, rclpy
from controller.bridges.ros2 import GO2ControllerNode
rclpy.init()
go2 = GO2ControllerNode()
assert go2.walk()
go2.move(linear_x=0.3)
print("walking", flush=True)
time.sleep(60)
"""
RAISED = """
import rclpy
from controller.bridges.ros2 import GO2ControllerNode
rclpy.init()
go2 = GO2ControllerNode()
go2.play("high_five", {"hold": 3.0}, lambda share: print(share, flush=True))
"""


def client(code: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )


def first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def test_a_walking_robot_whose_client_is_killed_stops_and_stands(
    server: Server, probe: Probe
) -> None:
    walker = client(WALKER)
    try:
        assert first_line(walker).strip() == "walking"
        before = probe.pose()
        probe.spin(1.5)
        moving = probe.pose()
        assert math.dist(moving[:2], before[:2]) > 0.2
    finally:
        end(walker)
    probe.let_pass(2.0)
    resting = probe.place()
    probe.let_pass(0.5)
    assert math.dist(probe.place().xy, resting.xy) < 0.01
    assert probe.statistics()["mode"] == "walking"
    assert probe.call("sit").success


def test_a_high_five_whose_client_is_killed_is_finished(server: Server, probe: Probe) -> None:
    raiser = client(RAISED)
    try:
        while float(first_line(raiser) or "1") < 0.3:
            pass
    finally:
        end(raiser)
    refused = probe.call("up")
    assert "busy with 'high_five'" in refused.message
    wait = time.monotonic() + 30.0
    while probe.statistics()["mode"] == "moving" and time.monotonic() < wait:
        probe.spin(0.2)
    probe.spin(0.5)
    assert probe.statistics()["mode"] == "standing"
    assert probe.call("sit").success


def test_commands_at_five_kilohertz_do_no_harm(server: Server, probe: Probe) -> None:
    assert probe.call("walk").success
    before, sent, began = probe.statistics(), 0, time.monotonic()
    while time.monotonic() - began < 2.0:
        if sent < 5000.0 * (time.monotonic() - began):
            probe.move(0.2)
            sent += 1
    assert sent > 3000
    after = probe.statistics()
    assert after["mode"] == "walking"
    assert after["errors"] == before["errors"] == 0
    assert after["cmd_vel"]["received"] > before["cmd_vel"]["received"]
    assert probe.call("sit").success


def test_a_second_server_of_the_namespace_is_refused_and_the_first_goes_on(
    server: Server, probe: Probe
) -> None:
    second = Server("--realtime")
    try:
        assert second.process.wait(30.0) == 3
        assert "/robot1 is already served" in second.said
        assert "--namespace" in second.said
        assert "Traceback" not in second.said
    finally:
        second.kill()
    assert probe.call("up").success


def test_two_robots_live_side_by_side(server: Server, probe: Probe) -> None:
    with serving("--realtime", namespace="robot2") as second:
        other = Probe("robot2")
        assert other.call("up").success
        assert probe.call("sit").success
        assert other.pose()[2] > 0.29
        assert probe.pose()[2] == pytest.approx(0.235, abs=0.02)
        other.close()
        assert second.end() == 0


def test_a_client_whose_server_is_killed_hears_of_it_and_a_new_server_is_found(
    graph: None,
) -> None:
    from controller.bridges.ros2 import GO2ControllerNode

    first = Server("--realtime", namespace="robot5").await_ready()
    go2 = GO2ControllerNode("robot5")
    try:
        assert go2.stand()
        threading.Timer(2.0, first.process.kill).start()
        began = time.monotonic()
        assert go2.high_five() is False
        assert time.monotonic() - began < 15.0
        assert "no server of /robot5" in go2.last_message
        with serving("--realtime", namespace="robot5"):
            assert go2.stand()
            state = go2.state()
            assert state is not None
            assert state.q[2] > 0.29
    finally:
        go2.destroy_node()
        first.kill()


def test_a_server_that_comes_second_is_found(graph: None) -> None:
    from controller.bridges.ros2 import GO2ControllerNode

    server = Server("--realtime", namespace="robot6")
    go2 = GO2ControllerNode("robot6")
    try:
        wait_until(go2._behavior_client.service_is_ready, DISCOVERY)
        assert go2.stand()
    finally:
        go2.destroy_node()
        server.kill()


def test_ctrl_c_in_a_behaviour_answers_who_waits_and_leaves_the_robot_limp(graph: None) -> None:
    with serving("--realtime", namespace="robot7") as server:
        probe = Probe("robot7")
        waiting = probe.send("up")
        probe.spin(1.5)
        assert server.end() == 0
        answer = probe.result(waiting, 5.0)
        assert not answer.success
        assert "damped" in answer.message
        probe.close()
