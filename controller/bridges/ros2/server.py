"""The robot as a ROS 2 node: MuJoCo, the whole-body controller and the topics in one loop.

Everything but the action runs in one thread: after every control period the loop polls for calls
and commands, publishes what is due, and sleeps if it has to keep the pace of the wall clock. Errors
in this file are logged and counted; they never stop the control of the robot.

An executor takes 0.1 ms per turn to find that there is nothing to do, and half a millisecond for a
callback; polling a handle takes 2 us. The handles are not documented, which is why the extra pins
the version of rclpy.

The action plays motions: goal, feedback with progress, cancel, result. Goals are rare, so it has a
node and an executor of its own, which sleep while there is none.
"""

from __future__ import annotations

import concurrent.futures
import json
import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

from controller import arguments
from controller.bridges import ros2
from controller.bridges.ros2 import MOTION_ACTION
from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.behaviors import (
    COMMANDS,
    NONE_SAVED,
    Jobs,
    SavedMotions,
    motion_job,
    order,
)
from controller.bridges.ros2.namespace_lock import GraphWatch, lock_namespace
from controller.bridges.ros2.states import StatePublisher
from controller.bridges.ros2.velocity import VelocityInput
from controller.go2_controller import GO2Controller
from controller.jobs import JobServer, Reply
from controller.modes import Outcome
from controller.pacing import SWITCH_INTERVAL, LogThrottle, Pacer
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant

THREADS = 3  #: One waits for the motion, the others serve cancels and further goals
FEEDBACK_PERIOD = 0.1  #: Time [s] between two messages of how far a motion has come


