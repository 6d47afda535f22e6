"""The ground below a walking robot: a plane through the places where its feet have met it.

The plane z = h + s (p - p_com), in the world, with its height h below the CoM and its slope s, is
carried along with the CoM. Where feet are met, h takes in a share of how far they are off it, and s
a share of the slope of the plane that fits, by least squares, where each foot was met last. How far
they are off it is also what tells rough ground, on which feet are raised higher.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.compilation import subroutine
from go2_wbc.records import Record
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, between, ranged

GROUND_SHARE = 0.5
"""Share of a landing foot's height that goes into the estimate of the ground's height. A pitch that
is believed 0.5 deg wrong is a slope that is not there, along which the plane is carried off between
landings: at 1 m/s it was up to 7 mm too high with 0.3, 3 mm with 0.5."""
LEAST_DETERMINANT = 1e-4
"""Of the feet's second moments [m^4], 0.01 when they stand squarely; below it they are in line."""
MOST_SLOPE = 0.6
"""Greatest slope that is believed; no foot holds on a steeper one."""
LEVEL_SLOPE = 0.05
"""Slope up to which the ground counts as level for the friction; from twice that on in full."""
MOST_DELAY = 0.8
"""Share of a swing after which it must go ahead at the latest."""


@dataclass(frozen=True, slots=True)
@ranged(
    NOT_NEGATIVE,
    slope_share=SHARE,
    calming=SHARE,
    stumble=POSITIVE,
    delay=between(0.0, MOST_DELAY),
)
class GroundConfig:
    """Numbers of the estimate, from a search on this robot in simulation.

    Attributes:
        slope_share: share of the slope that was found at a landing that is taken in.
        follow: share of the slope by which the trunk is tilted.
        smooth: distance [m] of a landing from the plane up to which the ground is smooth.
        most_raise: greatest height [m] that is added to the swing's apex, of which there is as much
            as the ground is rougher than that.
        calming: share of the roughness that is left after a landing.
        stumble: roughness [m] that a foot tells which is stopped in the middle of its swing.
        delay: share of a swing, on the roughest ground, in which the foot only rises. At a step of
            10 cm, feet that stood close to it rubbed along its face and stood on its edge: 4 of 40
            runs fell, none with this.
    """

    slope_share: float = 0.3
    follow: float = 0.7
    smooth: float = 0.015
    most_raise: float = 0.05
    calming: float = 0.8
    stumble: float = 0.06
    delay: float = 0.4


class Ground(Record):
    """What is known of the ground.

    Attributes:
        height: below the CoM [m].
        slope: ahead and to the left, in the world's axes.
        p_seen: where the CoM is [m].
        p_met: where each foot met it last, by its centre [m].
        roughness: distance [m] from the plane at which feet were met lately.
    """

    height: float
    slope: Float[np.ndarray, "2"]
    p_seen: Float[np.ndarray, "2"]
    p_met: Float[np.ndarray, "4 3"]
    roughness: float


def ground_below(now: Snapshot, foot_radius: float) -> Ground:
    """The plane through the feet as they stand."""
    ground = Ground(p_seen=now.p_world_com[:2], p_met=now.p_world_feet)
    ground.slope[:] = fitted_slope(ground)
    middle = ground.p_met.mean(axis=0)
    rise = ground.slope @ (ground.p_seen - middle[:2])
    ground.height = float(middle[2] + rise) - foot_radius
    return ground


@subroutine
def ground_at(g: Ground, x: float, y: float) -> float:
    """Height of the plane [m]."""
    return g.height + g.slope[0] * (x - g.p_seen[0]) + g.slope[1] * (y - g.p_seen[1])


@subroutine
def apex_raise(g: Ground, c: GroundConfig) -> float:
    """Height [m] by which a swing is higher than on smooth ground."""
    return min(max(g.roughness - c.smooth, 0.0), c.most_raise)


@subroutine
def delay(g: Ground, c: GroundConfig) -> float:
    """Share of a swing in which the foot only rises: none on smooth ground."""
    return c.delay * apex_raise(g, c) / c.most_raise if c.most_raise > 0.0 else 0.0


@subroutine
def tilt(g: Ground, c: GroundConfig) -> tuple[float, float]:
    """Slope that the trunk follows."""
    return c.follow * g.slope[0], c.follow * g.slope[1]


@subroutine
def level_friction(g: Ground, c: GroundConfig, friction: float, least: float) -> float:
    """Coefficient of the upright cone that lies within that about the ground's normal.

    A foot on a slope of 15 deg and a coefficient of 0.65 slides when it is pushed ahead with 0.6 of
    what it carries, although that is less: tan(atan(0.65) - 15 deg) is 0.33. Never below ``least``.
    What feet find of a slope on level ground takes nothing. Rough ground that rises is taken for
    stairs, whose steps are level: with less friction there one run of twelve up stairs fell, none
    without.
    """
    steep = np.hypot(g.slope[0], g.slope[1])
    steep *= min(max(steep / LEVEL_SLOPE - 1.0, 0.0), 1.0)
    if g.roughness > c.smooth:
        return friction
    return max((friction - steep) / (1.0 + friction * steep), least)


@subroutine
def carry_ground(g: Ground, now: Snapshot) -> None:
    """Follow the CoM."""
    x, y = now.p_world_com[0], now.p_world_com[1]
    g.height = ground_at(g, x, y)
    g.p_seen[0], g.p_seen[1] = x, y


@subroutine
def fitted_slope(g: Ground) -> tuple[float, float]:
    """Of the plane through where the feet were met, by least squares; as it was if in a line."""
    middle = np.zeros(3)
    for leg in range(4):
        for i in range(3):
            middle[i] += g.p_met[leg, i] / 4
    xx = xy = yy = xz = yz = 0.0
    for leg in range(4):
        p = g.p_met[leg]
        x, y, z = p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]
        xx += x * x
        xy += x * y
        yy += y * y
        xz += x * z
        yz += y * z
    determinant = xx * yy - xy * xy
    if determinant < LEAST_DETERMINANT:
        return g.slope[0], g.slope[1]
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    return min(max(a, -MOST_SLOPE), MOST_SLOPE), min(max(b, -MOST_SLOPE), MOST_SLOPE)


@subroutine
def learn_ground(
    g: Ground, c: GroundConfig, now: Snapshot, foot_radius: float, met: Bool[np.ndarray, "4"]
) -> None:
    """Take in where feet, of which some are ``met`` at this tick, have met the ground."""
    count, mean, most = 0, 0.0, 0.0
    for leg in range(4):
        if met[leg]:
            p = now.p_world_feet[leg]
            off = p[2] - foot_radius - ground_at(g, p[0], p[1])
            count += 1
            mean += off
            most = max(most, abs(off))
            for i in range(3):
                g.p_met[leg, i] = p[i]
    if count == 0:
        return
    g.roughness = max(c.calming * g.roughness, most)
    g.height += GROUND_SHARE * mean / count
    a, b = fitted_slope(g)
    g.slope[0] += c.slope_share * (a - g.slope[0])
    g.slope[1] += c.slope_share * (b - g.slope[1])


@subroutine
def note_stumble(g: Ground, c: GroundConfig) -> None:
    """Take in that a foot was stopped in its swing."""
    g.roughness = max(g.roughness, c.stumble)
