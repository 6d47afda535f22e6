"""Builders of phases: jumps, hops, rears and lifts, from standing to standing."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.rotations import yaw_rotation
from motions.dynamics.phases import ALL_FEET, Phase

GRAVITY = 9.81
_CROUCH = -0.06
_FOOTPRINT = np.array([[0.1934, 0.142], [0.1934, -0.142], [-0.1934, 0.142], [-0.1934, -0.142]])
_Body = tuple[float, float, float, float, float, float]


def jump(
    x: float = 0.0, y: float = 0.0, yaw: float = 0.0, height: float = 0.15
) -> tuple[Phase, ...]:
    """Jump from four feet to four feet."""
    half = 0.5 * _flight_time(height)
    up = _moved(0.5 * x, 0.5 * y, 0.5 * yaw, height)
    down = _moved(x, y, yaw, 0.0)
    return (
        Phase(0.30, body=(0.0, 0.0, _CROUCH, 0.0, 0.0, 0.0), label="crouch"),
        Phase(0.20, label="push"),
        Phase(half, frozenset(), feet=up, label="rise"),
        Phase(half, frozenset(), feet=down, label="fall"),
        Phase(0.20, label="land"),
        Phase(0.30, body=(x, y, 0.0, 0.0, 0.0, yaw), label="stand"),
    )


def _flight_time(height: float) -> float:
    return 2.0 * math.sqrt(2.0 * height / GRAVITY)


def _moved(x: float, y: float, yaw: float, z: float) -> dict[Leg, tuple[float, float, float]]:
    moved = _FOOTPRINT @ yaw_rotation(yaw)[:2, :2].T - _FOOTPRINT + [x, y]
    return {leg: (float(moved[leg, 0]), float(moved[leg, 1]), z) for leg in LEGS}
