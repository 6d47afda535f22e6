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

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.vectors import rotation_by
from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import Record
from go2_wbc.reference import Target, TrackedPoint
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, ranged


@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE)
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


class Correction(Record):
    """What has been integrated.

    Attributes:
        offset: of the reference: position [m] and rotation vector [rad], in the world.
        carried: what the offset would have to do against the payload that is known, in the heading
            frame: upward [m], about the axis ahead and the one aside [rad].
        knows_payload: whether ``carried`` has been found yet.
    """

    offset: Float[np.ndarray, "6"]
    carried: Float[np.ndarray, "3"]
    knows_payload: bool


@subroutine
def correct(
    now: Snapshot,
    error: Float[np.ndarray, "6"],
    dt: float,
    c: CorrectionConfig,
    s: Correction,
    target: Target,
) -> None:
    """Put the correction into the body's target, after ``dt`` seconds of ``error``.

    ``error``: of the target less what is measured: position [m] and rotation vector [rad].
    """
    hand_over(now, c, s)
    for i in range(3):
        at, by = s.offset[i], c.position_window
        s.offset[i] = integrated(at, error[i], dt, c.rate, by, c.position_limit)
        at, by = s.offset[3 + i], c.angle_window
        s.offset[3 + i] = integrated(at, error[3 + i], dt, c.rate, by, c.angle_limit)
        target.p_world[i] += s.offset[i]
    turn, planned, R = np.empty((3, 3)), target.R_world_base.copy(), target.R_world_base
    rotation_by((s.offset[3], s.offset[4], s.offset[5]), turn)
    for i in range(3):
        for k in range(3):
            R[i, k] = (
                turn[i, 0] * planned[0, k] + turn[i, 1] * planned[1, k] + turn[i, 2] * planned[2, k]
            )


@subroutine
def integrated(
    offset: float, error: float, dt: float, rate: float, window: float, limit: float
) -> float:
    """One axis' offset after ``dt`` seconds of ``error``."""
    counted = min(max(error, -window), window)
    return min(max(offset + rate * dt * counted, -limit), limit)


@subroutine
def hand_over(now: Snapshot, c: CorrectionConfig, s: Correction) -> None:
    """Take out of the offset what is known of the payload since the last tick."""
    mass, weight = now.payload[0], now.payload[1]
    gravity = weight / mass if mass > 0.0 else 0.0
    x, y = now.R_world_base[0, 0], now.R_world_base[1, 0]
    length = max(np.hypot(x, y), TIE)
    cosine, sine = x / length, y / length
    moment = now.mass_matrix[0, 0] * gravity
    x, y = moment * now.com_shift[0], moment * now.com_shift[1]
    load = (
        c.height_per_weight * weight,
        c.roll_per_moment * (cosine * y - sine * x),
        -c.pitch_per_moment * (cosine * x + sine * y),
    )
    change = np.zeros(3)
    for i in range(3):
        if s.knows_payload:
            change[i] = load[i] - s.carried[i]
        s.carried[i] = load[i]
    s.knows_payload = True
    about_x, about_y = change[1], change[2]
    change[1], change[2] = cosine * about_x - sine * about_y, sine * about_x + cosine * about_y
    for i in range(3):
        held = s.offset[2 + i]
        s.offset[2 + i] -= max(min(change[i], max(held, 0.0)), min(held, 0.0))


def tracked_position(snapshot: Snapshot, point: TrackedPoint) -> Float[np.ndarray, "3"]:
    """Measured position [m] of ``point`` in the world."""
    return snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base
