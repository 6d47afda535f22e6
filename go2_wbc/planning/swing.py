"""Swing foot curves: from lift-off over an apex to a touchdown that may still move.

With the share ``u`` of a span of ``T`` seconds and the ease ``s(u) = 3 u^2 - 2 u^3``, a coordinate
goes from ``a`` to ``b`` as ``p = a + s (b - a)``; so ``v = s' (b - a) / T`` and
``a = s'' (b - a) / T^2``. Horizontally the span is the swing, or what is left of it after a delay,
vertically each half of it.

How high a foot is raised, and how late it goes ahead, is settled when it leaves the ground. What is
learnt of the ground meanwhile is for the next swing: a curve that was changed on the way jumped by
5 cm, and feet that swung beside the one that had stumbled came down too early, too far back. A foot
that is stopped in the middle of its swing begins another one where it is, in the time that is left:
it rises along what it has met before it goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.planning.ground import GroundPlane
from go2_wbc.validation import require_not_negative, require_positive

TIE = 1e-9
"""Progress this near to the middle counts as the middle, where the acceleration changes its sign:
a gait passes through it in whole ticks, and rounding must not decide."""


@dataclass(frozen=True, slots=True)
class SwingConfig:
    """Shape of a swing.

    Attributes:
        apex: height [m] of the foot above the higher of lift-off and touchdown. Over boxes of up
            to 8 cm at 1.0 m/s the trot fell in 5 of 20 runs with 6 cm, in none with 9 or 10; on
            the flat, 10 cm takes a third more torque at 1.5 m/s than 9.
        touchdown_depth: distance [m] below the ground at which touchdown is aimed, so that the
            foot arrives with certainty.
        full_depth_way: length [m] of a swing up to which that is the depth; beyond, it shrinks with
            the square of the length. A foot that is aimed below the ground by a share ``s`` of the
            apex meets it while it still moves ahead, at ``3 sqrt(s / 3)`` times its mean speed: 2
            m/s at 3 m/s, which threw 4 of 10 robots, all on floors of 0.8 and more; 0.9 as it is.
    """

    apex: float = 0.09
    touchdown_depth: float = 0.008
    full_depth_way: float = 0.4

    def __post_init__(self) -> None:
        """Raise ConfigError for a length that is out of range."""
        require_positive(self, "apex", "full_depth_way")
        require_not_negative(self, "touchdown_depth")

    def depth(self, way: float) -> float:
        """How far [m] below the ground a swing of length ``way`` [m] is aimed."""
        return self.touchdown_depth * min(1.0, self.full_depth_way / max(way, TIE)) ** 2

    def at_most(self, apex: float) -> SwingConfig:
        """The same with an apex [m] of ``apex`` if that is lower."""
        return replace(self, apex=min(self.apex, apex))


@dataclass(frozen=True, slots=True)
class Swing:
    """How the swing of one foot has begun.

    Attributes:
        start: where the foot was [m].
        raised: height [m] by which its apex is higher than on smooth ground.
        delay: share of it in which the foot only rises.
        begun: share of the gait's swing that had passed by then.
    """

    start: Float[np.ndarray, "3"]
    raised: float = 0.0
    delay: float = 0.0
    begun: float = 0.0

    @staticmethod
    def from_ground(start: Float[np.ndarray, "3"], ground: GroundPlane) -> Swing:
        """That of a foot which leaves the ``ground``."""
        return Swing(start.copy(), ground.apex_raise, ground.delay)

    def resumed(
        self, p_foot: Float[np.ndarray, "3"], progress: float, ground: GroundPlane
    ) -> Swing:
        """That of a foot which has been stopped at ``progress``; it goes on so once in a swing.

        It is raised as high as the time allows that is left, and not higher for the ground: to lift
        it by 7 cm within 44 ms took 590 N from the standing feet.
        """
        return self if self.begun else Swing(p_foot.copy(), 0.0, ground.delay, progress)

    def at(
        self, goal: Float[np.ndarray, "3"], progress: float, duration: float, config: SwingConfig
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """See ``swing_foot``; ``progress`` and ``duration`` are those of the gait's swing."""
        share = 1.0 - self.begun
        shape = replace(config, apex=share * (config.apex + self.raised))
        inside = (progress - self.begun) / share
        return swing_foot(self.start, goal, inside, share * duration, shape, self.delay)


def swing_foot(
    start: Float[np.ndarray, "3"],
    goal: Float[np.ndarray, "3"],
    progress: float,
    duration: float,
    config: SwingConfig,
    delay: float = 0.0,
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Position, velocity, acceleration of the foot centre in the world.

    Horizontally one cubic: it follows late changes of the goal better than minimum jerk, whose
    speed is gone sooner. Vertically two that meet, at rest, at the apex.

    Args:
        start: where the foot left the ground [m].
        goal: where it shall touch down [m]; may change from call to call.
        progress: share of the swing that has passed, 0 to 1.
        duration: of the whole swing [s].
        config: apex and touchdown depth.
        delay: share of the swing, below 1, in which the foot only rises.
    """
    p, v, a = np.empty(3), np.empty(3), np.empty(3)
    delta, span = goal[:2] - start[:2], duration * (1.0 - delay)
    p[:2], v[:2], a[:2] = start[:2], 0.0, 0.0
    if progress >= delay - TIE:
        s, ds, dds = Ease.CUBIC.progress((progress - delay) / (1.0 - delay))
        p[:2] += s * delta
        v[:2] = ds / span * delta
        a[:2] = dds / span**2 * delta
    apex = max(start[2], goal[2]) + config.apex
    is_rising = progress < 0.5 - TIE
    ground = goal[2] - config.depth(float(np.hypot(*delta)))
    begin, end = (start[2], apex) if is_rising else (apex, ground)
    s, ds, dds = Ease.CUBIC.progress(2.0 * progress - (0.0 if is_rising else 1.0))
    p[2] = begin + s * (end - begin)
    v[2] = ds * (end - begin) * 2.0 / duration
    a[2] = dds * (end - begin) * 4.0 / duration**2
    return p, v, a
