"""The authoring language: what body and feet do, and when.

A ``Timeline`` is a value; every method returns a longer one. Time is a cursor that each call moves
on by ``over`` seconds (beats, after ``bpm`` or ``on_beats``); ``at`` puts it elsewhere and
``together`` runs parts side by side. Places are offsets from the pose in which the motion starts: x
ahead, y left, z up.

    Timeline().body(pitch=deg(15), z=-0.05, over=0.8).hold(0.4).home(over=0.8)

A foot that is raised is off the ground until it is put down; the body first moves over the feet
that stay, unless the motion is made with ``balance=False``.
"""

from __future__ import annotations

import math

from motions.language.shapes import Shapes
from motions.language.transforms import Transforms


class Timeline(Shapes, Transforms):
    """An authored motion; ``motions.language`` holds its calls."""

    __slots__ = ()


def deg(angle: float) -> float:
    """``angle`` degrees in radians."""
    return math.radians(angle)
