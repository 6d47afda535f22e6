"""The demo: stand, sit, walk, turn, high five, measured step by step.

``run_demo(go2)`` runs it on any controller and returns a ``DemoReport``; it reads no files and
prints nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.demo.steps import (
        DEMO_STEPS,
        DemoProgress,
        DemoReport,
        DemoStep,
        DemoTotals,
        Measurement,
        StepResult,
        run_demo,
    )

__all__ = [
    "DEMO_STEPS",
    "DemoProgress",
    "DemoReport",
    "DemoStep",
    "DemoTotals",
    "Measurement",
    "StepResult",
    "run_demo",
]

__getattr__ = lazy_exports(__name__)
