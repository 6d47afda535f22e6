"""The ground about a place, from the last footholds: a plane by weighted least squares.

Locally weighted regression (Cleveland, J. American Statistical Association 74, 1979): with the
footholds p_k at (x_k, y_k) from the place, w_k = exp(-(x_k^2 + y_k^2) / (2 reach^2)), W their sum,
m their weighted mean and C = sum w_k (p_k - m)(p_k - m)',

    slopes     (s_x, s_y) = (C_xy + ridge 1)^-1 C_z
    height     m_z - s_x m_x - s_y m_y
    deviation  sqrt((C_zz - s_x C_xz - s_y C_yz) / W)     of the footholds from the plane
    leverage   1 / W + m' (C_xy + ridge 1)^-1 m           above 1 / W, the more so beyond them

C_xy being the 2 x 2 part of C, and C_z its parts with z.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine

EACH = 8  #: How many prints of the front feet are kept, and of the hind feet
FAR = 1e3  #: Place [m] of a print that was never made
_REACH, _RIDGE = 0.2, 1e-4
"""Distance [m] at which a print has lost 0.4 of its weight, and variance of a print's height over
that of a slope [m^2]: 3 mm, and 0.3."""
_NO_WEIGHT = 1e-9  #: It is divided by the weights: nothing is known where there are none.


@subroutine
def plane_near(
    prints: Float[np.ndarray, "n 3"], first: int, last: int, x: float, y: float
) -> tuple[float, float, float, float, float]:
    """Height [m], slopes in x and y, deviation [m] and leverage at ``x``, ``y`` [m].

    It is the plane through the prints from ``first`` to before ``last``.
    """
    total, mx, my, mz = _NO_WEIGHT, 0.0, 0.0, 0.0
    for k in range(first, last):
        dx, dy = prints[k, 0] - x, prints[k, 1] - y
        weight = np.exp(-0.5 * (dx * dx + dy * dy) / _REACH**2)
        total += weight
        mx += weight * dx
        my += weight * dy
        mz += weight * prints[k, 2]
    mx, my, mz = mx / total, my / total, mz / total
    xx, xy, yy, xz, yz, zz = _RIDGE, 0.0, _RIDGE, 0.0, 0.0, 0.0
    for k in range(first, last):
        dx, dy = prints[k, 0] - x, prints[k, 1] - y
        weight = np.exp(-0.5 * (dx * dx + dy * dy) / _REACH**2)
        dx, dy, dz = dx - mx, dy - my, prints[k, 2] - mz
        xx += weight * dx * dx
        xy += weight * dx * dy
        yy += weight * dy * dy
        xz += weight * dx * dz
        yz += weight * dy * dz
        zz += weight * dz * dz
    size = xx * yy - xy * xy
    sx, sy = (yy * xz - xy * yz) / size, (xx * yz - xy * xz) / size
    deviation = np.sqrt(max(zz - sx * xz - sy * yz, 0.0) / total)
    leverage = 1.0 / total + (mx * mx * yy - 2.0 * mx * my * xy + my * my * xx) / size
    return mz - sx * mx - sy * my, sx, sy, deviation, leverage
