"""Builders of phases: jumps, hops, rears and lifts, from standing to standing."""

from __future__ import annotations

import math

import numpy as np

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


def hop(times: int = 3, period: float = 0.5, height: float = 0.05) -> tuple[Phase, ...]:
    """Hop in place, touching down once a ``period`` [s]."""
    half = 0.5 * _flight_time(height)
    up, down = _moved(0.0, 0.0, 0.0, height), _moved(0.0, 0.0, 0.0, 0.0)
    ground = period - 2.0 * half
    phases = [Phase(0.30, body=(0.0, 0.0, _CROUCH, 0.0, 0.0, 0.0), label="crouch")]
    for count in range(1, times + 1):
        phases += [
            Phase(0.20 if count == 1 else ground, label=f"push {count}"),
            Phase(half, frozenset(), feet=up, label=f"rise {count}"),
            Phase(half, frozenset(), feet=down, label=f"fall {count}"),
        ]
    phases += [
        Phase(0.20, label="land"),
        Phase(0.30, body=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), label="stand"),
    ]
    return tuple(phases)


REAR, FRONT = frozenset({Leg.RL, Leg.RR}), frozenset({Leg.FL, Leg.FR})


def rear(
    pitch: float = math.radians(-25.0),
    hold: float = 0.6,
    x: float | None = None,
    z: float = 0.03,
    lean: float = -0.06,
) -> tuple[Phase, ...]:
    """Rear up on the rear feet, the trunk at ``pitch`` (negative: front up)."""
    if x is None:
        x = -0.19 * (1.0 - 1.0 / math.cosh(0.5 * hold / 0.175))
    up: _Body = (x, 0.0, z, 0.0, pitch, 0.0)
    return (
        Phase(0.40, body=(lean, 0.0, -0.05, 0.0, 0.0, 0.0), label="lean back"),
        Phase(0.20, label="push"),
        Phase(0.5 * hold, REAR, body=up, label="rear up"),
        Phase(0.5 * hold, REAR, feet={leg: (0.0, 0.0, 0.0) for leg in FRONT}, label="down"),
        Phase(0.20, label="land"),
        Phase(0.40, body=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), label="stand"),
    )


def lift(
    legs: tuple[Leg, ...] = (Leg.FL, Leg.RR), hold: float = 0.35, height: float = 0.06
) -> tuple[Phase, ...]:
    """Lift feet together and put them down where they stood."""
    up = {leg: (0.0, 0.0, height) for leg in legs}
    down = {leg: (0.0, 0.0, 0.0) for leg in legs}
    stance = ALL_FEET - frozenset(legs)
    return (
        Phase(0.40, label="shift"),
        Phase(0.5 * hold, stance, feet=up, label="lift"),
        Phase(0.5 * hold, stance, feet=down, label="lower"),
        Phase(0.20, label="land"),
        Phase(0.30, body=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), label="stand"),
    )
