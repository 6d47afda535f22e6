"""Ends of clients and servers at the worst moment, floods and garbage: no robot falls by them.

Every fault is played with real processes. The robot stops, stands or recovers, somebody is told
why, and its tilt by odometry stays below ``TILT_LIMIT`` meanwhile.
"""

from __future__ import annotations

import math
import signal
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import pytest

from tests.controller.bridges.processes import Process, wait_until
from tests.controller.bridges.ros2_graph import needs_ros2
from tests.controller.bridges.ros2_probe import WatchingProbe
from tests.controller.bridges.ros2_processes import ANSWER, DISCOVERY, quiet_client, serving

if TYPE_CHECKING:
    from controller.bridges.ros2 import GO2ControllerNode

STANDING: Final = 0.29
"""Height [m] of the base above which the robot stands; 0.31 when it has come to rest."""
NOTICE_LIMIT: Final = 15.0
"""Wall time [s] in which a client must hear that its server has gone; five on an idle machine."""
BRAKING_WAY: Final = 0.5
"""Way [m] within which a robot stops that walked 0.3 m/s: half a second of silence, and strides."""
REST_TIME, REST_WAY = 0.5, 0.01  #: A robot rests if it moves by less than this [m] in this time [s]
FLOOD_RATE: Final = 1500.0  #: Commands per second below which a flood was none
REFUSED: Final = 3  #: Exit code of a server that cannot serve
GARBAGE: Final = (math.nan, math.inf, -math.inf)
HUGE: Final = 1e300
CLIENT: Final = """
import sys, time, rclpy
from controller.bridges.ros2 import GO2ControllerNode
rclpy.init()
go2 = GO2ControllerNode(sys.argv[1])
"""
WALKER: Final = f"""{CLIENT}
if not go2.walk():
    sys.exit(go2.last_message)
go2.move(linear_x=0.3)
print("walking", flush=True)
time.sleep(120)
"""
RAISER: Final = f"""{CLIENT}
go2.play("high_five", {{"hold": 1.0}}, lambda share: share > 0.3 and print("raised", flush=True))
"""
FLOODER: Final = """
import sys, time, rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node("flooder")
publisher = node.create_publisher(Twist, f"/{sys.argv[1]}/cmd_vel", 10)
while not publisher.get_subscription_count():
    time.sleep(0.05)
message, sent, began = Twist(), 0, time.monotonic()
message.linear.x = 0.2
while (passed := time.monotonic() - began) < 3.0:
    if sent < 5000.0 * passed:
        publisher.publish(message)
        sent += 1
print(f"rate {sent / passed:.0f}", flush=True)
"""
TILT_LIMIT: Final = 30.0
"""Tilt [deg] that a fault may cause at most: a robot that goes limp sinks, it does not tip over."""
pytestmark = needs_ros2


@dataclass(frozen=True, slots=True)
class Scene:
    """A robot's namespace, and what is started there; it ends with the scene."""

    probe: WatchingProbe  #: watches the robot
    exits: ExitStack  #: what is to be ended

    def serve(self, says: str = "serving /") -> Process:
        """A server; see ``serving``."""
        return self.exits.enter_context(serving(namespace=self.probe.namespace, says=says))

    def client(self) -> GO2ControllerNode:
        """A client in this process."""
        return self.exits.enter_context(quiet_client(self.probe.namespace))

    def script(self, code: str) -> Process:
        """A client in a process of its own; without priority, since a flood never sleeps."""
        return Process([sys.executable, "-c", code, self.probe.namespace], has_priority=False)


@pytest.fixture
def at(graph: None, request: pytest.FixtureRequest) -> Iterator[Scene]:
    """A robot of the test's own, that must not have tipped over."""
    with closing(WatchingProbe(request.node.name)) as probe, ExitStack() as exits:
        yield Scene(probe, exits)
        assert math.degrees(probe.largest_tilt) <= TILT_LIMIT  # nan if no odometry was heard


