"""A low-pass filter without delay, for camera paths."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_STEPS_PER_DEVIATION = 8
_REACH = 4 * _STEPS_PER_DEVIATION  # grid steps on each side; a Gaussian is nil at 4 deviations


def smoothed(
    time: Float[np.ndarray, " n"], values: Float[np.ndarray, "n k"], deviation: float
) -> Float[np.ndarray, "n k"]:
    """Gaussian low-pass of samples that may be uneven; the ends are held.

    Args:
        time: increasing [s].
        values: one column per quantity.
        deviation: standard deviation of the filter [s].
    """
    step = deviation / _STEPS_PER_DEVIATION
    grid = np.arange(time[0] - deviation, time[-1] + deviation + step, step)
    kernel = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / _STEPS_PER_DEVIATION) ** 2)
    kernel /= kernel.sum()
    columns = []
    for column in values.T:
        even = np.pad(np.interp(grid, time, column), _REACH, mode="edge")
        columns.append(np.interp(time, grid, np.convolve(even, kernel, mode="valid")))
    return np.column_stack(columns)
