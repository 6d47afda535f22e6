"""A world says what is known, refuses what makes no sense, and draws the worlds that it may be."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc import World
from go2_wbc.errors import ConfigError


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"friction": 0.0}, "friction must be between 0.05 and 2"),
        ({"friction": float("nan")}, "friction"),
        ({"friction_uncertainty": 1.0}, "friction_uncertainty"),
        ({"payload": -1.0}, "payload"),
        ({"payload": 40.0}, "payload"),
        ({"payload_place": (0.0, 0.9, 0.0)}, "payload_place"),
        ({"mass_scale": 0.0}, "mass_scale"),
        ({"mass_uncertainty": 0.7}, "mass_uncertainty"),
        ({"joint_friction": -0.1}, "joint_friction"),
        ({"joint_friction_uncertainty": 2.0}, "joint_friction_uncertainty"),
        ({"delay": 0.1}, "delay"),
        ({"sensors": "nosy"}, "noisy"),
    ],
)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_no_world_has_is_refused_by_name(settings: dict, named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        World(**settings)


def test_samples_fill_the_intervals_that_are_stated_and_leave_none() -> None:
    world = World(
        friction=0.6,
        friction_uncertainty=0.2,
        payload=2.0,
        mass_uncertainty=0.1,
        joint_friction_uncertainty=0.5,
    )
    drawn = [world.sample(np.random.default_rng(seed)) for seed in range(300)]
    for name, low, high in (
        ("friction", 0.48, 0.72),
        ("mass_scale", 0.9, 1.1),
        ("joint_friction", 0.5, 1.5),
    ):
        values = [getattr(one, name) for one in drawn]
        assert low <= min(values) < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < max(values) <= high
    one = drawn[0]
    assert one.payload == 2.0
    assert one.sample(np.random.default_rng(7)) == one
    assert one.least_friction == one.friction
    assert world.least_friction == pytest.approx(0.48)
    assert world.sample(np.random.default_rng(0)) == drawn[0]


def test_a_world_says_what_is_not_as_usual() -> None:
    assert str(World()) == "friction 0.5"
    said = str(World(friction=0.4, payload=3.0, payload_place=(0.1, 0.0, 0.05), delay=0.004))
    assert said == "friction 0.4, payload 3 kg at (0.1, 0, 0.05) m, delay 0.004 s"
    assert "noisy sensors" in str(World(sensors="noisy", joint_friction=2.0))
