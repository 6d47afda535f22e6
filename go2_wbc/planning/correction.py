"""Slow integral action on the body's reference.

A task of the whole-body QP is a proportional-derivative law: under an unknown payload or dry joint
friction its error settles at a value that is not zero. The correction adds the integral of the
error to the reference,

    o' = rate * clip(e, -window, window);   |o| <= limit,

per axis in the world, so that the measured body settles where it was asked to be. The window bounds
how fast the correction grows. An error beyond it still counts: a body that a load or dry friction
holds far off would otherwise stay there for good. The limit bounds what is stored up (anti-windup
by saturation: Astrom & Hagglund, PID Controllers, 1995, sec. 3.5), for instance while the body is
on its way, or by a contact that gives way.

A payload is felt only after a while, and until then the correction holds it. Once it is known, what
is done against it is taken out of the correction; the integral alone would do that in half a
second, in which a robot that had just stood up with 4 kg 8 cm aside leaned by 6 deg.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.reference import BodyTarget, TrackedPoint
from go2_wbc.robot.rotations import exp_rotation, log_rotation, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative


@dataclass(frozen=True, slots=True)
class CorrectionConfig:
    """Numbers of the correction.

    The angles were found on the simulated robot: a load of 4 kg, 5 cm beside its middle, leans it
    by 15 deg where errors beyond 0.1 rad are dropped, by 9 with a limit of 0.15 rad, by 2 with
    these.

    Attributes:
        rate: share of the remaining error that is added per second [1/s].
        position_limit: greatest correction [m] per axis.
        position_window: an error [m] beyond this counts as this.
        angle_limit: greatest correction [rad] per axis.
        angle_window: an error [rad] beyond this counts as this.
        height_per_weight: correction [m/N] that a payload's weight takes; this and the next two as
            found with 2 to 6 kg, up to 15 cm beside the middle.
        roll_per_moment: the same of its moment about the axis ahead [rad/(N m)].
        pitch_per_moment: and about the axis aside.
    """

    rate: float = 2.0
    position_limit: float = 0.06
    position_window: float = 0.04
    angle_limit: float = 0.3
    angle_window: float = 0.3
    height_per_weight: float = 0.00055
    roll_per_moment: float = 0.08
    pitch_per_moment: float = 0.0085

    def __post_init__(self) -> None:
        """Raise ConfigError for a negative number."""
        require_not_negative(self, *(f.name for f in fields(self)))

    @property
    def window(self) -> Float[np.ndarray, "6"]:
        """Of position, three times, and angle."""
        return np.repeat([self.position_window, self.angle_window], 3)

    @property
    def handed_over(self) -> Float[np.ndarray, "3"]:
        """Upward, about the axis ahead, and about the one aside."""
        return np.array([self.height_per_weight, self.roll_per_moment, self.pitch_per_moment])

    @property
    def limit(self) -> Float[np.ndarray, "6"]:
        """Of position, three times, and angle."""
        return np.repeat([self.position_limit, self.angle_limit], 3)


class SteadyStateCorrection:
    """Integrates the body's pose error."""

    def __init__(self, config: CorrectionConfig | None = None) -> None:
        """Start without correction."""
        self._config = config or CorrectionConfig()
        self._offset = np.zeros(6)
        self._window, self._limit = self._config.window, self._config.limit
        self._carried: Float[np.ndarray, "3"] | None = None

    def update(self, error: Float[np.ndarray, "6"], dt: float) -> Float[np.ndarray, "6"]:
        """The offset to add to the reference, after ``dt`` seconds of ``error``.

        Args:
            error: reference minus measured: position [m], rotation vector [rad], in the world.
            dt: [s].
        """
        counted = np.clip(error, -self._window, self._window)
        self._offset = np.clip(
            self._offset + self._config.rate * dt * counted, -self._limit, self._limit
        )
        return self._offset

    def corrected(self, target: BodyTarget, snapshot: Snapshot, dt: float) -> BodyTarget:
        """``target`` with the correction put in, after ``dt`` seconds of its present error."""
        rotation_error = log_rotation(target.R_world_base @ snapshot.R_world_base.T)
        position_error = target.p_world - tracked_position(snapshot, target.point)
        self._hand_over(snapshot)
        offset = self.update(np.concatenate([position_error, rotation_error]), dt)
        return replace(
            target,
            p_world=target.p_world + offset[:3],
            R_world_base=exp_rotation(offset[3:]) @ target.R_world_base,
        )

    def _hand_over(self, snapshot: Snapshot) -> None:
        """Take out of the offset what is known of the payload since the last tick."""
        mass, weight = snapshot.payload.tolist()
        gravity = weight / mass if mass else 0.0
        x_axis = snapshot.R_world_base[:2, 0]
        heading = yaw_rotation(float(np.arctan2(x_axis[1], x_axis[0])))
        lever = snapshot.mass_matrix[0, 0] * gravity * (heading.T @ snapshot.com_shift)
        load = self._config.handed_over * [weight, lever[1], -lever[0]]
        before = load if self._carried is None else self._carried
        self._carried = load
        upward, *turn = load - before
        change = np.array([upward, *(heading @ [*turn, 0.0])[:2]])
        held = self._offset[2:5]
        taken = np.clip(change, np.minimum(held, 0.0), np.maximum(held, 0.0))
        self._offset = self._offset - np.array([0.0, 0.0, *taken, 0.0])


def tracked_position(snapshot: Snapshot, point: TrackedPoint) -> Float[np.ndarray, "3"]:
    """Measured position [m] of ``point`` in the world."""
    return snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base
