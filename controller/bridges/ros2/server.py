"""The robot as a ROS 2 node: MuJoCo, the whole-body controller and the topics in one loop.

Everything but the action runs in one thread: after every control period the loop asks for calls
and commands, publishes what is due, and sleeps if it is to keep the pace of the wall clock. What
goes wrong in here is logged and counted; it never stops the control of the robot.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

from controller import arguments
from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.actions import MotionActions
from controller.bridges.ros2.behaviors import COMMANDS, order
from controller.bridges.ros2.names import (
    BEHAVIOR_SERVICE,
    BODY_POSE,
    CMD_VEL,
    SERVER_NODE,
    STATISTICS_SERVICE,
)
from controller.bridges.ros2.namespace_lock import GraphWatch, lock_namespace
from controller.bridges.ros2.polling import PolledService, PolledSubscription
from controller.bridges.ros2.states import StatePublisher
from controller.bridges.ros2.velocity import VelocityInput
from controller.go2_controller import GO2Controller
from controller.jobs import Answer, JobServer, Reply
from controller.pacing import SWITCH_INTERVAL, LogThrottle, Pacer
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant

_log = logging.getLogger(__name__)

IDLE = 0.01
"""Robot time [s] that passes at a time while nothing is ordered."""
LATE = 0.25
"""Lag [s] behind the wall clock after which the pace is given up and taken up anew."""
LINGER = 0.2
"""Time [s] in which the last answers reach their callers before the node goes."""


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """How the robot is served.

    Attributes:
        namespace: of its topics and services.
        realtime: at the pace of the wall clock; otherwise as fast as the CPU allows, with /clock.
        viewer: open MuJoCo's window.
        config: numbers of the engine, or a TOML file.
        sensors: of the simulated robot, as of ``MujocoPlant``.
    """

    namespace: str = "robot1"
    realtime: bool = False
    viewer: bool = False
    config: Config | Path | None = None
    sensors: str = "ideal"


def serve(
    settings: ServerSettings,
    stop: threading.Event | None = None,
    on_ready: Callable[[str], None] = lambda _text: None,
) -> None:
    """Serve a simulated Go2 until ``stop`` is set.

    Args:
        settings: how.
        stop: ends it: whoever waits for an answer gets one, and the robot goes limp.
        on_ready: is told, once, what is offered and what is not.

    Raises:
        BridgeError: if the namespace is already served.
        MissingDependency: if ROS 2 is not installed.
        PlantError: if the simulation fails.
    """
    namespace, stop = arguments.namespace(settings.namespace), stop or threading.Event()
    config = arguments.config(settings.config).beside_hardware
    switch_interval = sys.getswitchinterval()
    with ExitStack() as stack:
        sys.setswitchinterval(SWITCH_INTERVAL)
        stack.callback(sys.setswitchinterval, switch_interval)
        context = ros.Context()
        ros.rclpy.init(args=[], context=context, signal_handler_options=ros.SignalHandlerOptions.NO)
        stack.callback(ros.rclpy.shutdown, context=context)
        stack.enter_context(lock_namespace(namespace, context.get_domain_id()))
        graph_node = ros.Node(
            f"go2_wbc_graph_watch_{os.getpid()}",
            namespace=namespace,
            context=context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        stack.callback(graph_node.destroy_node)
        watch = GraphWatch(graph_node, namespace)
        watch.check()
        simulator = MujocoPlant(
            visuals=settings.viewer,
            motor=config.motor,
            sensors=settings.sensors,
            estimator=config.estimator,
        )
        stack.callback(simulator.close)
        go2 = stack.enter_context(
            GO2Controller(
                namespace,
                plant=simulator,
                viewer=settings.viewer,
                config=config,
                after_tick=lambda: node.serve(stop),
            )
        )
        node = RobotNode(
            context,
            go2,
            simulator,
            config,
            realtime=settings.realtime,
            sensors=settings.sensors,
        )
        stack.callback(node.close)
        on_ready(node.offer)
        node.run(stop, watch)
        _log.info("ending: the robot goes limp")


class RobotNode:
    """Everything that one robot offers, and the loop that serves it."""

    def __init__(
        self,
        context: Any,
        go2: GO2Controller,
        simulator: MujocoPlant,
        config: Config,
        *,
        realtime: bool,
        sensors: str,
    ) -> None:
        """Offer ``go2``, which drives ``simulator``, in ``context``."""
        self._go2, namespace = go2, go2.namespace
        self._node = node = ros.Node(
            SERVER_NODE, namespace=namespace, context=context, start_parameter_services=False
        )
        self._jobs = JobServer(go2)
        self._velocity = VelocityInput(go2, config.cautious_envelope, config.pose)
        self._poses = PolledSubscription(node, ros.Pose, BODY_POSE, self._take_pose)
        self._twists = PolledSubscription(node, ros.Twist, CMD_VEL, self._take_twist)
        self._commands = (
            PolledService(node, ros.RobotBehaviorCommand, BEHAVIOR_SERVICE, self._take_command)
            if ros.RobotBehaviorCommand is not None
            else None
        )
        self._triggers = cycle(self._offer_triggers())
        self._states = StatePublisher(node, simulator, realtime=realtime, sensors=sensors)
        self._actions = (
            MotionActions(context, namespace, self._jobs) if ros.PlayMotion is not None else None
        )
        self._pacer = Pacer(simulator.control_period, LATE) if realtime else None
        self._throttle, self._errors = LogThrottle(_log), 0
        self._cpu, self._began = 0.0, time.monotonic()

    def _offer_triggers(self) -> Iterator[PolledService]:
        for name in COMMANDS:
            yield PolledService(
                self._node,
                ros.Trigger,
                name,
                lambda _request, reply, name=name: self._order(name, reply),
            )
        yield PolledService(self._node, ros.Trigger, STATISTICS_SERVICE, self._tell_statistics)

    @property
    def offer(self) -> str:
        """What is offered, and what is missing with the line that brings it."""
        namespace = self._go2.namespace
        lines = [f"serving /{namespace}: " + ("real time" if self._pacer else "free-running")]
        missing = ros.missing_interfaces()
        if missing:
            lines.append(f"without {' and '.join(missing)}; to build and install: {ros.BUILD}")
        if ros.RobotBehaviorCommand is None:
            names = ", ".join(f"/{namespace}/{name}" for name in COMMANDS)
            lines.append(f"std_srvs/Trigger services instead: {names}")
        return "\n".join(lines)

    # --- the loop -------------------------------------------------------------------------

    def run(self, stop: threading.Event, watch: GraphWatch) -> None:
        """Carry out orders, or wait for them, until ``stop`` is set."""
        while not stop.is_set():
            if not self._jobs.work():
                self._go2.wait(IDLE)
            watch.look()

    def serve(self, stop: threading.Event) -> None:
        """One turn after a control period."""
        self._guarded(self._serve_once)
        if stop.is_set() and self._jobs.job is not None:
            self._guarded(self._jobs.damp)
        if self._pacer is not None and not stop.is_set():
            self._pacer.wait(lambda: self._guarded(self._poll_commands))

    def _serve_once(self) -> None:
        next(self._triggers).poll()
        self._poll_commands()
        self._twists.poll()
        self._poses.poll()
        self._velocity.expire()
        self._states.publish_due()

    def _poll_commands(self) -> None:
        if self._commands is not None:
            self._commands.poll()

    def _guarded(self, act: Callable[[], object]) -> None:
        began = time.thread_time()
        try:
            act()
        except Exception as error:  # whatever it is: the robot must not fall for it
            self._errors += 1
            self._throttle.warn(type(error).__name__, f"{type(error).__name__}: {error}")
        self._cpu += time.thread_time() - began

    # --- what comes in --------------------------------------------------------------------

    def _take_twist(self, twist: Any) -> None:
        linear, is_busy = twist.linear, self._jobs.job is not None
        self._velocity.accept(linear.x, linear.y, twist.angular.z, is_busy=is_busy)

    def _take_pose(self, pose: Any) -> None:
        at = pose.orientation
        self._velocity.accept_pose(pose.position.z, (at.x, at.y, at.z, at.w))

    def _take_command(self, request: Any, reply: Reply) -> None:
        self._order(request.command, reply)

    def _order(self, command: str, reply: Reply) -> None:
        order(self._jobs, command, reply)
        if self._jobs.job is not None:
            self._velocity.end()

    def _tell_statistics(self, _request: Any, reply: Reply) -> None:
        """Counts and times since the start."""
        own, state = time.thread_time(), self._go2.state
        figures = {
            "mode": self._go2.mode.value,
            "robot_time": state.time,
            "position": state.p_world_base.tolist(),
            "heading": state.yaw,
            "wall_time": time.monotonic() - self._began,
            "paces_given_up": self._pacer.give_ups if self._pacer else 0,
            "ros_cpu_in_loop": self._cpu,
            "cpu_of_loop": own,
            "cpu_of_other_threads": time.process_time() - own,
            "cmd_vel": self._velocity.counts,
            "published": self._states.counts,
            "errors": self._errors,
        }
        reply(Answer(True, json.dumps(figures)))

    def close(self) -> None:
        """Answer whoever waits and release everything."""
        self._jobs.abandon("the server is ending: the robot goes limp")
        if self._actions is not None:
            self._actions.close()
        time.sleep(LINGER)
        self._node.destroy_node()
