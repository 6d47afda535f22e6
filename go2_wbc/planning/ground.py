"""The ground below a walking robot: a plane through the places where its feet have met it.

The plane z = h + s (p - p_com), in the world, with its height h below the CoM and its slope s, is
carried along with the CoM. Where feet are met, h takes in a share of how far they are off it, and s
a share of the slope of the plane that fits, by least squares, where each foot was met last. How far
they are off it is also what tells rough ground, on which feet are raised higher.

``kernels.ground`` is the compiled form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import (
    require_between,
    require_not_negative,
    require_positive,
    require_share,
)

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

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_share(self, "slope_share", "calming")
        require_not_negative(self, "follow", "smooth", "most_raise")
        require_between(self, 0.0, MOST_DELAY, "delay")
        require_positive(self, "stumble")


class GroundPlane:
    """What is known of the ground.

    Attributes:
        height: below the CoM [m].
        slope: ahead and to the left, in the world's axes.
        roughness: distance [m] from the plane at which feet were met lately.
    """

    def __init__(self, snapshot: Snapshot, foot_radius: float, config: GroundConfig) -> None:
        """The plane through the feet as they stand."""
        self._config, self._radius = config, foot_radius
        self._p_met = snapshot.p_world_feet.copy()
        self._p_com = snapshot.p_world_com[:2].copy()
        self.slope = self._fitted(np.zeros(2))
        middle = self._p_met.mean(axis=0)
        self.height = float(middle[2] + self.slope @ (self._p_com - middle[:2])) - foot_radius
        self.roughness = 0.0

    @property
    def tilt(self) -> Float[np.ndarray, "2"]:
        """Slope that the trunk follows."""
        return self._config.follow * self.slope

    @property
    def apex_raise(self) -> float:
        """Height [m] by which a swing is higher than on smooth ground."""
        return min(max(self.roughness - self._config.smooth, 0.0), self._config.most_raise)

    @property
    def delay(self) -> float:
        """Share of a swing in which the foot only rises: none on smooth ground."""
        config = self._config
        return config.delay * self.apex_raise / config.most_raise if config.most_raise else 0.0

    def at(self, place: Float[np.ndarray, "2"]) -> float:
        """Height [m] at ``place`` [m]."""
        return self.height + float((place - self._p_com) @ self.slope)

    def above(self, p_feet: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Height [m] of feet, of which the centres are given, over the ground."""
        return np.array([p[2] - self._radius - self.at(p[:2]) for p in p_feet])

    def level_friction(self, friction: float, least: float) -> float:
        """Coefficient of the upright cone that lies within that about the ground's normal.

        A foot on a slope of 15 deg and a coefficient of 0.65 slides when it is pushed ahead with
        0.6 of what it carries, although that is less: tan(atan(0.65) - 15 deg) is 0.33. Never below
        ``least``. What feet find of a slope on level ground takes nothing. Rough ground that rises
        is taken for stairs, whose steps are level: with less friction there one run of twelve up
        stairs fell, none without.
        """
        if self.roughness > self._config.smooth:
            return friction
        steep = float(np.hypot(*self.slope))
        steep *= min(max(steep / LEVEL_SLOPE - 1.0, 0.0), 1.0)
        return max((friction - steep) / (1.0 + friction * steep), least)

    def carry(self, snapshot: Snapshot) -> None:
        """Follow the CoM."""
        p_com = snapshot.p_world_com[:2]
        self.height = self.at(p_com)
        self._p_com = p_com.copy()

    def learn(self, p_feet: Float[np.ndarray, "4 3"], met: Bool[np.ndarray, "4"]) -> None:
        """Take in where feet, of which some are ``met`` at this tick, have met the ground."""
        off = self.above(p_feet[met])
        self.roughness = max(self._config.calming * self.roughness, float(np.abs(off).max()))
        self.height += GROUND_SHARE * float(off.mean())
        self._p_met[met] = p_feet[met]
        self.slope = self.slope + self._config.slope_share * (self._fitted(self.slope) - self.slope)

    def stumble(self) -> None:
        """Take in that a foot was stopped in its swing."""
        self.roughness = max(self.roughness, self._config.stumble)

    def _fitted(self, otherwise: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
        """Slope of the plane through where the feet were met; ``otherwise`` if that is a line."""
        off = self._p_met - self._p_met.mean(axis=0)
        moments = off[:, :2].T @ off
        (xx, xy, xz), (_, yy, yz) = moments.tolist()
        determinant = xx * yy - xy * xy
        if determinant < LEAST_DETERMINANT:
            return otherwise
        slope = np.array([yy * xz - xy * yz, xx * yz - xy * xz]) / determinant
        return np.clip(slope, -MOST_SLOPE, MOST_SLOPE)


def tilted_rotation(yaw: float, slope: Float[np.ndarray, "2"]) -> Float[np.ndarray, "3 3"]:
    """Of a trunk with that heading whose z axis is the normal of a plane with that ``slope``."""
    x = yaw_rotation(yaw)[:, 0]
    x[2] = slope @ x[:2]
    z = np.array([-slope[0], -slope[1], 1.0])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def tilt_vector(slope: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
    """The turn about x and y [rad], in the world, from level to a plane with that ``slope``."""
    steep = float(np.hypot(*slope))
    share = np.arctan(steep) / steep if steep > 0.0 else 1.0
    return share * np.array([slope[1], -slope[0]])
