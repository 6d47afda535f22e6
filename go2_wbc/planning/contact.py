"""Which feet of a gait stand: those that shall, and those that have found a step before they do.

A foot that meets something above the ground, late in its swing, stands from then on. If it went on
towards its place it would push against the step. On ground as expected it stands when it is planned
to, so that a trot on the level is as exact as its clock.

A foot that is late stands too, from when it is planned to. Its leg carries its share of the force,
which puts it down within milliseconds. To let it swing down instead until it is met, at 0.4 to
1.5 m/s, made the trot fall in 4 of 6 runs over boxes of 12 cm and up stairs of 10 cm, which it
walked in 6 and 5 without (own simulation).

``tracking.landing`` does the like for motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import Record
from go2_wbc.validation import POSITIVE, SHARE, ranged


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, earliest=SHARE)
class ContactConfig:
    """When contacts count, from a search on this robot in simulation.

    Attributes:
        earliest: share of the swing from which on a contact may be a landing.
        step: height [m] above the ground from which on it is one.
    """

    earliest: float = 0.7
    step: float = 0.015


class FootContact(Record):
    """What is known of a foot's contact.

    Attributes:
        is_early: whether it stands ahead of its plan.
        since: for how long [s] it has done so; infinite if it has come down when it was planned to.
        was_stance: whether it was planned to stand at the tick before.
        is_awaited: whether it shall stand and has not met the ground yet.
    """

    is_early: bool
    since: float
    was_stance: bool
    is_awaited: bool


@subroutine
def follow_contact(
    foot: FootContact,
    c: ContactConfig,
    above: float,
    touches: bool,
    planned: bool,
    progress: float,
    dt: float,
) -> bool:
    """Bring a foot to this tick, ``dt`` seconds after the last; returns whether it stands.

    Args:
        foot: is brought to this tick.
        c: when contacts count.
        above: height [m] of the foot above the ground as it is known.
        touches: whether a contact is measured.
        planned: whether it shall stand.
        progress: share of its swing that has passed.
        dt: [s].
    """
    if planned:
        foot.is_early = False
    elif not foot.is_early:
        foot.since = np.inf
        if touches and above > c.step and progress >= c.earliest - TIE:
            foot.is_early, foot.since = True, 0.0
    foot.since += dt
    return planned or foot.is_early


@subroutine
def loaded_time(foot: FootContact, planned: bool, elapsed: float, remaining: float) -> float:
    """Time [s] to the nearest change of a standing foot's contact, since when it came down."""
    begun = foot.since if foot.since < np.inf else elapsed
    return min(begun, remaining) if planned else begun
