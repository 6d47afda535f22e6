"""``GO2ControllerNode``: an ``rclpy`` node with the methods of ``GO2Controller``."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from controller import arguments
from controller.bridges import ros2
from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.states import state_of
from controller.modes import listed, told
from controller.navigation import DriveStraight, Goal, TurnInPlace
from go2_wbc.errors import BridgeError, MissingDependency
from go2_wbc.planning.command import VelocityCommand, finite_number
from go2_wbc.robot.state import RobotState

ANSWER_LIMIT = 30.0  #: Time [s] in which a behaviour must be answered; the longest one takes four
MOTION_LIMIT = 180.0  #: Time [s] in which a motion must be over
ODOM_LIMIT = 2.0  #: Time [s] without odometry after which a goal is given up
SLICE = 0.1  #: Time [s] between two looks whether the server is still there
REST_SPEED, REST_TIME, REST_LIMIT = 0.02, 0.3, 4.0
"""A robot rests once it has been slower than this [m/s] for this long [s]; it gets so long [s]."""


class GO2ControllerNode(ros.Node):
    """Commands a Go2 that a ROS 2 server drives, with the methods of ``GO2Controller``.

    A call returns True only if the server says that it has happened, or odometry shows it; the
    reason is in ``last_message`` and in the log. A call whose server has gone returns False.

    Example:
        >>> rclpy.init()
        >>> go2 = GO2ControllerNode("robot1")
        >>> go2.stand() and go2.high_five()
        True

    Attributes:
        namespace: of the robot.
        last_message: what came of the last call, in plain words.
        progress: share of the motion that plays, 0 to 1.
    """

    def __init__(self, namespace: str = "robot1", *, node_name: str = "go2_controller") -> None:
        """Look for the server of ``namespace``, for five seconds; it may also come later.

        Args:
            namespace: of the robot's topics and services.
            node_name: of this node.

        Raises:
            ConfigError: for a namespace that is not a name.
            MissingDependency: if the interfaces are not installed; names the line that builds them.
            BridgeError: if ``rclpy.init()`` has not been called.
        """
        self.namespace = arguments.namespace(namespace)
        if ros.RobotBehaviorCommand is None:
            raise MissingDependency(f"quadropted_msgs is not here; build it: {ros.BUILD}")
        if not ros.rclpy.ok():
            raise BridgeError("call rclpy.init() before making a GO2ControllerNode")
        super().__init__(node_name)
        self.last_message, self.progress = "", 0.0
        behavior, cmd_vel, motion, odom = (
            ros2.topic(namespace, name)
            for name in (ros2.BEHAVIOR_SERVICE, ros2.CMD_VEL, ros2.MOTION_ACTION, ros2.ODOM)
        )
        self._behavior_client = self.create_client(ros.RobotBehaviorCommand, behavior)
        self._cmd_vel_pub = self.create_publisher(ros.Twist, cmd_vel, ros2.COMMAND_QUEUE)
        self._motion_client = ros.PlayMotion and ros.ActionClient(self, ros.PlayMotion, motion)
        self._odometry = ros.Future()
        self.create_subscription(ros.Odometry, odom, self._take_odometry, 1)
        self._velocity: Any = None
        self._velocity_lock, self._is_closed = threading.Lock(), threading.Event()
        self._repeater = threading.Thread(target=self._repeat, name="go2-repeat", daemon=True)
        self._goal: Any = None
        self._spinner = ros.SingleThreadedExecutor()
        self._wait_for_service()

    # --- postures -------------------------------------------------------------------------

    def sit(self) -> bool:
        """Sit like a dog."""
        return self._behave("sit")

    def stand(self) -> bool:
        """Stand, not walking."""
        return self._behave("up")

    def take_over(self) -> bool:
        """Balance a robot that stands already. False if it lies, as where a server begins."""
        return self._behave("take_over")

    def walk(self) -> bool:
        """Enter walking mode: ``move`` works from now on."""
        return self._behave("walk")

    def lie_down(self) -> bool:
        """Lie down and go limp."""
        return self._behave("lie_down")

    def recover(self) -> bool:
        """Get up after a fall."""
        return self._behave("recover")

    def damp(self) -> bool:
        """Go limp at once, also in the middle of something."""
        return self._behave("damp")

    # --- walking --------------------------------------------------------------------------

    def move(self, linear_x: float = 0.0, angular_z: float = 0.0, *, linear_y: float = 0.0) -> None:
        """Walk with this velocity until the next command; needs walking mode.

        It is published at once and then 50 times a second, since a robot that hears nothing stops.

        Args:
            linear_x: forward speed [m/s], negative is backward.
            angular_z: turning rate [rad/s], positive is left.
            linear_y: sideways speed [m/s], positive is left.

        Raises:
            CommandError: if a value is not a finite number.
        """
        message = _twist(VelocityCommand(linear_x, linear_y, angular_z))
        with self._velocity_lock:
            self._velocity = message
            self._cmd_vel_pub.publish(message)
        if not self._repeater.is_alive():
            self._repeater.start()

    def stop(self) -> None:
        """Zero velocity: the robot comes to rest in walking mode."""
        self._forget_velocity()
        self._cmd_vel_pub.publish(_twist(VelocityCommand()))

    def _repeat(self) -> None:
        while not self._is_closed.wait(ros2.COMMAND_PERIOD):
            with self._velocity_lock:
                if self._velocity is not None:
                    self._cmd_vel_pub.publish(self._velocity)

    def _forget_velocity(self) -> None:
        """Repeat none any more; when this returns, none is being sent."""
        with self._velocity_lock:
            self._velocity = None

    def turn_left(self, angle: float) -> bool:
        """Turn left in place by ``angle`` [rad], closed on odometry; negative turns right."""
        return self._run_goal(TurnInPlace(angle))

    def turn_right(self, angle: float) -> bool:
        """Turn right in place by ``angle`` [rad], closed on odometry."""
        return self._run_goal(TurnInPlace(angle, -1.0))

    def move_forward(self, distance: float) -> bool:
        """Walk ``distance`` [m] straight ahead, closed on odometry; negative is backward."""
        return self._run_goal(DriveStraight(distance))

    def _run_goal(self, goal: Goal) -> bool:
        if not self.walk():
            return False
        state = self.state()
        if state is None:
            return self._conclude(goal.name, False, "no odometry")
        goal.begin(state)
        end = state.time + goal.time_limit
        while not goal.is_done(state) and state.time < end:
            self._cmd_vel_pub.publish(_twist(goal.command(state)))
            state = self.state()
            if state is None:
                self.stop()
                return self._conclude(goal.name, False, "odometry has ceased")
        state = self._come_to_rest(state)
        missed, figures = told(goal.errors(state)), listed(goal.measurements(state))
        return self._conclude(goal.name, not missed, "; ".join(filter(None, (missed, figures))))

    def _come_to_rest(self, state: RobotState) -> RobotState:
        end, moved_at = state.time + REST_LIMIT, state.time
        while state.time < end and state.time - moved_at < REST_TIME:
            self.stop()
            if (newer := self.state()) is None:
                break
            state = newer
            if max(map(abs, state.v[:2].tolist())) > REST_SPEED:
                moved_at = state.time
        return state

    # --- motions --------------------------------------------------------------------------

    def high_five(self, side: str = "right", hold: float = 2.0) -> bool:
        """Raise a front paw, hold it for ``hold`` seconds, tap, and come back to standing."""
        return self.play("high_five", {"side": side, "hold": finite_number("hold", hold)})

    def play(
        self,
        motion: str,
        settings: Mapping[str, object] | None = None,
        on_progress: Callable[[float], None] = lambda _share: None,
    ) -> bool:
        """Play a motion of the server's library; an interruption cancels it, and it ends standing.

        Args:
            motion: its name.
            settings: its parameters.
            on_progress: is told the share that is done, ten times a second.
        """
        self._forget_velocity()
        if self._motion_client is None:
            return self._conclude(motion, False, f"PlayMotion is not here; build it: {ros.BUILD}")
        if not self._motion_client.wait_for_server(5.0):
            return self._report(motion, None)

        def note(message: Any) -> None:
            self.progress = message.feedback.progress
            on_progress(self.progress)

        rows = [f"{name}={value}" for name, value in (settings or {}).items()]
        goal = ros.PlayMotion.Goal(motion=motion, settings=rows)
        sent = self._motion_client.send_goal_async(goal, feedback_callback=note)
        self._goal = self._result_of(sent, ANSWER_LIMIT)
        if self._goal is None:
            return self._report(motion, None)
        if not self._goal.accepted:
            return self._conclude(motion, False, "refused: the robot is busy")
        try:
            answer = self._result_of(self._goal.get_result_async(), MOTION_LIMIT)
        except BaseException:
            self.cancel()
            raise
        finally:
            self._goal = None
        return self._report(motion, None if answer is None else answer.result)

    def cancel(self) -> None:
        """Call off the motion that plays, from its ``on_progress`` or another thread."""
        goal = self._goal
        if goal is not None:
            goal.cancel_goal_async()

    # --- looking --------------------------------------------------------------------------

    def check_served(self) -> None:
        """Raise BridgeError, with the line that starts a server, if there is none."""
        if not self._behavior_client.service_is_ready():
            raise BridgeError(self._absence())

    def state(self) -> RobotState | None:
        """The next state from odometry: base pose and velocity; None if there is none."""
        self._odometry = ros.Future()
        return self._result_of(self._odometry, ODOM_LIMIT)

    def wait(self, seconds: float) -> None:
        """Let ``seconds`` of the robot's time pass, or return at once if odometry ceases."""
        start = state = self.state()
        while start and state and state.time - start.time < seconds:
            state = self.state()

    def _take_odometry(self, message: Any) -> None:
        if not self._odometry.done():
            self._odometry.set_result(state_of(message))

    # --- talking to the server ------------------------------------------------------------

    def _wait_for_service(self, timeout_sec: float = 5.0) -> bool:
        """Wait until the server is there; returns whether it is."""
        is_there = self._behavior_client.wait_for_service(timeout_sec)
        if not is_there:
            self.get_logger().error(self._absence())
        return is_there

    def _behave(self, command: str) -> bool:
        self._forget_velocity()
        return self._call_behavior(command)

    def _call_behavior(self, command: str) -> bool:
        """Send a behaviour and wait until it has happened; returns whether it has."""
        if not (self._behavior_client.service_is_ready() or self._wait_for_service()):
            return self._report(command, None)
        request = ros.RobotBehaviorCommand.Request(command=command)
        answer = self._result_of(self._behavior_client.call_async(request), ANSWER_LIMIT)
        return self._report(command, answer)

    def _result_of(self, future: Any, limit: float) -> Any:
        """What ``future`` comes to; None if the server goes, or says nothing for ``limit`` s."""
        end = time.monotonic() + limit
        while not future.done() and time.monotonic() < end:
            self._spin_for(SLICE, future)
            if not future.done() and not self._behavior_client.service_is_ready():
                break
        if not future.done():
            future.cancel()
            return None
        return future.result()

    def _spin_for(self, seconds: float, future: Any) -> None:
        """Let messages in until ``future`` is done, or wait if somebody else spins this node."""
        other = self.executor
        if other is not None and other is not self._spinner and self in other.get_nodes():
            arrived = threading.Event()
            future.add_done_callback(lambda _future: arrived.set())
            arrived.wait(seconds)
        else:
            self._spinner.add_node(self)
            self._spinner.spin_until_future_complete(future, timeout_sec=seconds)

    def _absence(self) -> str:
        if self._behavior_client.service_is_ready():
            return f"the server of /{self.namespace} has not answered in time"
        return (
            f"no server of /{self.namespace}: start one with "
            f"`go2-wbc ros2 --namespace {self.namespace}`, in the same ROS_DOMAIN_ID"
        )

    def _report(self, what: str, answer: Any) -> bool:
        """Conclude by what the server has answered; None is no answer."""
        if answer is None:
            return self._conclude(what, False, self._absence())
        return self._conclude(what, bool(answer.success), answer.message)

    def _conclude(self, what: str, done: bool, message: str) -> bool:
        self.last_message = message
        if done:
            self.get_logger().info(f"{what}: {message}")
        else:
            self.get_logger().error(f"{what}: not done: {message}")
        return done

    def destroy_node(self) -> None:
        """Release everything; the robot stops by itself."""
        self._is_closed.set()
        if self._repeater.is_alive():
            self._repeater.join()
        self._spinner.shutdown()
        super().destroy_node()


def _twist(command: VelocityCommand) -> Any:
    message = ros.Twist()
    message.linear.x, message.linear.y = command.linear_x, command.linear_y
    message.angular.z = command.angular_z
    return message
