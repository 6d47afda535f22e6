"""The authoring language: what body and feet do, and when.

A ``Timeline`` is a value; every method returns a longer one. Time is a cursor that each call moves
on by ``over`` seconds (beats, after ``bpm`` or ``on_beats``); ``at`` puts it elsewhere and
``together`` runs parts side by side. Positions are offsets from the pose in which the motion
starts: x ahead, y left, z up.

    Timeline().body(pitch=deg(15), z=-0.05, over=0.8).hold(0.4).home(over=0.8)

Steps put feet on new footholds; from then on offsets are relative to these.

A raised foot is off the ground until it is put down; before it is raised the body moves over the
other feet, unless the motion is made with ``balance=False``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import TimelineError
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.language.arrangement import Arrangement
from motions.language.body_and_feet import BodyAndFeet
from motions.language.dynamic_blocks import DynamicBlocks
from motions.language.footing import Footing
from motions.language.keys import PhaseKey, StepKey
from motions.language.steps import Steps
from motions.language.timeline_data import SAME
from motions.postures import standing_feet


class Timeline(BodyAndFeet, Steps, DynamicBlocks, Arrangement):
    """An authored motion; ``motions.language`` holds its calls."""

    __slots__ = ()

    @property
    def end_pose(self) -> tuple[float, float, float]:
        """Where it ends: x, y [m] and yaw [rad] of the frame of the feet, seen from its start.

        Of the installed Go2, with its feet below its hips at first.
        """
        nominal = _nominal_feet()
        feet, start = nominal, 0.0
        for block in self.in_order(PhaseKey):
            feet = Footing(self._between(start, block.start), nominal, feet).end
            heading = yaw_rotation(Anchor.of_feet(feet, 0.0).yaw)
            feet, start = feet + block.shift @ heading.T, block.end
        return Anchor.of_feet(Footing(self._between(start, math.inf), nominal, feet).end, 0.0).pose

    def reverse(self) -> Timeline:
        """The same motion backwards; it must end at home, with its feet below their hips.

        A foot that steps goes back to where it came from.

        Raises:
            TimelineError: if it does not, or holds a call that has no way back.
        """
        steps = (
            Footing(self, _nominal_feet()).steps_back(self.end) if self.in_order(StepKey) else {}
        )
        return self._reversed(steps)

    def _between(self, start: float, end: float) -> Timeline:
        """What is written from ``start`` to ``end`` [s]."""
        keys = (key for key in self.keys if not isinstance(key, PhaseKey))
        return replace(self, keys=tuple(key for key in keys if start - SAME <= key.start < end))


@cache
def _nominal_feet() -> Float[np.ndarray, "4 3"]:
    return standing_feet(RobotModel())


@typed(error=TimelineError)
def deg(angle: float) -> float:
    """``angle`` degrees in radians."""
    return math.radians(angle)
