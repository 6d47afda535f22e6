"""Runs over seeds: a function of a seed in many processes, its rows in one file, what they say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.sweeps.run import Progress, SweepResult, read_sweep, sweep

__all__ = ["Progress", "SweepResult", "read_sweep", "sweep"]

__getattr__ = lazy_exports(__name__)
