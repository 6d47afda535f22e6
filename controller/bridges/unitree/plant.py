"""``UnitreePlant``: a Go2, or a simulator of one, driven by ``rt/lowcmd`` and ``rt/lowstate``."""

from __future__ import annotations

import atexit
import json
import logging
import math
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING, Final, final

import numpy as np

from controller.behaviours import DAMPING
from controller.bridges.unitree import LOOPBACK, low_level, require_dds
from controller.bridges.unitree.messages import LOW_STATE, encode_message
from controller.bridges.unitree.sport_api import SWITCHER_SERVICE, Code, SwitcherApi
from controller.modes import LYING_TILT
from controller.pacing import SWITCH_INTERVAL, BackgroundLog
from go2_wbc.errors import ClosedError, CommandError, PlantError, PlantTimeout
from go2_wbc.plant.base import Plant
from go2_wbc.robot.estimator import EstimatorConfig, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState

if TYPE_CHECKING:
    from controller.bridges.unitree.bus import Bus
    from controller.bridges.unitree.rpc import Client

_log = logging.getLogger(__name__)

PERIOD: Final = 0.002  #: Seconds between two ``rt/lowstate`` of the robot
FIRST_STATE_LIMIT: Final = 5.0  #: Time [s] in which the robot must be found
QUEUE: Final = 64
"""States that are kept while the controller is busy; the estimator takes in all of them."""
EXIT_DAMPINGS, DAMPING_PERIOD = 40, 0.005
"""How often damping is sent at the end, and the time [s] between two of these commands: 0.2 s."""
WATCH: Final = 0.02  #: Time [s] between two looks whether the controller still sends commands
SYNC_TRIES, SYNC_LIMIT, SYNC_SILENCE = 5, 0.1, 0.02
"""How often, and how long each time [s], the plant tries to get into step with the robot, and the
silence [s] that shows that it has."""
REPEAT, REPEATS = 0.01, 10
"""Silence [s] of the robot after which a command is sent again, and how often at most until the
limit of stale states: it, or its answer, may be lost, and a simulator in lockstep waits for it. One
that is only slow takes the repetition for the next command: where more is allowed, wait longer."""
SWITCHER_LIMIT: Final = 1.0  #: Time [s] in which the robot's motion switcher must be found
RELEASE_LIMIT, RELEASE_PERIOD = 5.0, 0.2
"""Time [s] in which its motion service must let go, and between two requests to."""
CONSENT: Final = (
    "this moves a robot: lay it on its belly, keep people away, take the remote in your hand (L2+B "
    "damps it), then say so by --i-have-the-remote-in-hand (in Python "
    "i_have_the_remote_in_hand=True)"
)


