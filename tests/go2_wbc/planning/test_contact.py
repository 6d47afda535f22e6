"""Which feet of a gait stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, ContactPhase
from go2_wbc.planning.contact import ContactConfig, FootContacts
from tests import engine_helpers as helpers

MODEL = helpers.symmetric_model()
SNAPSHOT = MODEL.snapshot(helpers.state_of(helpers.standing_q()))
TROT, TICK, RAMP = GAITS["trot"].schedule(), 0.002, 0.03
CONFIG = ContactConfig()
SWING = GAITS["trot"].swing_time


def feet(until: float, *, touching: bool, above: float) -> tuple[FootContacts, ContactPhase]:
    """The feet ``until`` seconds into a trot; at first front left and rear right swing."""
    contacts, phase = FootContacts(CONFIG), TROT.at(0.0)
    state = replace(SNAPSHOT.state, feet_in_contact=np.full(4, touching))
    for tick in range(1, round(until / TICK) + 1):
        phase = TROT.at(tick * TICK)
        contacts.update(SNAPSHOT.replaced(state=state), phase, np.full(4, above), TICK)
    return contacts, phase


@pytest.mark.parametrize(
    ("touching", "above", "share"),
    [(True, 0.0, 0.9), (False, 0.05, 0.9), (True, 0.05, CONFIG.earliest - 0.1)],
    ids=["on the ground", "in the air", "too soon"],
)
def test_feet_stand_when_it_is_planned(touching: bool, above: float, share: float) -> None:
    contacts, phase = feet(share * SWING, touching=touching, above=above)
    assert not phase.stance.all()
    np.testing.assert_array_equal(contacts.stance, phase.stance)
    np.testing.assert_array_equal(contacts.load_share(phase, RAMP), phase.load_share(RAMP))


def test_a_foot_that_finds_a_step_late_in_its_swing_stands_from_then_on() -> None:
    contacts, phase = feet(0.8 * SWING, touching=True, above=0.05)
    assert contacts.stance.all()
    begun = (0.8 - CONFIG.earliest) * SWING
    share = contacts.load_share(phase, RAMP)[~phase.stance]
    np.testing.assert_allclose(share, begun / RAMP, atol=2 * TICK / RAMP)


def test_a_foot_that_has_found_a_step_keeps_its_load_at_the_planned_touchdown() -> None:
    contacts, phase = feet(SWING + TICK, touching=True, above=0.05)
    landed = ~TROT.at(0.5 * SWING).stance
    assert (contacts.load_share(phase, RAMP)[landed] == 1.0).all()
    assert (phase.load_share(RAMP)[landed] < 0.2).all()
