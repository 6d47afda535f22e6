"""The pilot: ``GO2Controller`` and everything behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controller.go2_controller import GO2Controller
    from controller.modes import Mode, Outcome

__all__ = ["GO2Controller", "Mode", "Outcome"]


def __getattr__(name: str) -> object:
    """Import the heavy parts when they are first asked for: the command line starts fast."""
    if name == "GO2Controller":
        from controller.go2_controller import GO2Controller

        return GO2Controller
    if name in ("Mode", "Outcome"):
        from controller import modes

        return getattr(modes, name)
    raise AttributeError(f"module 'controller' has no attribute {name!r}")
