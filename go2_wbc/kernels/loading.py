"""All kernels at once, before a robot is taken over: a loop must not wait for a compiler."""

from __future__ import annotations

from importlib import import_module

from go2_wbc import compilation

KERNELS = (
    "condensed",
    "locomotion",
    "motor",
    "mpc",
    "playing",
    "preview",
)
"""Modules of this package whose import compiles, or loads what was compiled."""


def load_kernels() -> None:
    """Compile every kernel, or load it: half a second, or about 20 s the first time."""
    compilation.load_kernels()
    for name in KERNELS:
        import_module(f"go2_wbc.kernels.{name}")
