"""Drives a robot by keys: short commands at once, long ones as jobs in another thread.

It does not depend on terminals: ``press`` takes a key, ``status`` returns the present state, and
``news`` the outcomes since.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from queue import SimpleQueue
from typing import Any, final

from controller.go2_controller import GO2Controller
from controller.jobs import Job, JobServer
from controller.modes import Aborted, Measurements, Mode, Outcome
from go2_wbc.errors import ClosedError, Go2WbcError, install_line
from go2_wbc.planning.command import VelocityCommand

DEAD_ZONE = 0.12
"""Share of a stick's way around its middle that counts as none (own choice: worn sticks)."""
AHEAD, ASIDE, TURNING = 1.0, 0.4, 1.5
"""Speeds [m/s] and turning rate [rad/s] of a stick that is pushed to its end."""
LEFT_X, LEFT_Y, RIGHT_X = 0, 1, 3  #: Axes of the sticks; right and down are positive
BUTTONS: Mapping[int, str] = {0: "4", 1: " ", 2: "1", 3: "h", 4: "2", 5: "b", 6: "k", 7: "r"}
"""The key that each button stands for: A, B, X, Y, left and right shoulder, back, start."""
LEGEND = (
    "left stick: walk   right stick: turn   A walk   B stop   X stand   Y high five\n"
    "left shoulder: sit   right shoulder: bow   back: go limp   start: recover"
)


@dataclass(frozen=True, slots=True)
class PadReading:
    """What a gamepad says."""

    axes: tuple[float, ...]  #: of its sticks, -1 to 1
    pressed: tuple[int, ...] = ()  #: buttons that have been pressed since the last reading

    @property
    def keys(self) -> str:
        """The keys that the buttons stand for."""
        return "".join(BUTTONS.get(button, "") for button in self.pressed)

    @property
    def command(self) -> VelocityCommand:
        """The velocity that the sticks ask for."""
        x, y, turn = (_share(self.axes, axis) for axis in (LEFT_Y, LEFT_X, RIGHT_X))
        return VelocityCommand(-AHEAD * x, -ASIDE * y, -TURNING * turn)


def _share(axes: tuple[float, ...], axis: int) -> float:
    """Of a stick's way beyond the dead zone, -1 to 1; 0 for an axis that there is not."""
    value = axes[axis] if axis < len(axes) else 0.0
    beyond = min(max(abs(value) - DEAD_ZONE, 0.0) / (1.0 - DEAD_ZONE), 1.0)
    return round(beyond if value > 0.0 else -beyond, 3)


@final
class Gamepad:
    """The first gamepad that pygame finds."""

    def __init__(self, pygame: Any) -> None:  # noqa: ANN401 - a module of an extra
        self._pygame, self._stick = pygame, pygame.joystick.Joystick(0)
        self._stick.init()
        self.name = str(self._stick.get_name())  #: what it calls itself
        self._held: frozenset[int] = frozenset()

    def read(self) -> PadReading | None:
        """What it says now; None once it is gone."""
        self._pygame.event.pump()
        if not self._pygame.joystick.get_count():
            return None
        stick = self._stick
        axes = tuple(float(stick.get_axis(n)) for n in range(stick.get_numaxes()))
        held = frozenset(n for n in range(stick.get_numbuttons()) if stick.get_button(n))
        pressed, self._held = tuple(sorted(held - self._held)), held
        return PadReading(axes, pressed)

    def close(self) -> None:
        """Let it go."""
        self._pygame.quit()


def find_gamepad() -> tuple[Gamepad | None, str]:
    """The gamepad that is plugged in, if any, and what there is to say of it."""
    # SDL wants a video driver for its events, and pygame greets on standard output.
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        pygame = importlib.import_module("pygame")
    except ImportError as error:
        return None, f"no gamepad ({error}); for one: {install_line('gamepad')}"
    try:
        pygame.display.init()
        pygame.joystick.init()
        if pygame.joystick.get_count():
            pad = Gamepad(pygame)
            return pad, f"gamepad: {pad.name}"
    except pygame.error as error:
        pygame.quit()
        return None, f"no gamepad: {error}"
    pygame.quit()
    return None, "no gamepad is plugged in: keys only"


SPEED_STEP = 0.1  #: Change of speed [m/s] by one key
TURN_STEP = 0.2  #: Change of the turning rate [rad/s] by one key
WIDTH = 79  #: Columns of the state line at most
JOIN_TIME = 5.0  #: Time [s] that a running call gets to end when the robot is let go