def require_done(answer: Any) -> None:
    """That an order was carried out."""
    assert answer.success, f"an order was not carried out: {answer.message}"


def require_said(text: str, said: str) -> None:
    """That ``text`` is part of what was said."""
    assert text in said, f"{text!r} was not said, but: {said}"


def require_mode(probe: WatchingProbe, mode: str) -> None:
    """That the robot is standing, walking, ..."""
    found = probe.statistics()["mode"]
    assert found == mode, f"the robot is {found}, not {mode}"


def require_rest(probe: WatchingProbe) -> None:
    """That the robot does not move along."""
    start = probe.place()
    probe.let_pass(REST_TIME)
    way = probe.place().way_from(start)
    assert way < REST_WAY, f"it still walks: {way:.3f} m in {REST_TIME} s"


def require_more(count: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """That more velocity commands count as followed, not finite, ..."""
    assert after["cmd_vel"][count] > before["cmd_vel"][count], f"no command counts as {count}"


def require_refused(server: Process, namespace: str) -> None:
    """That a server ends because its namespace is served, and says so."""
    said = server.finish(ANSWER)
    assert server.code == REFUSED, f"the second server's exit code is {server.code}: {said}"
    require_said(f"/{namespace} is already served", said)
    require_said("--namespace", said)
    assert "Traceback" not in said, said


def test_a_robot_stops_whose_client_is_killed_while_it_walks(at: Scene) -> None:
    """The robot stops where it is, within a stride or two, and goes on obeying."""
    at.serve()
    probe = at.probe
    with at.script(WALKER) as client:
        client.wait_for("walking")
        start = probe.place()
        probe.let_pass(1.5)
        end = probe.place()
        assert end.way_from(start) > 0.2, "the robot did not walk in the first place"
        client.kill()
    probe.let_pass(2.0)
    require_rest(probe)
    way = probe.place().way_from(end)
    assert way < BRAKING_WAY, f"it walked on for {way:.2f} m"
    require_mode(probe, "walking")
    require_done(probe.call("up"))


def test_a_high_five_is_finished_whose_client_is_killed(at: Scene) -> None:
    """The motion is finished, nobody else may disturb it, and the robot stands."""
    at.serve()
    probe = at.probe
    require_done(probe.call("up"))
    with at.script(RAISER) as client:
        client.wait_for("raised")
        client.kill()
    refused = probe.call("up").message
    assert "busy with 'high_five'" in refused, f"an order in the motion was answered: {refused}"
    ends = wait_until(lambda: probe.statistics()["mode"] != "moving", ANSWER)
    assert ends, "the motion does not end"
    probe.let_pass(REST_TIME)
    require_mode(probe, "standing")
    require_done(probe.call("walk"))


def test_a_flood_of_commands_is_walked_by(at: Scene) -> None:
    """Commands at 5 kHz: the robot walks by them, stays in one piece, and stops after them."""
    at.serve()
    probe = at.probe
    require_done(probe.call("walk"))
    before, start = probe.statistics(), probe.place()
    with at.script(FLOODER) as flooder:
        said = flooder.finish(ANSWER)
    after, way = probe.statistics(), probe.place().way_from(start)
    require_said("rate ", said)
    rate = float(said.rpartition("rate ")[2])
    assert rate > FLOOD_RATE, f"only {rate:.0f} commands a second were sent"
    assert after["mode"] == "walking", f"the robot is {after['mode']}"
    assert after["errors"] == before["errors"] == 0, f"{after['errors']} errors in the server"
    require_more("followed", before, after)
    assert way > 0.2, f"it walked {way:.2f} m only"
    probe.let_pass(1.5)
    require_rest(probe)
    require_done(probe.call("up"))


def test_garbage_on_cmd_vel_moves_nothing(at: Scene) -> None:
    """What is not finite moves nothing, what is huge is clipped; both are told."""
    server, probe = at.serve(), at.probe
    require_done(probe.call("walk"))
    before, start = probe.statistics(), probe.place()
    for value in GARBAGE:
        probe.drive(0.2, value)
        probe.drive(0.2, 0.0, value)
        probe.drive(0.2, 0.3, y=value)
    after = probe.statistics()
    require_more("not_finite", before, after)
    assert after["cmd_vel"]["followed"] == before["cmd_vel"]["followed"], "garbage was followed"
    assert probe.place().way_from(start) < 0.02, "garbage moved the robot"
    for sign in (1.0, -1.0):
        probe.drive(1.0, sign * HUGE, -sign * HUGE, y=HUGE)
    require_more("followed", after, probe.statistics())
    probe.let_pass(2.0)
    require_rest(probe)
    assert probe.statistics()["errors"] == before["errors"] == 0, "errors in the server"
    require_said("not finite", server.text)
    require_said("clipped", server.text)
    require_done(probe.call("up"))


def test_a_second_server_is_refused(at: Scene) -> None:
    """The second one of a namespace ends and says why; the first goes on."""
    at.serve()
    probe = at.probe
    require_refused(at.serve(says=""), at.probe.namespace)
    require_done(probe.call("walk"))
    require_done(probe.call("up"))


def test_of_two_servers_at_once_one_serves(at: Scene) -> None:
    """Of two servers of one namespace that are started together exactly one serves."""
    one, other = at.serve(says=""), at.serve(says="")
    wait_until(lambda: one.code is not None or other.code is not None, DISCOVERY)
    loser, winner = (one, other) if one.code is not None else (other, one)
    assert loser.code is not None, "both servers live"
    require_refused(loser, at.probe.namespace)
    require_done(at.probe.call("up"))
    assert winner.code is None, f"the other one ended too: {winner.text}"


def test_a_client_finds_the_next_server_when_its_own_is_killed(at: Scene) -> None:
    """The client hears of it in the middle of a motion, and finds the next server by itself."""
    server, go2 = at.serve(), at.client()
    killed_at: list[float] = []

    def kill(share: float) -> None:
        if share > 0.3 and not killed_at:
            server.kill()
            killed_at.append(time.monotonic())

    assert go2.stand(), f"stand: {go2.last_message}"
    assert not go2.play("high_five", {}, kill), "a motion without a robot was called done"
    assert bool(killed_at), f"the motion ended before the server: {go2.last_message}"
    took = time.monotonic() - killed_at[0]
    assert took < NOTICE_LIMIT, f"the client heard of it after {took:.0f} s"
    require_said("no server of", go2.last_message)
    at.serve()
    assert go2.stand(), f"stand, with a new server: {go2.last_message}"
    assert at.probe.height() > STANDING, "the robot of the new server does not stand"


def test_a_client_finds_a_server_that_comes_later(at: Scene) -> None:
    """A client that was there first finds the server when it comes."""
    server = at.serve(says="")
    assert "serving /" not in server.text, "the server was there first"
    go2 = at.client()
    wait_until(go2._behavior_client.service_is_ready, DISCOVERY)
    assert go2.stand(), f"stand: {go2.last_message}"
    assert at.probe.height() > STANDING, "the robot does not stand"


def test_an_interrupt_answers_who_waits_and_the_robot_goes_limp(at: Scene) -> None:
    """Ctrl-C at a server: who waits for an answer gets one, and the robot goes limp."""
    server, probe = at.serve(), at.probe
    waiting = probe.send("up")
    probe.let_pass(1.0)
    assert not waiting.done(), "the behaviour was over before the interrupt"
    server.stop(signal.SIGINT)
    assert server.code == 0, f"the server ended with exit code {server.code}"
    answer = probe.result(waiting, 10.0)
    assert not answer.success, "a behaviour that was cut short was called done"
    require_said("damped", answer.message)
