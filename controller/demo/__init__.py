"""The demo: stand, sit, walk, turn, high five, measured step by step.

``run_demo(go2)`` runs it on any controller and returns a ``DemoReport``; it reads no files and
prints nothing. ``main`` is the console script ``high_five_demo``, the same as ``go2-wbc demo``.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controller.demo.report import DemoReport, DemoTotals, Measurement, StepResult
    from controller.demo.run import DemoProgress, run_demo
    from controller.demo.steps import DEMO_STEPS, DemoStep

__all__ = [
    "DEMO_STEPS",
    "DemoProgress",
    "DemoReport",
    "DemoStep",
    "DemoTotals",
    "Measurement",
    "StepResult",
    "main",
    "run_demo",
]

_HOMES = {
    "DEMO_STEPS": "steps",
    "DemoProgress": "run",
    "DemoReport": "report",
    "DemoStep": "steps",
    "DemoTotals": "report",
    "Measurement": "report",
    "StepResult": "report",
    "run_demo": "run",
}


def __getattr__(name: str) -> object:
    """Import the heavy parts when they are first asked for: the console script starts fast."""
    if name not in _HOMES:
        raise AttributeError(f"module 'controller.demo' has no attribute {name!r}")
    return getattr(importlib.import_module(f"controller.demo.{_HOMES[name]}"), name)


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``go2-wbc demo``.

    Args:
        argv: options of the demo; by default those of the process.

    Returns:
        The exit code: 0 if every step was done, 1 if not, 2 usage, 3 runtime error.
    """
    import sys

    from controller.cli.main import main as run_command_line

    return run_command_line(["demo", *(sys.argv[1:] if argv is None else argv)])
