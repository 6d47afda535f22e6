"""Plane geometry of the support polygon: convex hull and the signed distance of a point to it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def convex_hull(points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "h 2"]:
    """Corners of the convex hull, counter-clockwise; points on an edge are left out.

    Source: monotone chain (Andrew 1979, "Another efficient algorithm for convex hulls in two
    dimensions"). Fewer than three corners come back if all points lie on a line.
    """
    ordered = np.array(sorted(set(map(tuple, points.tolist())))).reshape(-1, 2)
    if len(ordered) <= 2:
        return ordered
    return np.array(_chain(ordered)[:-1] + _chain(ordered[::-1])[:-1])


def support_margin(points: Float[np.ndarray, "k 2"], p: Float[np.ndarray, "2"]) -> float:
    """``support_margins`` of one place ``p`` [m]."""
    return float(support_margins(points, p[None])[0])


def support_margins(
    points: Float[np.ndarray, "k 2"], p: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Distance [m] from each place ``p`` to the border of the convex hull of ``points``.

    Positive inside, negative outside. On a hull without area (one point, or all on a line)
    nothing is inside, and the result is minus the distance to it.

    Args:
        points: contact points on the ground [m], at least one.
        p: the places, usually the CoM projected to the ground [m].

    Raises:
        ValueError: if there is no point.
    """
    if len(points) == 0:
        raise ValueError("a support polygon needs at least one point")
    hull = convex_hull(points)
    distance, is_inside = np.full(len(p), np.inf), np.full(len(p), len(hull) >= 3)
    edges = np.roll(hull, -1, axis=0) - hull
    for (x, y), (ex, ey) in zip(hull.tolist(), edges.tolist(), strict=True):
        dx, dy = p[:, 0] - x, p[:, 1] - y
        along = np.clip((dx * ex + dy * ey) / max(ex * ex + ey * ey, _TINY), 0.0, 1.0)
        np.minimum(distance, np.hypot(dx - along * ex, dy - along * ey), out=distance)
        is_inside &= ex * dy - ey * dx >= 0.0
    return np.where(is_inside, distance, -distance)


def moving_support_margins(
    points: Float[np.ndarray, "n k 2"], p: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """``support_margin`` of every row: other points, another place.

    For a few points: every way from one to another is looked at, and is an edge of the hull if no
    point lies on its right.

    Args:
        points: k contact points on the ground in each of n instants [m], at least two.
        p: the place in each instant [m].
    """
    starts, ends = np.nonzero(~np.eye(points.shape[1], dtype=bool))
    edges = points[:, ends] - points[:, starts]
    to_points = points[:, None] - points[:, starts, None]
    to_place = p[:, None] - points[:, starts]
    sides = edges[..., None, 0] * to_points[..., 1] - edges[..., None, 1] * to_points[..., 0]
    is_edge = (sides >= 0.0).all(axis=2)
    along = (to_place * edges).sum(axis=2) / np.maximum((edges**2).sum(axis=2), _TINY)
    away = np.linalg.norm(to_place - np.clip(along, 0.0, 1.0)[..., None] * edges, axis=2)
    distance = np.where(is_edge, away, np.inf).min(axis=1)
    turns = edges[..., 0] * to_place[..., 1] - edges[..., 1] * to_place[..., 0]
    is_inside = (turns >= 0.0).all(axis=1, where=is_edge) & (sides > 0.0).any(axis=(1, 2))
    return np.where(is_inside, distance, -distance)


_TINY = 1e-300  #: [m^2] Keeps the division by the square of an edge defined for a hull of one point


def _chain(ordered: Float[np.ndarray, "k 2"]) -> list[Float[np.ndarray, "2"]]:
    chain: list[Float[np.ndarray, "2"]] = []
    for point in ordered:
        while len(chain) >= 2:
            (x1, y1), (x2, y2) = chain[-1] - chain[-2], point - chain[-2]
            if x1 * y2 - y1 * x2 > 0.0:  # a turn to the left
                break
            chain.pop()
        chain.append(point)
    return chain
