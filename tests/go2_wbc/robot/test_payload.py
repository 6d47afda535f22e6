"""A payload is a point mass, and no other."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.robot.payload import NO_PAYLOAD, Payload


def test_its_inertia_is_that_of_a_point() -> None:
    place = np.array([0.1, -0.2, 0.3])
    inertia = Payload(2.0, (0.1, -0.2, 0.3)).inertia.matrix()
    assert np.diag(inertia)[:3] == pytest.approx(2.0)
    about_origin = 2.0 * (place @ place * np.eye(3) - np.outer(place, place))
    np.testing.assert_allclose(inertia[3:, 3:], about_origin, atol=1e-12)


def test_nothing_has_no_mass() -> None:
    assert NO_PAYLOAD.mass == 0.0


@pytest.mark.parametrize("mass", [-0.1, np.nan, np.inf])
def test_a_mass_that_cannot_be_is_refused(mass: float) -> None:
    with pytest.raises(ConfigError, match=r"Payload.mass must be at least 0"):
        Payload(mass)


def test_a_place_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"Payload.place must be finite"):
        Payload(1.0, (0.0, np.nan, 0.0))