QUIT, STOP, DAMP = "x", " ", "k"
STEPS: Mapping[str, tuple[str, VelocityCommand]] = {
    "w": ("faster", VelocityCommand(SPEED_STEP, 0.0, 0.0)),
    "s": ("slower", VelocityCommand(-SPEED_STEP, 0.0, 0.0)),
    "a": ("turn left", VelocityCommand(0.0, 0.0, TURN_STEP)),
    "d": ("turn right", VelocityCommand(0.0, 0.0, -TURN_STEP)),
    "q": ("step left", VelocityCommand(0.0, SPEED_STEP, 0.0)),
    "e": ("step right", VelocityCommand(0.0, -SPEED_STEP, 0.0)),
}
ACTIONS: Mapping[str, tuple[str, Callable[[GO2Controller], bool]]] = {
    "1": ("stand", lambda go2: go2.stand()),
    "2": ("sit", lambda go2: go2.sit()),
    "3": ("lie down", lambda go2: go2.lie_down()),
    "4": ("walk", lambda go2: go2.walk()),
    "h": ("high five", lambda go2: go2.high_five()),
    "b": ("bow", lambda go2: go2.play("bow")),
    "r": ("recover", lambda go2: go2.recover()),
}


def keys_help() -> str:
    """Every key with what it does, for a person; at most 80 columns wide."""
    moves = [f"{key} {label}" for key, (label, _) in STEPS.items()]
    acts = [f"{key} {label}" for key, (label, _) in ACTIONS.items()]
    rows = [acts, moves, ["space stop", "k go limp", "x quit"]]
    return "\n".join("   ".join(row) for row in rows)


@final
class Teleop:
    """Turns keys into calls on a robot whose time passes by itself (``realtime=True``)."""

    def __init__(self, go2: GO2Controller) -> None:
        self._go2 = go2
        self._jobs = JobServer(go2)
        self._jobs.start("teleop")
        self._doing = ""
        self._news: SimpleQueue[str] = SimpleQueue()
        self._sticks_rest = True

    @property
    def is_busy(self) -> bool:
        """Whether a long call is running."""
        return bool(self._doing)

    def press(self, key: str) -> bool:
        """Do what ``key`` means; False if it means to end."""
        try:
            if key in STEPS:
                pairs = zip(astuple(self._go2.command), astuple(STEPS[key][1]), strict=True)
                self._move(VelocityCommand(*(round(now + step, 3) for now, step in pairs)))
            elif key in ACTIONS:
                self._begin(*ACTIONS[key])
            elif key == STOP:
                self._go2.stop()
            elif key == DAMP:
                self._jobs.damp()
                self._news.put("limp")
        except Go2WbcError as error:
            self._news.put(str(error))
        return key != QUIT

    def follow(self, reading: PadReading) -> bool:
        """Do what a gamepad says; False if it means to end."""
        goes_on = all([self.press(key) for key in reading.keys])
        wanted = reading.command
        if self.is_busy or self._go2.mode is not Mode.WALKING:
            self._sticks_rest = True
        elif not (wanted.is_zero and self._sticks_rest):
            self._sticks_rest = wanted.is_zero
            try:
                self._move(wanted)
            except Go2WbcError as error:  # it fell in between
                self._news.put(str(error))
        return goes_on

    def status(self) -> str:
        """One line of at most 80 columns: what it does, what is asked, measured, and a fault."""
        go2 = self._go2
        state, command, mode = go2.state, go2.command, go2.mode
        doing = f"{self._doing} ..." if self.is_busy else mode.name.lower()
        if mode in (Mode.FALLEN, Mode.DAMPED) and not self.is_busy:
            outcome = go2.last_outcome
            reason = "limp" if outcome.ok else outcome.reason
            return f"{doing:<13} r recovers, 1 stands: {reason}"[:WIDTH]
        asked = (
            f"{command.linear_x:+.1f} {command.linear_y:+.1f} m/s {command.angular_z:+.1f} rad/s"
        )
        measured = f"ahead {state.v[0]:+.2f} m/s, {state.q[2]:.2f} m high"
        return f"{doing:<13} asked {asked}; {measured}"[:WIDTH]

    def news(self) -> list[str]:
        """What has been said since the last call."""
        return [self._news.get() for _ in range(self._news.qsize())]

    def close(self) -> None:
        """Go limp, and wait for a running call to notice."""
        self._jobs.damp()
        self._jobs.abandon("the robot is let go", JOIN_TIME)

    def _move(self, wanted: VelocityCommand) -> None:
        self._go2.move(wanted.linear_x, wanted.angular_z, linear_y=wanted.linear_y)

    def _begin(self, label: str, act: Callable[[GO2Controller], bool]) -> None:
        if self.is_busy:
            self._news.put(f"{self._doing} is still running: k ends it")
            return
        self._doing = label

        def perform(_job: Job) -> Measurements:
            if not act(self._go2):
                raise Aborted(self._go2.last_outcome.reason)
            return {}

        def tell(answer: Outcome) -> None:
            if not isinstance(answer.error, ClosedError):
                self._news.put(f"{label}: {'done' if answer.ok else answer.reason}")
            self._doing = ""

        self._jobs.submit(Job(label, perform, tell))
