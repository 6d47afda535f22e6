"""Which feet of a gait stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, ContactPhase
from go2_wbc.planning.contact import EARLIEST, FootContact, follow_contact, loaded_time

TROT, TICK, RAMP = GAITS["trot"].schedule(), 0.002, 0.03
SWING = GAITS["trot"].swing_time


@dataclass
class Feet:
    """The feet of a trot, and what is planned."""

    phase: ContactPhase
    feet: list[FootContact]
    stance: np.ndarray

    @property
    def load_share(self) -> np.ndarray:
        phase, times = self.phase, np.zeros(4)
        for leg, foot in enumerate(self.feet):
            planned, elapsed, left = phase.stance[leg], phase.elapsed[leg], phase.remaining[leg]
            times[leg] = loaded_time(foot, planned, elapsed, left)
        return np.where(self.stance, np.clip(times / RAMP, 0.0, 1.0), 0.0)


def feet(until: float, *, touching: bool, above: float) -> Feet:
    """The feet ``until`` seconds into a trot; at first front left and rear right swing."""
    found = Feet(TROT.at(0.0), [FootContact(since=np.inf) for _ in range(4)], np.ones(4, bool))
    for tick in range(1, round(until / TICK) + 1):
        found.phase = TROT.at(tick * TICK)
        for leg, foot in enumerate(found.feet):
            planned, progress = found.phase.stance[leg], found.phase.progress[leg]
            found.stance[leg] = follow_contact(foot, above, touching, planned, progress, TICK)
    return found


@pytest.mark.parametrize(
    ("touching", "above", "share"),
    [(True, 0.0, 0.9), (False, 0.05, 0.9), (True, 0.05, EARLIEST - 0.1)],
    ids=["on the ground", "in the air", "too soon"],
)
def test_feet_stand_when_it_is_planned(touching: bool, above: float, share: float) -> None:
    contacts = feet(share * SWING, touching=touching, above=above)
    phase = contacts.phase
    assert not phase.stance.all()
    np.testing.assert_array_equal(contacts.stance, phase.stance)
    np.testing.assert_array_equal(contacts.load_share, phase.load_share(RAMP))


def test_a_foot_that_finds_a_step_late_in_its_swing_stands_from_then_on() -> None:
    contacts = feet(0.8 * SWING, touching=True, above=0.05)
    assert contacts.stance.all()
    begun = (0.8 - EARLIEST) * SWING
    share = contacts.load_share[~contacts.phase.stance]
    np.testing.assert_allclose(share, begun / RAMP, atol=2 * TICK / RAMP)


def test_a_foot_that_has_found_a_step_keeps_its_load_at_the_planned_touchdown() -> None:
    contacts = feet(SWING + TICK, touching=True, above=0.05)
    landed = ~TROT.at(0.5 * SWING).stance
    assert (contacts.load_share[landed] == 1.0).all()
    assert (contacts.phase.load_share(RAMP)[landed] < 0.2).all()
