"""The floor of a picture."""

import numpy as np
import pytest

from viz.render.ground import _TILE, _checker


@pytest.mark.parametrize("size", [(0.02, 0.05), (0.11, 0.11), (0.4, 0.3)], ids=str)
def test_a_pixel_has_the_mean_of_the_tiles_that_it_covers(size: tuple[float, float]) -> None:
    x, y = np.meshgrid(size[0] * np.arange(15) - 0.713, size[1] * np.arange(12) - 0.431)
    offsets = (np.arange(500) + 0.5) / 500 - 0.5
    sides = [
        np.where(np.floor((value[..., None] + side * offsets) / _TILE) % 2 == 0, 1.0, -1.0)
        for value, side in zip((x, y), size, strict=True)
    ]
    mean = 0.5 - 0.5 * sides[0].mean(axis=-1) * sides[1].mean(axis=-1)
    np.testing.assert_allclose(_checker(x, y), mean, atol=0.01)
