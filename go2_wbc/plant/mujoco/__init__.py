"""MuJoCo as a plant: the model built from the URDF or a user's MJCF, and the plant that runs it."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType


class _Later(ModuleType):
    """A module that is imported when something of it is asked for."""

    def __getattr__(self, name: str) -> object:
        return getattr(import_module(self.__name__), name)


def _import_without_windows() -> None:
    """MuJoCo, but not the library of its windows.

    That starts a process to look for itself, 0.05 s of processor time, and physics has no window.
    """
    sys.modules["glfw"] = _Later("glfw")
    try:
        import_module("mujoco")
    finally:
        del sys.modules["glfw"]


if not sys.modules.keys() & {"mujoco", "glfw"}:
    _import_without_windows()
