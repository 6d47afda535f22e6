"""What must not make a robot fall: ends of clients and servers at the worst moment, and garbage.

Every scenario runs real processes. It fails, with a reason, if the robot did not stop, stand or
recover, or if nobody was told; else it gives the largest tilt that odometry has shown meanwhile.
"""

from __future__ import annotations

import math
import signal
import time
from contextlib import closing
from functools import partial
from typing import Final

from benchmarks.bridges.faults import Fault, require, rows_of, run_all
from benchmarks.bridges.processes import wait_until
from benchmarks.bridges.ros2_processes import (
    ANSWER,
    DISCOVERY,
    READY,
    joined,
    start_server,
    stay_on_this_machine,
)
from benchmarks.bridges.ros2_stage import (
    FLOODER,
    RAISER,
    REST_TIME,
    WALKER,
    Stage,
    quiet_client,
    require_done,
    require_mode,
    require_more,
    require_refused,
    require_rest,
    require_said,
    script,
)
from benchmarks.rows import Family, Measurement
from benchmarks.trials import Trial

STANDING: Final = 0.29
"""Height [m] of the base above which the robot stands; 0.31 when it has come to rest."""
NOTICE_LIMIT: Final = 15.0
"""Wall time [s] in which a client must hear that its server has gone; five on an idle machine."""
BRAKING_WAY: Final = 0.5
"""Way [m] within which a robot stops that walked 0.3 m/s: half a second of silence, and strides."""
FLOOD_RATE: Final = 1500.0
"""Commands per second below which a flood was none."""
NAMESPACE: Final = "bench_faults"
GARBAGE: Final = (math.nan, math.inf, -math.inf)
HUGE: Final = 1e300


# --- clients that die -----------------------------------------------------------------------------


def client_killed_walking(stage: Stage) -> None:
    """The robot stops where it is, within a stride or two, and goes on obeying."""
    _, probe = stage.robot()
    with script(WALKER, stage.namespace) as client:
        client.wait_for("walking")
        start = probe.place()
        probe.let_pass(1.5)
        end = probe.place()
        require(end.way_from(start) > 0.2, "the robot did not walk in the first place")
        client.kill()
    probe.let_pass(2.0)
    require_rest(probe)
    way = probe.place().way_from(end)
    require(way < BRAKING_WAY, f"it walked on for {way:.2f} m")
    require_mode(probe, "walking")
    require_done(probe.call("up"))


def client_killed_high_five(stage: Stage) -> None:
    """The motion is finished, nobody else may disturb it, and the robot stands."""
    _, probe = stage.robot()
    require_done(probe.call("up"))
    with script(RAISER, stage.namespace) as client:
        client.wait_for("raised")
        client.kill()
    refused = probe.call("up").message
    require("busy with 'high_five'" in refused, f"an order in the motion was answered: {refused}")
    probe.wait_until(lambda: probe.statistics()["mode"] != "moving", "the motion's end")
    probe.let_pass(REST_TIME)
    require_mode(probe, "standing")
    require_done(probe.call("walk"))


# --- servers that die, come late, or come twice ---------------------------------------------------


def server_killed(stage: Stage) -> None:
    """The client hears of it in the middle of a motion, and finds the next server by itself."""
    killed_at: list[float] = []

    with stage.aside("_k") as (server, _), quiet_client(stage.namespace + "_k") as go2:

        def kill(share: float) -> None:
            if share > 0.3 and not killed_at:
                server.kill()
                killed_at.append(time.monotonic())

        require(go2.stand(), f"stand: {go2.last_message}")
        require(not go2.play("high_five", {}, kill), "a motion without a robot was called done")
        require(bool(killed_at), f"the motion ended before the server: {go2.last_message}")
        took = time.monotonic() - killed_at[0]
        require(took < NOTICE_LIMIT, f"the client heard of it after {took:.0f} s")
        require_said("no server of", go2.last_message)
        with stage.aside("_k") as (_, probe):
            require(go2.stand(), f"stand, with a new server: {go2.last_message}")
            require(probe.height() > STANDING, "the robot of the new server does not stand")


def server_second(stage: Stage) -> None:
    """A client that was there first finds the server when it comes."""
    namespace = stage.namespace + "_s"
    with start_server(namespace=namespace) as server, stage.watching("_s") as probe:
        require(READY not in server.text, "the server was there first")
        with quiet_client(namespace) as go2:
            wait_until(go2._behavior_client.service_is_ready, DISCOVERY)
            require(go2.stand(), f"stand: {go2.last_message}")
        require(probe.height() > STANDING, "the robot does not stand")
        server.stop()


