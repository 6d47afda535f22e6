"""All families of the exam."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.exam.drawing import Family
from benchmarks.exam.dynamic_families import DYNAMIC
from benchmarks.exam.feet_families import FEET
from benchmarks.exam.going_families import GOING
from benchmarks.exam.trunk_families import TRUNK

TWICE = (
    "two_tracks", "three_tracks", "gaze", "random_trunk", "four_steps", "leaning_walk",
    "leaning_trot", "higher_hops", "jump_anywhere", "two_jumps", "phased_dip",
    *(family.name for family in FEET),
)  # fmt: skip
"""Families whose draws differ most, and all in which feet are raised: of each, two are bisected."""
FAMILIES: dict[str, Family] = {
    family.name: replace(family, draws=2) if family.name in TWICE else family
    for family in (*TRUNK, *FEET, *GOING, *DYNAMIC)
}
"""By name."""
