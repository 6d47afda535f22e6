"""How the CoM goes while feet step: so that the ground can hold it, near to where it was wanted.

With its height z, the CoM c and the zero-moment point p of an inverted pendulum are related by

    p = c - z / (g + z'') c''                                       (Kajita et al. 2003, eq. 3)

and p must stay among the feet that stand: a margin inside their polygon, or, of two feet, near the
line between them. So the way e that is added to c is a uniform cubic spline, whose coefficients
minimise

    integral of |e|^2 + tau^6 |e'''|^2 + rho |what is beyond the edges|^2,

a convex problem without hard constraints: Newton's method on its pieces ends after some ten steps,
and where no way keeps all margins the least bad one comes out, for the check to judge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import BSpline, CubicSpline
from scipy.sparse import block_diag, csr_matrix, diags, eye, hstack, vstack
from scipy.sparse.linalg import spsolve

from go2_wbc.geometry import convex_hull
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import (
    Wanted,
    attitudes,
    centres_of_mass,
    configurations,
    place,
    rates,
    zero_moment_points,
)
from motions.plan.tracks import LegTracks, Poses, Times

INSIDE = 0.03
"""Distance [m] that CoM and zero-moment point keep from the edges of three or four feet: twice the
check's limit for the CoM. A foot then bears 18 N or more, an eighth of the weight."""
OFF_LINE = 0.001
"""Distance [m] that the zero-moment point may be off the line of two feet."""
FROM_FOOT = 0.05
"""Distance [m] that it keeps from these feet, along the line."""
SMOOTHING = 0.25
"""Time tau [s] over which the way is smoothed: own choice, half the time between two steps."""
STIFFNESS = 1e4
"""Weight rho of what is beyond the edges: what is left of it is below 0.1 mm."""
KNOTS = 5
"""Pieces of the spline in the shortest time between two changes of the contacts, at least."""
SHORTEST, LONGEST = 0.03, 0.08
"""Length [s] of a piece: three samples, and what the smoothing asks for."""
MOST_STEPS = 40
"""Newton steps; they end by themselves after some ten."""
HALVES = tuple(0.5**k for k in range(6))
"""Shares of a step that are tried."""
GAIN = 1e-4
"""Least share of f that a step must gain: it moves the way by less than a micrometre or two."""
CENTRING_STEPS = 5
"""Steps that put the CoM in its place; see ``place``."""
PASSES = 3
"""Times that the way is found; from the second on with what the pendulum leaves out, as the whole
robot's dynamics say of the last way (Kajita et al. 2003, sec. 5)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stepping:
    """What is known of a stretch in which feet step, at n instants.

    Attributes:
        times: increasing, evenly [s].
        p_com: (n, 3) where the CoM would be [m].
        stance: (n, 4) feet that stand.
        p_feet: (n, 4, 3) where the feet are [m].
        gravity: [m/s^2].
        bias: (n, 2) zero-moment point less that of the pendulum [m].
    """

    times: Times
    p_com: Float[np.ndarray, "n 3"]
    stance: Bool[np.ndarray, "n 4"]
    p_feet: Float[np.ndarray, "n 4 3"]
    gravity: float
    bias: Float[np.ndarray, "n 2"]

    @property
    def lever(self) -> Times:
        """z / (g + z'') [s^2]."""
        heights = CubicSpline(self.times, self.p_com[:, 2], bc_type="clamped")
        return self.p_com[:, 2] / (self.gravity + heights(self.times, 2))

    def zmp(self, way: Float[np.ndarray, "n 2"] | float = 0.0) -> Float[np.ndarray, "n 2"]:
        """Zero-moment point [m] if ``way`` is added to the CoM."""
        p = self.p_com[:, :2] + way
        path = CubicSpline(self.times, p, bc_type="clamped")
        return p - self.lever[:, None] * path(self.times, 2) + self.bias


class SwayProblem:
    """What to add to the place of the CoM in a stretch; its ``bias`` may change."""

    def __init__(self, stepping: Stepping) -> None:
        """Set it up for ``stepping``, with any bias."""
        values, curvature, jerk = _spline(stepping)
        self._values, self._period = values, float(np.mean(np.diff(stepping.times)))
        if not values.nnz:
            return
        zmp = csr_matrix(values - diags(stepping.lever) @ curvature)
        self._limits = _Limits.of(stepping, values, zmp)
        own = self._period * (values.T @ values) + SMOOTHING**6 * (jerk.T @ jerk)
        self._H = csr_matrix(block_diag([own, own]))

    def solve(self, stepping: Stepping) -> Float[np.ndarray, "n 2"]:
        """The way [m] in the same stretch with its bias; nothing, at rest, at both ends."""
        if not self._values.nnz:
            return np.zeros((len(stepping.times), 2))
        limits = self._limits
        x = _least(self._H, limits.G, limits.bounds_of(stepping), STIFFNESS * self._period)
        ways = x.reshape(2, -1)
        return np.column_stack([self._values @ ways[0], self._values @ ways[1]])


def _least(
    H: csr_matrix, G: csr_matrix, h: Float[np.ndarray, " k"], stiffness: float
) -> Float[np.ndarray, " m"]:
    """The x of least f(x) = x' H x + s |max(0, G x - h)|^2.

    Newton's steps, halved until f falls; they end where they would gain nothing.
    """

    def f(x: Float[np.ndarray, " m"]) -> float:
        beyond = np.maximum(G @ x - h, 0.0)
        return float(x @ (H @ x) + stiffness * beyond @ beyond)

    x = np.zeros_like(H.diagonal())
    for _ in range(MOST_STEPS):
        active = G @ x > h
        part, wanted = G[active], (1.0 - GAIN) * f(x)
        way = spsolve((H + stiffness * part.T @ part).tocsc(), stiffness * part.T @ h[active]) - x
        better = next((p for p in (x + share * way for share in HALVES) if f(p) < wanted), None)
        if better is None:
            break
        x = better
    return x


def _spline(stepping: Stepping) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
    """From the coefficients to values and second derivatives at the times, and to the jerks.

    On uniform knots, h apart, a derivative of a spline has the differences of its coefficients over
    h as its own. The jerks (one a piece) are scaled by sqrt(h), so that their squares sum to an
    integral. The three outermost coefficients on either side are 0 and left out.
    """
    times = stepping.times
    is_change = (stepping.stance[1:] != stepping.stance[:-1]).any(axis=1)
    spans = np.diff(times[1:][is_change])
    shortest = float(spans.min()) if len(spans) else LONGEST * KNOTS
    wanted = min(max(shortest / KNOTS, SHORTEST), LONGEST)
    pieces = max(round((times[-1] - times[0]) / wanted), 1)
    length = (times[-1] - times[0]) / pieces
    knots = times[0] + length * np.arange(-3, pieces + 4)
    inside = np.clip(times, knots[3], knots[-4])
    count = pieces + 3
    differences = [
        (eye(n - 1, n, k=1) - eye(n - 1, n)) / length for n in (count, count - 1, count - 2)
    ]
    second = differences[1] @ differences[0]
    values = BSpline.design_matrix(inside, knots, 3)
    curvature = BSpline.design_matrix(inside, knots[2:-2], 1) @ second
    jerk = np.sqrt(length) * differences[2] @ second
    free = slice(3, max(count - 3, 3))
    first, second, third = (csr_matrix(table)[:, free] for table in (values, curvature, jerk))
    return first, second, third


@dataclass(frozen=True, slots=True)
class _Limits:
    """The sway x keeps zero-moment point and CoM inside where G x <= h.

    Attributes:
        G: one row for an edge at an instant; first those of the zero-moment point.
        rows: instant of each row.
        normals: of the edges.
        bounds: n p <= b where the point p keeps its margin.
        of_com: number of rows of the zero-moment point, the first that is of the CoM.
    """

    G: csr_matrix
    rows: Int[np.ndarray, " k"]
    normals: Float[np.ndarray, "k 2"]
    bounds: Float[np.ndarray, " k"]
    of_com: int

    @staticmethod
    def of(stepping: Stepping, values: csr_matrix, zmp: csr_matrix) -> _Limits:
        """Of every edge at every instant; the CoM's where more than two feet stand."""
        normals, bounds = _edges(stepping)
        edges, rows = np.nonzero(np.isfinite(bounds).T)  # edge after edge
        own = np.flatnonzero((stepping.stance.sum(axis=1) > 2)[rows])
        place = np.concatenate([np.arange(len(rows)), own])
        n = normals[rows, edges]
        parts = [
            hstack([diags(n[kept, 0]) @ part, diags(n[kept, 1]) @ part])
            for kept, part in ((slice(None), zmp[rows]), (own, values[rows[own]]))
        ]
        return _Limits(
            G=csr_matrix(vstack(parts)),
            rows=rows[place],
            normals=n[place],
            bounds=bounds[rows, edges][place],
            of_com=len(rows),
        )

    def bounds_of(self, stepping: Stepping) -> Float[np.ndarray, " k"]:
        """h: how far each point may go beyond where it is without a sway [m]."""
        first, rest = self.rows[: self.of_com], self.rows[self.of_com :]
        points = np.concatenate([stepping.zmp()[first], stepping.p_com[rest, :2]])
        return self.bounds - (self.normals * points).sum(axis=1)


