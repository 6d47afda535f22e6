"""All families of the exam."""

from __future__ import annotations

from benchmarks.exam.drawing import Family
from benchmarks.exam.dynamic_families import DYNAMIC
from benchmarks.exam.feet_families import FEET
from benchmarks.exam.going_families import GOING
from benchmarks.exam.trunk_families import TRUNK

FAMILIES: dict[str, Family] = {f.name: f for f in (*TRUNK, *FEET, *GOING, *DYNAMIC)}
"""By name."""