@final
class UnitreePlant(Plant):
    """Drives a Go2 through Unitree's low-level interface, its state estimated from its sensors.

    Every guard that trips damps the robot and ends the plant: a new one starts from lying again.
    Commands must not stop, so drive it with ``GO2Controller(plant=..., realtime=True)``.

    Attributes:
        bad_states: how many ``rt/lowstate`` were refused for their checksum or length.

    Example:
        >>> plant = UnitreePlant("lo", 1, i_have_the_remote_in_hand=True)  # go2-wbc unitree-sim
        >>> with GO2Controller(plant=plant, realtime=True) as go2:
        ...     go2.stand()
        True
    """

    def __init__(
        self,
        interface: str,
        domain: int = 0,
        *,
        i_have_the_remote_in_hand: bool = False,
        guards: low_level.GuardConfig | None = None,
        estimator: EstimatorConfig | None = None,
    ) -> None:
        """Find the robot, make sure that it lies, and take it over from its sport service.

        Args:
            interface: network interface that the robot is on; ``lo`` for a simulator.
            domain: DDS domain: 0 is the robot, 1 by custom a simulator.
            i_have_the_remote_in_hand: that you can stop the robot by hand.
            guards: when to soften and when to stop.
            estimator: numbers of the state estimator.

        Raises:
            CommandError: without consent, or for a wrong interface or domain.
            MissingDependency: without the extra.
            PlantTimeout: if no robot is found.
            PlantError: if it does not lie on its belly, or its sport service keeps it, or is not
                found on another interface than the loopback.
        """
        if i_have_the_remote_in_hand is not True:
            raise CommandError(CONSENT)
        require_dds()
        from controller.bridges.unitree.bus import Bus

        model = RobotModel()
        self._config = guards or low_level.GuardConfig()
        self._repeat = max(REPEAT, self._config.stale_limit / REPEATS)
        self._guards = low_level.Guards(model, self._config)
        # Nobody watches the sensors: how sound ones of a real robot read is not known well enough.
        self._estimator = StateEstimator(model, estimator, watches=False)
        self._model = model
        self._where = f"DDS domain {domain}, interface {interface}"
        bus = Bus(domain, interface)
        self._states = bus.reader("rt/lowstate", depth=QUEUE)
        self._commands = bus.writer("rt/lowcmd")
        self.bad_states = 0
        self._tick = -1
        self._heard = time.monotonic()
        self._written = math.inf  # when commands were last sent that must not stop
        self._failure: str | None = None
        self._is_closed = False
        self._sending = threading.RLock()
        self._is_taken_over = False
        self._find()
        self._require_lying()
        self._release_sport(bus, interface)
        self._find()  # a state of after that
        self._require_lying()
        self._take_over()

    def _take_over(self) -> None:
        sys.setswitchinterval(min(sys.getswitchinterval(), SWITCH_INTERVAL))
        self._is_taken_over = True
        atexit.register(self.close)
        _exit_on_signals()
        self._lines = BackgroundLog(_log.warning)
        self._watchdog = threading.Thread(target=self._watch, name="unitree-watchdog", daemon=True)
        self._watchdog.start()
        self._synchronise()

    @property
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""
        return PERIOD

    @property
    def is_live(self) -> bool:
        """True: a robot does not wait."""
        return True

    @property
    def is_hardware(self) -> bool:
        """True, also on the loopback: simulators speak the same protocol, and nothing tells."""
        return True

    def read(self) -> RobotState:
        """The estimated state after the last ``write``, or at the start."""
        self._check_open()
        return self._state

    def write(self, command: JointCommand) -> None:
        """Send ``command``, softened by the guards, and wait for the robot's next state.

        Raises:
            CommandError: if a value is not finite or a gain out of bounds; nothing is sent.
            PlantTimeout: if no state comes in time, or commands had stopped; the robot is damped.
            PlantError: if a guard trips; the robot is damped.
        """
        self._check_open()
        low_level.require_sane(command)
        self._send_softened(command)
        while not self._hears_a_state():
            self._send_softened(command)

    def _send_softened(self, command: JointCommand) -> None:
        with self._sending:
            if not low_level.is_passive(command):
                self._require_sound()
            self._send(self._guards.soften(command, self._state))

    def _require_sound(self) -> None:
        if self._failure is not None:
            raise PlantError(f"damped: {self._failure}; lay the robot down and make a new plant")
        fault = self._guards.fault(self._state) or self._guards.fault(self._own_view)
        if fault is not None:
            raise self._stop(PlantError(fault))

    def close(self) -> None:
        """Damp the robot and let go of it; idempotent."""
        if self._is_closed:
            return
        self._is_closed = True
        atexit.unregister(self.close)
        for _ in range(EXIT_DAMPINGS):
            self._damp_once()
            time.sleep(DAMPING_PERIOD)
        self._lines.close()

    def _check_open(self) -> None:
        if self._is_closed:
            raise ClosedError("the plant was closed")

    # --- commands -------------------------------------------------------------------------

    def _send(self, command: JointCommand) -> None:
        with self._sending:
            self._commands.write(encode_message(low_level.low_cmd_message(command)))
            self._written = math.inf if low_level.is_passive(command) else time.monotonic()

    def _damp_once(self) -> None:
        try:
            self._send(JointCommand.damping(DAMPING))
        except PlantError as error:  # others may get through
            self._lines.warning("a damping command could not be sent: %s", error)

    def _stop(self, error: PlantError) -> PlantError:
        """Damp the robot for good, once it was taken over; returns ``error`` to be raised."""
        with self._sending:
            self._failure = self._failure or str(error)
            if self._is_taken_over:
                self._damp_once()
        return error

    def _watch(self) -> None:
        """Damps the robot when the controller has stopped sending, though Python still runs.

        A robot that was stopped is sent damping until the plant is closed: one message may get
        lost, and what a robot does without any is not known.
        """
        while not self._is_closed:
            time.sleep(WATCH if self._failure is None else DAMPING_PERIOD)
            with self._sending:
                if self._is_closed:
                    return
                if self._failure is not None:
                    self._damp_once()
                elif time.monotonic() - self._written > self._config.hang_limit:
                    reason = (
                        f"no command for {1000 * self._config.hang_limit:.0f} ms; a robot needs "
                        "one every 2 ms: GO2Controller(plant=..., realtime=True)"
                    )
                    self._stop(PlantTimeout(reason))
                    self._lines.warning("damped: %s", reason)

    # --- states ---------------------------------------------------------------------------

    def _find(self) -> None:
        deadline = time.monotonic() + FIRST_STATE_LIMIT
        while not self._take():
            self._states.wait(0.1)
            if time.monotonic() > deadline:
                what = f"only {self.bad_states} broken ones" if self.bad_states else "none"
                raise PlantTimeout(
                    f"no rt/lowstate on {self._where} within {FIRST_STATE_LIMIT:g} s ({what}): "
                    "is the robot, or go2-wbc unitree-sim, on, and the interface right?"
                )

    def _hears_a_state(self) -> bool:
        """Take the next state; False if the robot is silent for a while."""
        while not self._take():
            silence = time.monotonic() - self._heard
            left = self._config.stale_limit - silence
            if left < 0.0:
                reason = f"no rt/lowstate for {1000 * silence:.0f} ms on {self._where}"
                raise self._stop(PlantTimeout(reason))
            if not self._states.wait(min(self._repeat, left + 0.001)):
                return False
        return True

    def _synchronise(self) -> None:
        """Take in what came before a command was heard: from then on a write is a period.

        A simulator in lockstep falls silent once it obeys. What lives by the clock never does.
        """
        for _ in range(SYNC_TRIES):
            self._send(JointCommand.damping(DAMPING))
            if self._hears_silence(SYNC_LIMIT):
                break
        self._heard = time.monotonic()

    def _hears_silence(self, limit: float) -> bool:
        end = time.monotonic() + limit
        while time.monotonic() < end:
            if not self._states.wait(SYNC_SILENCE):
                return True
            self._take()
        return False

    def _take(self) -> bool:
        """Take in all samples that have come; returns whether there is a new state."""
        known = self._tick
        for data in self._states.take():
            try:
                message = low_level.intact_message(LOW_STATE, data)
            except CommandError:
                self.bad_states += 1
                continue
            tick = int(message["tick"][0])
            if tick < self._tick:
                raise self._stop(PlantError("the robot's clock went back: it has started anew"))
            if tick > self._tick:
                self._tick, self._heard = tick, time.monotonic()
                reading = low_level.sensor_reading(message)
                self._state = self._estimator.update(reading)
                self._own_view = low_level.as_it_says(self._state, reading, message)
        return self._tick > known

    # --- taking over ----------------------------------------------------------------------

    def _require_lying(self) -> None:
        self._take()
        state = self._state
        _, p_feet = self._model.forward_kinematics(state.q)
        height = float(state.q[2] - p_feet[:, 2].min()) + self._model.foot_radius
        tilt = max(state.tilt, self._own_view.tilt)
        if not (height < low_level.LYING_HEIGHT and tilt < LYING_TILT):
            raise PlantError(
                f"the robot must lie on its belly at the start; its base is {height:.2f} m above "
                f"its feet, tilted by {np.degrees(tilt):.0f} deg"
            )

    def _release_sport(self, bus: Bus, interface: str) -> None:
        """Release whatever motion service has the robot: it would fight the commands."""
        from controller.bridges.unitree.rpc import Client

        client = Client(bus, SWITCHER_SERVICE)
        if not client.wait_for_server(SWITCHER_LIMIT):
            if interface != LOOPBACK:
                raise PlantError(
                    "no motion switcher answers, so nobody can tell what else moves this robot"
                )
            _log.warning("no motion switcher answers: taking for granted that nobody has the robot")
            return
        deadline = time.monotonic() + RELEASE_LIMIT
        while name := _active_service(client):
            if time.monotonic() > deadline:
                raise PlantError(
                    f"the motion service {name!r} keeps the robot: lay it down and end what runs "
                    "there"
                )
            self._require_lying()
            client.call(SwitcherApi.RELEASE_MODE)
            time.sleep(RELEASE_PERIOD)


def _active_service(client: Client) -> str:
    response = client.ask(SwitcherApi.CHECK_MODE)
    if response.code != Code.OK:
        raise PlantError(f"the motion switcher answered {response.code} to CheckMode")
    try:
        return str(json.loads(response.data).get("name") or "")
    except (ValueError, AttributeError) as error:
        raise PlantError(f"the motion switcher said {response.data!r}") from error


def _exit_on_signals() -> None:
    """Let SIGTERM and SIGHUP end the interpreter as its exit handlers want it, which damp.

    Signals that the program handles itself, and other threads' programs, are left alone.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, lambda number, _frame: sys.exit(128 + number))
