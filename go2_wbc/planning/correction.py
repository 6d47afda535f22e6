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

import numpy as np

from go2_wbc.algebra.vectors import rotation_by
from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import V3, Array3, Array3x3, Array6, Record
from go2_wbc.reference import Target, TrackedPoint
from go2_wbc.robot.snapshot import Snapshot

RATE = 2.0
"""Share of the remaining error that is added per second [1/s]."""
POSITION_LIMIT, POSITION_WINDOW = 0.06, 0.04
"""Greatest correction [m] per axis, and the error [m] beyond which one counts as this."""
ANGLE_LIMIT, ANGLE_WINDOW = 0.3, 0.3
"""The same of the attitude [rad]. A load of 4 kg, 5 cm beside the middle of the simulated robot,
leaned it by 15 deg where errors beyond 0.1 rad were dropped, by 9 with a limit of 0.15 rad, by 2
with these."""
HEIGHT_PER_WEIGHT = 0.00055
"""Correction [m/N] that a payload's weight takes; this and the next two as found with 2 to 6 kg, up
to 15 cm beside the middle."""
ROLL_PER_MOMENT, PITCH_PER_MOMENT = 0.08, 0.0085
"""The same of its moment about the axis ahead and the one aside [rad/(N m)]."""


class Correction(Record):
    """What has been integrated.

    Attributes:
        offset: of the reference: position [m] and rotation vector [rad], in the world.
        carried: what the offset would have to do against the payload that is known, in the heading
            frame: upward [m], about the axis ahead and the one aside [rad].
        knows_payload: whether ``carried`` has been found yet.
    """

    offset: Array6
    carried: Array3
    knows_payload: bool


@subroutine
def correct(now: Snapshot, error: Array6, dt: float, s: Correction, target: Target) -> None:
    """Put the correction into the body's target, after ``dt`` seconds of ``error``.

    ``error``: of the target less what is measured: position [m] and rotation vector [rad].
    """
    hand_over(now, s)
    for i in range(3):
        at, k = s.offset[i], 3 + i
        s.offset[i] = integrated(at, error[i], dt, RATE, POSITION_WINDOW, POSITION_LIMIT)
        s.offset[k] = integrated(s.offset[k], error[k], dt, RATE, ANGLE_WINDOW, ANGLE_LIMIT)
        target.p_world[i] += s.offset[i]
    turn_by((s.offset[3], s.offset[4], s.offset[5]), target.R_world_base)


@subroutine
def turn_by(rotation: V3, R: Array3x3) -> None:
    """Turn an attitude by a rotation vector [rad] in the world."""
    turn, before = np.empty((3, 3)), R.copy()
    rotation_by(rotation, turn)
    for i in range(3):
        for k in range(3):
            R[i, k] = (
                turn[i, 0] * before[0, k] + turn[i, 1] * before[1, k] + turn[i, 2] * before[2, k]
            )


@subroutine
def integrated(
    offset: float, error: float, dt: float, rate: float, window: float, limit: float
) -> float:
    """One axis' offset after ``dt`` seconds of ``error``."""
    counted = min(max(error, -window), window)
    return min(max(offset + rate * dt * counted, -limit), limit)


@subroutine
def hand_over(now: Snapshot, s: Correction) -> None:
    """Take out of the offset what is known of the payload since the last tick."""
    mass, weight = now.payload[0], now.payload[1]
    gravity = weight / mass if mass > 0.0 else 0.0
    x, y = now.R_world_base[0, 0], now.R_world_base[1, 0]
    length = max(np.hypot(x, y), TIE)
    cosine, sine = x / length, y / length
    moment = now.mass_matrix[0, 0] * gravity
    x, y = moment * now.com_shift[0], moment * now.com_shift[1]
    load = (
        HEIGHT_PER_WEIGHT * weight,
        ROLL_PER_MOMENT * (cosine * y - sine * x),
        -PITCH_PER_MOMENT * (cosine * x + sine * y),
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


def tracked_position(snapshot: Snapshot, point: TrackedPoint) -> Array3:
    """Measured position [m] of ``point`` in the world."""
    return snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base
