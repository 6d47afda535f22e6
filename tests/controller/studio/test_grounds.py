"""The ground that the page chooses: what is drawn is what the robot is played on."""

import math

import numpy as np
import pytest

from controller.studio.grounds import AHEAD, KINDS, LEVEL, PlayedGround, ground_of, shown
from go2_wbc.errors import StudioError
from go2_wbc.planning.height_map import CELL

WAY = np.array([[0.0, 0.0], [1.0, 0.2]])  #: Of a robot that walks ahead [m]
EXACT = 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_drawn_around_the_way_as_high_as_its_number_says(kind: str) -> None:
    ground = ground_of({"ground": kind, "size": KINDS[kind].usual})
    assert ground == ground_of({"ground": kind}), "the usual one, where none is named"
    assert shown(ground)["ground"] == kind
    x, y, z = ground.cells(WAY).T
    assert (x.min(), x.max()) == pytest.approx((-1.0, 2.0), abs=CELL)
    assert (y.min(), y.max()) == pytest.approx((-1.0, 1.2), abs=CELL)
    assert len(np.unique(np.floor(np.column_stack([x, y]) / CELL), axis=0)) == len(x), "no hole"
    if kind != "slope":
        assert z[np.hypot(x, y) < 0.3] == pytest.approx(0.0, abs=EXACT), "level where it stands"
        assert z.max() > 0.5 * ground.size * (ground.size < 1.0)
    assert np.ptp(z) > 0.02


def test_stairs_and_slopes_have_the_heights_that_are_asked_for() -> None:
    x, _, z = PlayedGround("stairs", 0.05).cells(WAY).T
    first = (x > AHEAD + 0.01) & (x < AHEAD + 0.29)
    assert z[first] == pytest.approx(0.05, abs=EXACT)
    x, _, z = PlayedGround("slope", 10.0).cells(WAY).T
    assert z == pytest.approx(x * math.tan(math.radians(10.0)), abs=EXACT)


def test_a_level_one_is_drawn_as_no_ground_and_needs_no_warning() -> None:
    assert PlayedGround().cells(WAY).shape == (0, 3)
    assert PlayedGround().terrain is None
    assert (PlayedGround().told(), str(PlayedGround())) == ("", "")
    assert ground_of({"ground": LEVEL, "size": 3.0}) == ground_of({}) == PlayedGround()


@pytest.mark.parametrize(
    ("order", "told"),
    [
        ({"ground": "ice"}, "unknown ground 'ice'"),
        ({"ground": 3}, "unknown ground '3'"),
        ({"ground": "stairs", "size": 0.5}, "step must be between 0.01 and 0.2 m, got 0.5"),
        ({"ground": "slope", "size": "steep"}, "angle must be a number, got 'steep'"),
        ({"ground": "slope", "size": True}, "angle must be a number, got True"),
        ({"ground": "slope", "size": math.nan}, "angle must be between 1 and 20 deg, got nan"),
    ],
)
def test_what_is_no_ground_is_refused(order: dict[str, object], told: str) -> None:
    with pytest.raises(StudioError, match=told):
        ground_of(order)