class MotionActions:
    """Offers ``play_motion`` of a job server's robot."""

    def __init__(self, context: Any, namespace: str, jobs: Jobs, saved: SavedMotions) -> None:
        self._jobs, self._saved = jobs, saved
        self._node = ros.Node(
            "go2_wbc_motions", namespace=namespace, context=context, start_parameter_services=False
        )
        self._server = ros.ActionServer(
            self._node,
            ros.PlayMotion,
            MOTION_ACTION,
            execute_callback=self._execute,
            callback_group=ros.ReentrantCallbackGroup(),
            goal_callback=self._judge,
            cancel_callback=lambda _handle: ros.CancelResponse.ACCEPT,
        )
        self._executor = ros.MultiThreadedExecutor(THREADS, context=context)
        self._executor.add_node(self._node)
        self._end = ros.Future()
        self._thread = threading.Thread(target=self._spin, name="go2-actions", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            self._executor.spin_until_future_complete(self._end)
        except Exception as error:  # the robot goes on without the action
            _log.error("the action %s has ended: %s", MOTION_ACTION, error)

    def _judge(self, goal: Any) -> Any:
        refusal = self._jobs.refusal()
        if not refusal:
            return ros.GoalResponse.ACCEPT
        _log.warning("motion %r refused: %s", goal.motion, refusal)
        return ros.GoalResponse.REJECT

    def _execute(self, handle: Any) -> Any:
        goal, answered = handle.request, concurrent.futures.Future[Outcome]()
        go2, reply = self._jobs.robot, answered.set_result
        self._jobs.submit(motion_job(goal.motion, goal.settings, go2, reply, self._saved))
        while not concurrent.futures.wait([answered], FEEDBACK_PERIOD).done:
            if handle.is_cancel_requested:  # again and again: one that came early gets lost
                self._jobs.cancel()
            if (job := self._jobs.job) is not None:
                handle.publish_feedback(
                    ros.PlayMotion.Feedback(
                        phase=job.phase,
                        progress=float(go2.progress),
                        elapsed=float(go2.state.time - job.start),
                    )
                )
        return self._conclude(handle, answered.result())

    def _conclude(self, handle: Any, answer: Outcome) -> Any:
        if answer.ok:
            handle.succeed()
        elif answer.cancelled and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return ros.PlayMotion.Result(
            success=answer.ok, message=answer.reason, duration=float(answer.duration)
        )

    def close(self) -> None:
        """Stop spinning and release the node; the jobs must have been answered before."""
        self._end.set_result(None)  # an executor that is shut down while it spins fails at times
        self._thread.join(2.0)
        self._executor.shutdown(timeout_sec=2.0)
        self._server.destroy()
        self._node.destroy_node()


_log = logging.getLogger(__name__)

IDLE = 0.01  #: Robot time [s] that passes at a time while nothing is ordered
LATE = 0.25  #: Lag [s] behind the wall clock after which the pace is given up and taken up anew
LINGER = 0.2  #: Time [s] in which the last answers reach their callers before the node goes
Poll = Callable[[], None]
"""Takes what has come since the last call, at most one queue full, and acts on it."""


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """How the robot is served."""

    namespace: str = "robot1"  #: of its topics and services
    realtime: bool = False
    """At the pace of the wall clock; otherwise as fast as the CPU allows, with /clock."""
    viewer: bool = False  #: open MuJoCo's window
    config: Config | Path | None = None  #: numbers of the engine, or a TOML file
    sensors: str = "ideal"  #: of the simulated robot, as of ``MujocoPlant``
    saved: SavedMotions = NONE_SAVED  #: motions that can be played besides those of the library


def serve(
    settings: ServerSettings,
    stop: threading.Event | None = None,
    on_ready: Callable[[str], None] = lambda _text: None,
) -> None:
    """Serve a simulated Go2 until ``stop`` is set.

    Args:
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
        node = RobotNode(context, go2, simulator, config, settings)
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
        settings: ServerSettings,
    ) -> None:
        """Offer ``go2``, which drives ``simulator``, in ``context``."""
        self._go2, namespace = go2, go2.namespace
        self._node = node = ros.Node(
            ros2.SERVER_NODE, namespace=namespace, context=context, start_parameter_services=False
        )
        self._jobs, self._saved = JobServer(go2), settings.saved
        self._velocity = VelocityInput(go2, config.cautious_envelope, config.pose)
        self._poll_twists = polled_topic(node, ros.Twist, ros2.CMD_VEL, self._take_twist)
        self._poll_poses = polled_topic(node, ros.Pose, "body_pose", self._take_pose)
        self._poll_commands: Poll = lambda: None
        if (kind := ros.RobotBehaviorCommand) is not None:
            self._poll_commands = polled_service(
                node,
                kind,
                ros2.BEHAVIOR_SERVICE,
                lambda request, reply: self._order(request.command, reply),
            )
        acts: dict[str, Callable[[Any, Reply], None]] = {
            name: lambda _request, reply, name=name: self._order(name, reply) for name in COMMANDS
        }
        acts[ros2.STATISTICS_SERVICE] = self._tell_statistics
        polls = [polled_service(node, ros.Trigger, name, act) for name, act in acts.items()]
        self._triggers = cycle(polls)
        self._states = StatePublisher(
            node, simulator, realtime=settings.realtime, sensors=settings.sensors
        )
        self._actions = ros.PlayMotion and MotionActions(
            context, namespace, self._jobs, self._saved
        )
        self._pacer = Pacer(simulator.control_period, LATE) if settings.realtime else None
        self._throttle, self._errors = LogThrottle(_log), 0
        self._cpu, self._began = 0.0, time.monotonic()

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
        if self._saved.folder is not None and ros.PlayMotion is not None:
            found = ", ".join(self._saved.names) or "none yet"
            lines.append(f"motions that are saved in {self._saved.folder}: {found}")
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
        next(self._triggers)()
        self._poll_commands()
        self._poll_twists()
        self._poll_poses()
        self._velocity.expire()
        self._states.publish_due()

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
        reply(Outcome(True, json.dumps(figures)))

    def close(self) -> None:
        """Answer whoever waits and release everything."""
        self._jobs.abandon("the server is ending: the robot goes limp")
        if self._actions is not None:
            self._actions.close()
        time.sleep(LINGER)
        self._node.destroy_node()


def polled_topic(node: Any, kind: Any, name: str, act: Callable[[Any], None]) -> Poll:
    """Subscribe ``node`` to a topic; ``act`` is given each message when it is polled."""
    handle = node.create_subscription(kind, name, _never, ros2.COMMAND_QUEUE).handle

    def poll() -> None:
        for _ in range(ros2.COMMAND_QUEUE):
            with handle:
                taken = handle.take_message(kind, False)
            if taken is None:
                return
            act(taken[0])

    return poll


def polled_service(node: Any, kind: Any, name: str, act: Callable[[Any, Reply], None]) -> Poll:
    """Offer a service that answers ``success`` and ``message``; ``act`` is given each request."""
    service = node.create_service(kind, name, _never)

    def answer(header: Any, answer: Outcome) -> None:
        service.send_response(kind.Response(success=answer.ok, message=answer.reason), header)

    def poll() -> None:
        for _ in range(ros2.COMMAND_QUEUE):
            with service.handle:
                request, header = service.handle.service_take_request(kind.Request)
            if request is None:
                return
            act(request, partial(answer, header))

    return poll


def _never(*_arguments: Any) -> None:
    """The callback that ROS wants; no executor ever calls it."""