def _edges(
    stepping: Stepping,
) -> tuple[Float[np.ndarray, "n 4 2"], Float[np.ndarray, "n 4"]]:
    """Normals and bounds: n p <= b where p keeps its margin; b is infinite where there is none."""
    count = len(stepping.times)
    normals, bounds = np.zeros((count, 4, 2)), np.full((count, 4), np.inf)
    places = np.where(stepping.stance[:, :, None], stepping.p_feet[:, :, :2], np.inf)
    is_new = np.ones(count, dtype=bool)
    is_new[1:] = (places[1:] != places[:-1]).any(axis=(1, 2))
    starts = [*np.flatnonzero(is_new).tolist(), count]
    for start, end in pairwise(starts):
        feet = stepping.p_feet[start, stepping.stance[start], :2]
        if len(feet) >= 2:
            rows = slice(start, end)
            n, b = _polygon(convex_hull(feet))
            normals[rows, : len(n)], bounds[rows, : len(b)] = n, b
    return normals, bounds


def _polygon(
    corners: Float[np.ndarray, "k 2"],
) -> tuple[Float[np.ndarray, "j 2"], Float[np.ndarray, " j"]]:
    """Outward normals and bounds of a polygon, or of a line, each its margin further in."""
    ways = np.roll(corners, -1, axis=0) - corners
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    n = np.column_stack([ways[:, 1], -ways[:, 0]])
    b = (n * corners).sum(axis=1)
    if len(corners) > 2:
        return n, b - INSIDE
    along = np.array([ways[0], -ways[0]])
    ends = np.array([along[0] @ corners[1], along[1] @ corners[0]]) - FROM_FOOT
    return np.vstack([n, along]), np.concatenate([b + OFF_LINE, ends])


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a motion in which feet step.

    Attributes:
        times: (n,) its instants [s].
        stance: (n, 4) feet that stand.
        raised: (n, 4) legs in the air that do not step.
    """

    times: Times
    stance: Bool[np.ndarray, "n 4"]
    raised: Bool[np.ndarray, "n 4"]


def swayed(
    span: Span, body: Poses, tracks: LegTracks, model: RobotModel
) -> Float[np.ndarray, "n 2"]:
    """Places x, y [m] of the base, near those of ``body``, in which the ground can hold it."""
    ground = tracks.footing.at(span.times)
    joints = tracks.paths(span.times, body, ground).q
    com, rpy = centres_of_mass(body, joints, model), body[:, 3:]
    stepping = Stepping(
        times=span.times,
        p_com=com,
        stance=span.stance,
        p_feet=ground.p_feet,
        gravity=model.gravity,
        bias=np.zeros((len(com), 2)),
    )
    wanted = Wanted(
        p=com,
        is_com=np.ones(len(com), dtype=bool),
        R=attitudes(rpy),
        q_joints=joints,
        raised=span.raised,
        p_feet=ground.p_feet,
    )
    problem, p_base = SwayProblem(stepping), body[:, :3]
    for _ in range(PASSES):
        way = problem.solve(stepping)
        wanted = replace(wanted, p=com + np.pad(way, ((0, 0), (0, 1))))
        placed = place(wanted, CENTRING_STEPS, model)
        true = _zmp(span.times, np.hstack([placed.p_base, rpy]), placed.q_joints, model)
        stepping = replace(stepping, bias=stepping.bias + true - stepping.zmp(way))
        p_base = placed.p_base
    return p_base[:, :2]


def _zmp(
    times: Times, poses: Poses, joints: Float[np.ndarray, "n 12"], model: RobotModel
) -> Float[np.ndarray, "n 2"]:
    """The zero-moment point [m] of the whole robot, by inverse dynamics."""
    q = configurations(poses, joints)
    v, a = rates(times, q, poses[:, 3:])
    rows = zip(q, v, a, strict=True)
    wrench = np.array([model.inverse_dynamics(*row)[:6] for row in rows])
    return zero_moment_points(q, poses[:, 3:], wrench)
