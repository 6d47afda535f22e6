"""``GO2Controller``: a Go2 behind a handful of methods."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NoReturn

import motions  # what is named motions.X below is imported when it is used, scipy with it
from controller import arguments
from controller.assembly import build_pilot
from controller.modes import Aborted, Asked, Call, Measurements, Mode, Outcome, Procedure
from controller.navigation import DriveStraight, TurnInPlace
from controller.pacing import REASON, LogOnce
from controller.policies.policy import Policy
from controller.telemetry import SeenTerrain, Telemetry
from go2_wbc.arguments import typed
from go2_wbc.config import Config
from go2_wbc.contacts import Gait
from go2_wbc.errors import ClosedError, CommandError, Go2WbcError, ModeError, TimelineError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.trunk import BodyPose
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Health, RobotState
from go2_wbc.wbc.explanation import Explanation
from go2_wbc.wbc.tasks import Task

_log = logging.getLogger(__name__)


class GO2Controller:
    """A Unitree Go2 that stands, sits, walks and gives a high five.

    By default it drives its own robot in MuJoCo, headless, as fast as the CPU allows; time passes
    only inside calls, so runs are deterministic. With ``realtime=True`` the simulation runs in a
    background thread at wall-clock pace.

    A blocking call returns True only when the measured state shows that it was done; otherwise
    False, with the reason in ``last_outcome``. It raises ModeError after a fall or while another
    one runs, and all raise ClosedError once the robot is closed.

    Example:
        >>> with GO2Controller() as go2:
        ...     go2.stand() and go2.high_five()
        True
    """

    @typed("plant", "realtime", "viewer", "config", "robot", "urdf", "after_tick", "extra_tasks")
    def __init__(
        self,
        namespace: str = "robot1",
        *,
        plant: Plant | None = None,
        realtime: bool = False,
        viewer: bool = False,
        config: Config | Path | str | None = None,
        robot: str | None = None,
        urdf: Path | str | None = None,
        after_tick: Callable[[], None] = lambda: None,
        extra_tasks: Sequence[Task] = (),
    ) -> None:
        """Begin with a robot that lies on the ground, damped; one that stands: ``take_over``.

        Args:
            namespace: name of this robot: letters, digits and underscores, a letter first.
            plant: what to drive; by default a ``MujocoPlant`` of its own.
            realtime: let the robot live at wall-clock pace in a background thread.
            viewer: open MuJoCo's viewer if there is a display.
            config: numbers of the engine, or a TOML file that overrides some.
            robot: "go2", "a1" or "go1"; by default that of the plant or the configuration.
            urdf: of the robot that is driven, and without ``plant`` also of the simulated one.
            after_tick: is called after every control period, in the thread that ticks.
            extra_tasks: of your own in the whole-body QP; they are asked in the thread that ticks.

        Raises:
            ConfigError: for a value that is not valid, or a plant that needs ``realtime``.
            SolverUnavailable: if the configured QP solver is unknown or not installed.
            DescriptionError: if the robot's files are missing, broken, or another robot's.
            PlantError: if the plant does not answer.
        """
        self._namespace = arguments.namespace(namespace)
        config = arguments.config(config, robot, plant)
        arguments.require_pace(plant, realtime=realtime)
        description = find_description(None if urdf is None else Path(urdf), config.robot)
        with ExitStack() as opened:
            if plant is None:
                plant = MujocoPlant(
                    urdf=urdf, robot=config.robot, visuals=viewer, motor=config.motor
                )
                opened.callback(plant.close)
            arguments.require_period(plant)
            self._plant = plant
            self._pilot = build_pilot(
                plant,
                config,
                realtime=realtime,
                viewer=viewer,
                description=description,
                after_tick=after_tick,
                extra_tasks=tuple(extra_tasks),
            )
            opened.callback(self._pilot.close)
            self._resources = opened.pop_all()
        self._runner, self._limits = self._pilot.runner, config.feasibility
        self._model = RobotModel(description, motor=config.motor)
        """For planning: the control loop's own belongs to the thread that ticks."""
        self._closed, self._clipped, self._planning = False, LogOnce(_log), threading.Lock()
        self._turn: dict[str, Call] = {}  # what runs: one entry, or none
        self._last = Outcome(True, "lying, nothing asked yet", 0.0)

    # --- postures -------------------------------------------------------------------------

    def stand(self) -> bool:
        """Stand, balancing, from lying, sitting or walking. True once it really stands."""
        return self._call("stand", self._pilot.stand)

    def sit(self) -> bool:
        """Sit like a dog: rump down, front legs up. Stands up first if it lies."""
        return self._call("sit", self._pilot.sit)

    def lie_down(self) -> bool:
        """Lie down on the belly and go limp."""
        return self._call("lie_down", self._pilot.lie_down)

    def recover(self) -> bool:
        """Get up and stand after a fall."""
        return self._call("recover", self._pilot.recover, allow_fallen=True)

    def take_over(self) -> bool:
        """Balance a robot that stands already, from how it stands. False if it does not stand."""
        return self._call("take_over", self._pilot.take_over)

    def damp(self) -> None:
        """Go limp at once, safely; also ends a call that is running in another thread."""
        self._check_open()
        self._pilot.collapse("damped by damp()")

    # --- walking --------------------------------------------------------------------------

    @typed(error=CommandError)
    def walk(self, gait: Gait | str = "trot", *, policy: Path | Policy | str | None = None) -> bool:
        """Enter walking mode; the robot stands ready until ``move``. Stands up first if needed.

        One that walks already passes over into the gait, its command clipped into the envelope.

        Args:
            gait: name of a gait, "auto" for one by the speed, or a gait of your own.
            policy: a learned one, by its ONNX file, beside which lies its sidecar: it walks while
                there is a command. Without one the gait lets the robot come to rest.

        Raises:
            CommandError: for an unknown gait; lists the valid ones.
            PolicyError: for a policy that cannot be used, or is another robot's.
            MissingDependency: for a policy without the extra ``policies``.
        """
        self._check_open()
        asked = self._pilot.asked()
        learned = None if policy is None else arguments.policy(policy, self._plant)
        return self._call("walk", lambda: self._pilot.walk(gait, learned), asked)

    def move(
        self,
        linear_x: float = 0.0,
        angular_z: float = 0.0,
        *,
        linear_y: float = 0.0,
        height: float = 0.0,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
    ) -> None:
        """Walk like this until the next command; takes no time by itself.

        Args:
            linear_x: forward speed [m/s], negative is backward.
            angular_z: turning rate [rad/s], positive is left.
            linear_y: sideways speed [m/s], positive is left.
            height: of the trunk, from the usual one [m], negative is lower.
            roll: of the trunk [rad], positive lowers the right side.
            pitch: of the trunk [rad], positive lowers the front.
            yaw: of the trunk [rad], positive looks left of the heading, which stays.

        Raises:
            CommandError: if a value is not a finite number, or the pose is beyond its envelope.
            ModeError: outside walking mode, or while another thread turns or moves forward.
        """
        self._check_open()
        wanted = VelocityCommand(linear_x, linear_y, angular_z)
        self._pilot.set_command(wanted, BodyPose(height, roll, pitch, yaw))
        self._clipped.warn(*self._pilot.excess(wanted))

    def stop(self) -> None:
        """Zero velocity: the robot comes to rest in walking mode.

        Without ``realtime`` the time until it rests passes inside this call. From another thread it
        also ends ``turn_left``, ``turn_right`` and ``move_forward``, which then return False.
        """
        self._check_open()
        ends_goal, walks = self._pilot.halt(), self._pilot.mode is Mode.WALKING
        if walks and not (ends_goal or self._runner.is_realtime or self._turn):
            self._call("stop", self._pilot.rest)

    def turn_left(self, angle: float) -> bool:
        """Turn left in place by ``angle`` [rad], measured on the heading; negative turns right.

        Ends at rest in walking mode.

        Raises:
            CommandError: for what is no finite number, or looks like degrees.
        """
        return self._call("turn_left", lambda: self._pilot.run_goal(TurnInPlace(angle)))

    def turn_right(self, angle: float) -> bool:
        """Turn right in place by ``angle`` [rad], measured on the heading.

        Raises:
            CommandError: as ``turn_left``.
        """
        return self._call("turn_right", lambda: self._pilot.run_goal(TurnInPlace(angle, -1.0)))

    def move_forward(self, distance: float) -> bool:
        """Walk ``distance`` [m] straight ahead, measured; negative is backward.

        Ends at rest in walking mode.

        Raises:
            CommandError: for what is no finite number.
        """
        return self._call("move_forward", lambda: self._pilot.run_goal(DriveStraight(distance)))

    # --- motions --------------------------------------------------------------------------

    @typed("plan", error=CommandError)
    def high_five(
        self, side: str = "right", hold: float = 2.0, *, plan: motions.CompiledPlan | None = None
    ) -> bool:
        """Raise a front paw on three legs, hold it, tap, and come back to standing.

        Args:
            hold: time [s] for which the paw is held up, 0.5 to 30.
            plan: what this motion was compiled to before; by default it is compiled now.

        Raises:
            CommandError: for another side or time.
        """
        asked = self._pilot.asked()
        if plan is None:
            own = self._model.profile.motions.get("high_five", {})
            try:
                timeline = motions.load_motion("high_five", side=side, hold=hold, **own)
            except TimelineError as error:
                raise CommandError(str(error)) from None
            with self._planning:
                plan = motions.compile_timeline(timeline, self._model)
        return self._call("high_five", lambda: self._pilot.play(plan, stands_up=True), asked)

    @typed("times", "check", "allow_dynamic", error=CommandError)
    def play(
        self,
        motion: motions.Playable,
        *,
        times: int = 1,
        check: bool = True,
        allow_dynamic: bool = False,
    ) -> bool:
        """Play a motion: a name of the library, a saved motion's file, a timeline, or a plan.

        What ``FeasibilityChecker.evaluate`` returned is neither compiled nor checked again.

        Args:
            motion: a ``Playable``.
            times: how often, one after the other; what is measured is of the last one.
            check: with False also one that the robot cannot do is played, to see what happens.
            allow_dynamic: on hardware, too, motions with flight or on fewer than three feet.

        Raises:
            CommandError: for an unknown name, what is no motion, or ``times`` below 1.
            TimelineError: for an empty timeline.
            MotionFileError: for a file that cannot be used.
            DynamicMotionRefused: for a dynamic motion on hardware without ``allow_dynamic``.
            StanceMismatch: if the motion starts from another stance.
            MotionInfeasible: if the motion breaks a limit of the robot; carries the findings.
        """
        self._check_open()
        if times < 1:
            raise CommandError(f"times must be a whole number of 1 or more, got {times!r}")
        asked = self._pilot.asked()
        plan = self.prepare(motion, check=check)
        with self._planning:
            departed = self._checker.departure(plan)

        def play() -> Measurements:
            runs = [self._pilot.play(plan, allow_dynamic=allow_dynamic) for _ in range(times)]
            return {**runs[-1], **departed}

        return self._call("play", play, asked)

    @typed("check", error=CommandError)
    def prepare(self, motion: motions.Playable, *, check: bool = True) -> MotionPlan:
        """What ``play`` plays: compiled, and checked, for this robot. Any thread may call it.

        Raises:
            CommandError, TimelineError, MotionFileError, MotionInfeasible: see ``play``.
        """
        with self._planning:  # one thread at a time
            return self._checker.plan(motion, check=check)

    def cancel(self) -> None:
        """From another thread or the plant: leave the motion that plays, safely, and stand.

        Its call then returns False. A motion on three feet goes the way back, or on, that it knows.
        """
        self._check_open()
        self._pilot.return_safely()

    @property
    def health(self) -> Health:
        """Which parts of the robot were found to be broken; ``print(go2.health)`` names them."""
        return self._runner.loop.health

    @property
    def progress(self) -> float:
        """Share of the motion that has been played, 0 to 1; 0 if none is."""
        playing = self._pilot.playing
        return 0.0 if playing is None else playing.progress

    @cached_property
    def _checker(self) -> motions.FeasibilityChecker:
        return motions.FeasibilityChecker(self._model, self._limits)

    def wait(self, seconds: float) -> None:
        """Let ``seconds`` of robot time pass; the robot goes on doing what it does.

        Raises:
            CommandError: for what is no finite number of 0 or more.
        """
        self._check_open()
        seconds = arguments.time("seconds", seconds)
        self._call("wait", lambda: self._pilot.wait(seconds), allow_fallen=True)

    @property
    def state(self) -> RobotState:
        """The newest measured state, a copy that cannot be written into."""
        return self._runner.loop.state.read_only()

    @property
    def terrain(self) -> SeenTerrain | None:
        """The ground as it has been seen; None before the first scan, and without a lidar."""
        return self._pilot.terrain

    @property
    def mode(self) -> Mode:
        """What the robot is doing."""
        return Mode.CLOSED if self._closed else self._pilot.mode

    @property
    def command(self) -> VelocityCommand:
        """The velocity command that is being followed, after clipping."""
        return self._pilot.command

    @property
    def body_pose(self) -> BodyPose:
        """The pose of the trunk that is being followed while the robot walks."""
        return self._pilot.body_pose

    @property
    def last_outcome(self) -> Outcome:
        """What came of the last blocking call, and why."""
        return self._last

    @property
    def namespace(self) -> str:
        """Name of this robot."""
        return self._namespace

    @property
    def plant(self) -> Plant:
        """What is being driven."""
        return self._plant

    @property
    def telemetry(self) -> Telemetry:
        """Peaks and counts of the run so far."""
        return self._runner.loop.telemetry

    def explain(self) -> Explanation:
        """Which limits were in the robot's way in the last tick, and what more of each would give.

        Raises:
            ModeError: if the whole-body QP had no part in it: the robot is limp, or lies down.
        """
        return Explanation.of(self._runner.between_ticks(self._runner.loop.problem))

    def recording(self, rate: float = 100.0) -> Recording:
        """The run so far (its last minutes), at about ``rate`` samples a second."""
        samples = self._runner.between_ticks(lambda: self.telemetry.samples(rate))
        return replace(samples.recording(), model_file=self.plant.model_file)

    # --- ending ---------------------------------------------------------------------------

    def close(self) -> None:
        """Go limp and release everything; idempotent."""
        if self._closed:
            return
        self._closed = True
        self._resources.close()

    def destroy_node(self) -> None:
        """The same as ``close``, under the name that ROS 2 code uses."""
        self.close()

    def __enter__(self) -> GO2Controller:
        self._check_open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        plant = type(self._plant).__name__
        time = self._runner.loop.state.time
        return f"<GO2Controller {self._namespace}: {self.mode.value}, {plant}, {time:.2f} s>"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a GO2Controller holds a running robot: make one in each process")

    # --- how calls are made ---------------------------------------------------------------

    def _call(
        self, name: str, run: Procedure, asked: Asked | None = None, *, allow_fallen: bool = False
    ) -> bool:
        """Run a procedure to its end, one at a time in all threads; returns whether it was done.

        Its end is noted. An error that is not of this project, or Ctrl-C, leaves the robot limp.
        """
        self._check_open()
        if self._pilot.mode is Mode.FALLEN and not allow_fallen:
            raise ModeError(f"{name}() needs a robot that has not fallen: call recover() first")
        call = Call(name, self._runner.loop.state.time, asked)
        try:  # Ctrl-C may come anywhere: whose turn it is must be seen from what is stored
            running = self._turn.setdefault("call", call)  # looks and takes at once
            if running is not call:
                raise ModeError(f"{name}() while {running.name}() is still running")
            return self._run(call, run)
        except Go2WbcError:
            raise
        except BaseException as error:
            is_ctrl_c = isinstance(error, KeyboardInterrupt)
            what = "interrupted" if is_ctrl_c else type(error).__name__
            reason = f"{what} during {name}()" + ("" if is_ctrl_c else f": {error}")
            try:
                self._pilot.collapse(reason)
                reason = f"{reason}, damped"
            finally:
                self._note(call, Outcome(False, reason))
            raise
        finally:  # no function is called in here: Python looks for Ctrl-C when one returns
            if "call" in self._turn and self._turn["call"] is call:
                del self._turn["call"]

    def _run(self, call: Call, procedure: Procedure) -> bool:
        _log.info("%s() at %.2f s", call.name, call.start)
        try:
            self._pilot.begin(call.asked)
            measured = procedure()
        except Aborted as aborted:
            self._note(call, Outcome(False, str(aborted), measured=aborted.measured))
            return False
        except Go2WbcError as error:
            self._note(call, Outcome(False, str(error)), is_raised=True)
            raise
        self._note(call, Outcome(True, "done", measured=dict(measured)))
        return True

    def _note(self, call: Call, outcome: Outcome, *, is_raised: bool = False) -> None:
        """What came of ``call``, and which parts are broken that the reason does not name."""
        ok, reason = outcome.ok, outcome.reason
        if untold := [str(f) for f in self.health.faults if str(f) not in reason]:
            reason = "; ".join([reason, *untold])
        duration = self._runner.loop.state.time - call.start
        self._last = replace(outcome, reason=reason, duration=duration)
        fault = self._runner.loop.fault
        is_known = is_raised or (fault is not None and fault.reason in reason)  # logged by the loop
        if ok or is_known:
            _log.info("%s() after %.2f s: %s", call.name, duration, reason)
        else:
            _log.warning(REASON, reason)

    def _check_open(self) -> None:
        if self._closed:
            raise ClosedError("this GO2Controller is closed")
