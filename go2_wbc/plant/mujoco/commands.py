"""The commands that a simulated robot has been given, each acting after the delay."""

from __future__ import annotations

import math
from collections import deque
from typing import final

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError
from go2_wbc.robot.state import JointCommand

_FIELDS = ("tau", "q_des", "v_des", "kp", "kd")


@final
class DelayedCommands:
    """Checks commands, and gives each back after as many control periods as it is late."""

    def __init__(self, late: int) -> None:
        """Keep each command for ``late`` control periods."""
        self._late = late
        self._waiting: deque[Float[np.ndarray, "5 12"]] = deque()
        self._acting = np.zeros((5, 12))  # until a delayed one arrives

    @property
    def waiting(self) -> tuple[Float[np.ndarray, "5 12"], ...]:
        """Those that have not acted yet, the next first."""
        return tuple(self._waiting)

    @waiting.setter
    def waiting(self, commands: tuple[Float[np.ndarray, "5 12"], ...]) -> None:
        self._waiting = deque(commands)

    def next(self, command: JointCommand) -> Float[np.ndarray, "5 12"]:
        """Take ``command``; returns the numbers of the one that acts now, in the order of fields.

        Raises:
            CommandError: if it has a value that is not finite, or an array of the wrong shape.
        """
        rows = (command.tau, command.q_des, command.v_des, command.kp, command.kd)
        for name, row in zip(_FIELDS, rows, strict=True):
            if row.shape != (12,):
                raise CommandError(f"command.{name} must have shape (12,), got {row.shape}")
        accepted = np.array(rows, dtype=float)
        if not math.isfinite(np.vdot(accepted, accepted)):  # cheap, but huge numbers overflow
            for name, row in zip(_FIELDS, rows, strict=True):
                if not np.isfinite(row).all():
                    raise CommandError(f"command.{name} is not finite: {row}")
        self._waiting.append(accepted)
        if len(self._waiting) > self._late:
            self._acting = self._waiting.popleft()
        return self._acting
