"""A gamepad for ``controller.teleop``: sticks are a velocity, buttons are keys.

The library (pygame-ce, SDL inside) is optional and imported when a gamepad is looked for. Its
numbers are those of SDL for the pads of an Xbox, which most others imitate.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

from go2_wbc.extras import install_line
from go2_wbc.planning.command import VelocityCommand

DEAD_ZONE = 0.12
"""Share of a stick's way around its middle that counts as none (own choice: worn sticks)."""
AHEAD, ASIDE, TURNING = 1.0, 0.4, 1.5
"""Speeds [m/s] and turning rate [rad/s] of a stick that is pushed to its end."""
LEFT_X, LEFT_Y, RIGHT_X = 0, 1, 3
"""Axes of the sticks; right and down are positive."""
BUTTONS: Mapping[int, str] = {0: "4", 1: " ", 2: "1", 3: "h", 4: "2", 5: "b", 6: "k", 7: "r"}
"""The key that each button stands for: A, B, X, Y, left and right shoulder, back, start."""
LEGEND = (
    "left stick: walk   right stick: turn   A walk   B stop   X stand   Y high five\n"
    "left shoulder: sit   right shoulder: bow   back: go limp   start: recover"
)


@dataclass(frozen=True, slots=True)
class PadReading:
    """What a gamepad says.

    Attributes:
        axes: of its sticks, -1 to 1.
        pressed: buttons that have been pressed since the last reading.
    """

    axes: tuple[float, ...]
    pressed: tuple[int, ...] = ()

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
    """The first gamepad that pygame finds.

    Attributes:
        name: what it calls itself.
    """

    def __init__(self, pygame: Any) -> None:  # noqa: ANN401 - a module of an extra
        """Take ``pygame.joystick``'s first."""
        self._pygame, self._stick = pygame, pygame.joystick.Joystick(0)
        self._stick.init()
        self.name = str(self._stick.get_name())
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