def two_servers(stage: Stage) -> None:
    """The second one of a namespace ends and says why; the first goes on."""
    _, probe = stage.robot()
    with start_server(namespace=stage.namespace) as second:
        require_refused(second, second.finish(ANSWER), stage.namespace)
    require_done(probe.call("walk"))
    require_done(probe.call("up"))


def two_servers_at_once(stage: Stage) -> None:
    """Of two servers of one namespace that are started together exactly one serves."""
    namespace = stage.namespace + "_t"
    with (
        start_server(namespace=namespace) as one,
        start_server(namespace=namespace) as other,
        stage.watching("_t") as probe,
    ):
        wait_until(lambda: one.code is not None or other.code is not None, DISCOVERY)
        loser, winner = (one, other) if one.code is not None else (other, one)
        require(loser.code is not None, "both servers live")
        require_refused(loser, loser.finish(ANSWER), namespace)
        require_done(probe.call("up"))
        require(winner.code is None, f"the other one ended too: {winner.text}")
        winner.stop()


def interrupt(stage: Stage) -> None:
    """Ctrl-C at a server: who waits for an answer gets one, and the robot goes limp."""
    with stage.aside("_i") as (server, probe):
        waiting = probe.send("up")
        probe.let_pass(1.0)
        require(not waiting.done(), "the behaviour was over before the interrupt")
        server.stop(signal.SIGINT)
        require(server.code == 0, f"the server ended with exit code {server.code}")
        answer = probe.result(waiting, 10.0)
        require(not answer.success, "a behaviour that was cut short was called done")
        require_said("damped", answer.message)


# --- commands -------------------------------------------------------------------------------------


def flood(stage: Stage) -> None:
    """Commands at 5 kHz: the robot walks by them, stays in one piece, and stops after them."""
    _, probe = stage.robot()
    require_done(probe.call("walk"))
    before, start = probe.statistics(), probe.place()
    with script(FLOODER, stage.namespace) as flooder:
        said = flooder.finish(ANSWER)
    after, way = probe.statistics(), probe.place().way_from(start)
    require_said("rate ", said)
    rate = float(said.rpartition("rate ")[2])
    require(rate > FLOOD_RATE, f"only {rate:.0f} commands a second were sent")
    require(after["mode"] == "walking", f"the robot is {after['mode']}")
    require(after["errors"] == before["errors"] == 0, f"{after['errors']} errors in the server")
    require_more("followed", before, after)
    require(way > 0.2, f"it walked {way:.2f} m only")
    probe.let_pass(1.5)
    require_rest(probe)
    require_done(probe.call("up"))


def garbage(stage: Stage) -> None:
    """What is not finite moves nothing, what is huge is clipped; both are told."""
    server, probe = stage.robot()
    require_done(probe.call("walk"))
    before, start = probe.statistics(), probe.place()
    for value in GARBAGE:
        probe.drive(0.2, value)
        probe.drive(0.2, 0.0, value)
        probe.drive(0.2, 0.3, y=value)
    after = probe.statistics()
    require_more("not_finite", before, after)
    require(after["cmd_vel"]["followed"] == before["cmd_vel"]["followed"], "garbage was followed")
    require(probe.place().way_from(start) < 0.02, "garbage moved the robot")
    for sign in (1.0, -1.0):
        probe.drive(1.0, sign * HUGE, -sign * HUGE, y=HUGE)
    require_more("followed", after, probe.statistics())
    probe.let_pass(2.0)
    require_rest(probe)
    require(probe.statistics()["errors"] == before["errors"] == 0, "errors in the server")
    require_said("not finite", server.text)
    require_said("clipped", server.text)
    require_done(probe.call("up"))


# --- all of them ----------------------------------------------------------------------------------


ACTS: Final = (
    (client_killed_walking, "client killed: walking"),
    (client_killed_high_five, "client killed: high five"),
    (flood, "commands at 5 kHz"),
    (garbage, "garbage on cmd_vel"),
    (two_servers, "a second server"),
    (two_servers_at_once, "two servers at once"),
    (server_killed, "server killed: high five"),
    (server_second, "server after its client"),
    (interrupt, "Ctrl-C in a behaviour"),
)


def faults_on(stage: Stage) -> tuple[Fault, ...]:
    """All of them, to be played on one stage."""
    return tuple(
        Fault(f"ros2.{act.__name__}", what, partial(stage.play, act)) for act, what in ACTS
    )


def measure(_trial: Trial) -> Measurement:
    """Every fault, one after the other.

    Raises:
        MissingDependency: if ROS 2 is not installed.
    """
    stay_on_this_machine()
    with joined(), closing(Stage(NAMESPACE)) as stage:
        return run_all(faults_on(stage))


ROWS: Final = rows_of(faults_on(Stage(NAMESPACE)), "ROS 2: faults, largest tilt of the robot")
FAMILY: Final = Family("ros2-faults", ROWS, measure)
