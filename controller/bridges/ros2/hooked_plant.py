"""A plant with a hook: something happens after every control period, in the loop's own thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import final

from go2_wbc.plant.base import Plant
from go2_wbc.robot.state import JointCommand, RobotState


@final
class HookedPlant(Plant):
    """Hands everything on to another plant and calls ``after_write`` after every ``write``.

    The middleware is served there: no second thread fights with the control loop for the
    interpreter, and robot time passes only in one place.

    Attributes:
        after_write: what is called; not from within itself.
    """

    def __init__(self, inner: Plant) -> None:
        """Drive ``inner``."""
        self.inner = inner
        self.after_write: Callable[[], None] = lambda: None
        self._is_inside = False

    @property
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""
        return self.inner.control_period

    def read(self) -> RobotState:
        """The newest measured state."""
        return self.inner.read()

    def write(self, command: JointCommand) -> None:
        """Apply ``command`` for one control period, then call the hook."""
        self.inner.write(command)
        if self._is_inside:
            return
        self._is_inside = True
        try:
            self.after_write()
        finally:
            self._is_inside = False

    def silence(self) -> None:
        """Call nothing any more."""
        self.after_write = lambda: None

    def close(self) -> None:
        """Release everything."""
        self.inner.close()
