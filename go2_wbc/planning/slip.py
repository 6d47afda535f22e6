"""Friction of the ground, from feet that slide.

A foot that carries load and slides has less friction than it was counted on. While one does, the
estimate falls towards what that foot shows, and otherwise it recovers, slowly:

    mu' = (mu_shown - mu) / T   while a foot slides,    mu' = r   else,    mu <= mu_most
    mu_shown = f_t / f_n / (1 + v / v_half),    mu_least <= mu_shown <= mu

The forces along the ground and into it, ``f_t`` and ``f_n``, are those that the measured torques of
the foot's leg make. Part of ``f_t`` has gone into the leg that slides, not into the ground: more
of it the faster it is. A foot that creeps at the edge of its friction, as one that a push has
overloaded, shows nearly the ratio that it bore, and the estimate hardly falls. To fall towards the
least at every slide took the force away with which the robot would have caught itself: of 40 trots
with their calves at their stops and pushes of 20 N s 3 fell. As it is now 4 of 150 fall, and 6 of
150 without an estimate (own simulation, seeds 0 to 149; of the 20 that are judged 2, and none).

A foot slides if its contact point has been faster than a speed for some time. Just after touchdown
it may: there the foot still comes to rest. One that chatters while it slides, which on the robot's
own sensors made it fall on a friction of 0.2, has not come down anew: what it has stood passes away
while it does not touch, from twice the time after touchdown on.

``kernels.slip`` is the compiled form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative, require_positive

_TINY = 1e-9
"""Force [N], over a determinant, that stands in for none where one divides by it."""


@dataclass(frozen=True, slots=True)
class SlipConfig:
    """Numbers of the estimate, from a search on this robot in simulation.

    Attributes:
        speed: of the contact point, along the ground [m/s], above which a foot slides.
        patience: time [s] for which it must.
        mask: time [s] after touchdown in which it may. At 3 m/s feet that hold slide longer.
        steepness: greatest ratio of its vertical speed to that: a foot that comes off the edge of a
            step says nothing of the friction.
        time_constant: of the fall [s].
        recovery: rate [1/s] of the rise.
        least, most: bounds of the estimate; it begins at the latter.
        half_speed: of a sliding contact point [m/s], at which the ground bears half of the force
            along it that the torques make.
    """

    speed: float = 0.1
    patience: float = 0.004
    mask: float = 0.02
    steepness: float = 0.35
    time_constant: float = 0.03
    recovery: float = 0.1
    least: float = 0.12
    most: float = 0.6
    half_speed: float = 0.5

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_positive(self, "speed", "steepness", "time_constant", "least", "most", "half_speed")
        require_not_negative(self, "patience", "mask", "recovery")
        if self.least > self.most:
            raise ConfigError(
                f"SlipConfig.least must be at most .most, got {self.least} and {self.most}"
            )


class SlipObserver:
    """Watches the feet.

    Attributes:
        friction: the estimate.
    """

    def __init__(self, config: SlipConfig) -> None:
        """Nothing has slid yet."""
        self._config = config
        self.friction = config.most
        self._loaded, self._sliding = np.zeros(4), np.zeros(4)

    def update(self, snapshot: Snapshot, stance: Bool[np.ndarray, "4"], dt: float) -> None:
        """Look at the feet that shall stand, ``dt`` seconds after the last look."""
        config = self._config
        speed = np.linalg.norm(snapshot.v_world_contacts[:, :2], axis=1)
        touches = snapshot.state.feet_in_contact
        lost = np.maximum(np.minimum(self._loaded + dt, 2.0 * config.mask) - 2.0 * dt, 0.0)
        self._loaded = np.where(touches, self._loaded + dt, lost) * stance
        slope = np.abs(snapshot.v_world_contacts[:, 2]) <= config.steepness * speed
        may_slide = self._loaded > config.mask
        slides = may_slide & touches & (speed > config.speed) & slope
        counted = np.where(slides, self._sliding + dt, 0.0)
        self._sliding = np.where(touches | ~may_slide, counted, self._sliding)
        slips = slides & (self._sliding > config.patience)
        if slips.any():
            shown = (exerted_ratios(snapshot) / (1.0 + speed / config.half_speed))[slips].min()
            fall = min(max(float(shown), config.least) - self.friction, 0.0)
            self.friction += fall * min(dt / config.time_constant, 1.0)
        else:
            self.friction = min(self.friction + config.recovery * dt, config.most)


def exerted_ratios(snapshot: Snapshot) -> Float[np.ndarray, "4"]:
    """Force of each foot along the ground over that into it, as the torques of its leg make them.

    ``J' f = h - tau`` of the leg's own joints, whose accelerations are left out. Cramer's rule
    gives f up to the determinant, of which a ratio needs only the sign, so that a straight leg does
    no harm. Huge for a foot that does not press on the ground.
    """
    ratios = np.empty(4)
    for leg in LEGS:
        joints = slice(6 + 3 * leg, 9 + 3 * leg)
        x, y, z = snapshot.J_contacts[leg][:, joints].T
        a, b, c = snapshot.bias[joints] - snapshot.state.tau[3 * leg : 3 * leg + 3]
        f = a * np.cross(y, z) + b * np.cross(z, x) + c * np.cross(x, y)
        pressure = f[2] * np.sign(x @ np.cross(y, z))
        ratios[leg] = np.hypot(f[0], f[1]) / max(float(pressure), _TINY)
    return ratios
