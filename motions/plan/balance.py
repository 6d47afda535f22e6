"""Where the trunk moves so that the CoM stays over the stance feet while others are raised.

At every key during a raise, PlaCo's inverse kinematics finds a position of the trunk for which the
CoM keeps a distance to the edges of the support polygon, with the attitude, the height and the
raised leg as written. Between those instants the trunk moves smoothly.

While feet step, the CoM moves so that the ground can support it, near to its written path. With its
height z, the CoM c and the zero-moment point p of an inverted pendulum are related by

    p = c - z / (g + z'') c''                                       (Kajita et al. 2003, eq. 3)

and p must stay between the stance feet: a margin inside their polygon, or, with two feet, near the
line between them. So the offset e that is added to c is a uniform cubic spline, whose coefficients
minimise

    integral of |e|^2 + tau^6 |e'''|^2 + rho |what is beyond the edges|^2,

a convex problem without hard constraints: Newton's method on its pieces ends after some ten steps.
If no offset keeps all margins, the result violates them least, and the check judges it.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import BSpline, CubicSpline
from scipy.linalg import solveh_banded

from go2_wbc.errors import IkError
from go2_wbc.geometry import convex_hull
from go2_wbc.legs import Leg
from go2_wbc.robot.inverse_kinematics import PoseTargets, solve_pose
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import (
    Wanted,
    centres_of_mass,
    configurations,
    place,
    rates,
    zero_moment_points,
)
from motions.language.keys import BalanceShift
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME
from motions.memory import Memory
from motions.plan.compiled_plan import Problem
from motions.plan.tracks import Instants, LegTracks, Move, Poses, Times

MARGINS = (0.08, 0.065, 0.05, 0.035, 0.02)
"""Distances [m] of the CoM to the edges of the support polygon that are tried, best first.

The largest circle in the triangle of three feet, 0.387 m by 0.284 m, has a radius of 95 mm. The
last is the check's limit (``FeasibilityLimits.support``) with 5 mm to spare. Own choice.
"""
PLACES = 9  #: Decimals [m, rad] of what tells one pose to be balanced from another
JOINT_MARGIN = 0.02
"""Distance [rad] that the joints keep from their limits in a balanced pose: own choice."""
INSIDE = 0.03
"""Distance [m] that CoM and zero-moment point keep from the edges of three or four feet: twice the
check's limit for the CoM. A foot then bears 18 N or more, an eighth of the weight."""
OFF_LINE = 0.001  #: Distance [m] that the zero-moment point may be off the line of two feet
FROM_FOOT = 0.05  #: Distance [m] that it keeps from these feet, along the line
SMOOTHING = 0.25
"""Time tau [s] over which the way is smoothed: own choice, half the time between two steps."""
STIFFNESS = 1e4  #: Weight rho of what is beyond the edges: what is left of it is below 0.1 mm
KNOTS = 5
"""Pieces of the spline in the shortest time between two changes of the contacts, at least."""
SHORTEST, LONGEST = 0.03, 0.08
"""Length [s] of a piece: three samples, and what the smoothing asks for."""
MOST_STEPS = 40  #: Newton steps; they end by themselves after some ten
HALVES = tuple(0.5**k for k in range(6))  #: Shares of a step that are tried
GAIN = 1e-4
"""Least share of f that a step must gain: it moves the way by less than a micrometre or two."""
CENTRING_STEPS = 5  #: Steps that put the CoM in its place; see ``place``
PASSES = 3
"""Times that the way is found; from the second on with what the pendulum leaves out, as the whole
robot's dynamics say of the last way (Kajita et al. 2003, sec. 5)."""


class Balancer:
    """Finds the shifts of all raises of a timeline."""

    def __init__(
        self,
        timeline: Timeline,
        tracks: LegTracks,
        model: RobotModel,
        times: Times,
        body: Poses,
        memory: Memory | None = None,
    ) -> None:
        """``body``: the path of the trunk at ``times``, without any shift."""
        self._tracks, self._model, self._memory = tracks, model, memory
        self._times, self._body = times, body
        self._shifts, self._end = timeline.in_order(BalanceShift), timeline.end
        self._key_ends = sorted(key.end for key in timeline.keys)

    def balance(self) -> tuple[list[Move], list[Problem]]:
        """What to add to the trunk's places [m], and the moments without a balanced pose."""
        moves, last = list[Move](), np.zeros(2)
        problems: list[Problem] = []
        starts = [*(shift.start for shift in self._shifts), self._end]
        for shift, end in zip(self._shifts, starts[1:], strict=True):
            start = shift.start
            for knot in self._knots(shift, end):
                try:
                    last = self._offset(knot, shift.raised, last)
                except IkError as error:
                    problems.append(Problem("balance", "trunk", knot, reason=str(error)))
                moves.append((replace(shift, start=start, end=knot), last))
                start = knot
        return moves, problems

    def _knots(self, shift: BalanceShift, end: float) -> list[float]:
        """The end of the shift, and every later end of a key while it lasts."""
        knots = [shift.end]
        if shift.raised:
            first = bisect_right(self._key_ends, shift.end + SAME)
            for t in self._key_ends[first : bisect_left(self._key_ends, end - SAME)]:
                if t > knots[-1] + SAME:
                    knots.append(t)
        return knots

    def _offset(
        self, t: float, raised: frozenset[Leg], guess: Float[np.ndarray, "2"]
    ) -> Float[np.ndarray, "2"]:
        if not raised:
            return np.zeros(2)
        index = nearest(self._times, t)
        pose = self._body[index].copy()
        pose[:2] += guess
        instant = self._times[index : index + 1]
        now = Instants.of(instant, pose[None], self._tracks.footing.at(instant))
        joints = self._tracks.paths(now).q[0]
        asked = raised, pose, joints, now.ground.p_feet[0]
        if self._memory is None:
            placed = self._solve(*asked)
        else:
            numbers = np.round(np.concatenate([one.ravel() for one in asked[1:]]), PLACES) + 0.0
            known = "balance", raised, numbers.tobytes()
            placed = self._memory.part(known, lambda: self._solve(*asked))
        return placed[:2] - self._body[index, :2]

    def _solve(
        self,
        raised: frozenset[Leg],
        pose: Float[np.ndarray, "6"],
        joints: Float[np.ndarray, "12"],
        p_feet: Float[np.ndarray, "4 3"],
    ) -> Float[np.ndarray, "19"]:
        """The balanced configuration nearest to ``pose`` that keeps the greatest margin.

        Standing still, the CoM above the support polygon is all that balance asks for (McGhee &
        Frank 1968, static stability margin); the check adds what accelerations need.
        """
        if len(raised) > 1:
            names = " and ".join(leg.name for leg in sorted(raised))
            raise IkError(f"{names} are raised at once: two feet cannot balance the trunk")
        (leg,) = raised
        start = configurations(pose[None], joints[None])[0]
        best: IkError | None = None
        for margin in MARGINS:
            targets = PoseTargets(
                p_world_feet=p_feet,
                rpy=(float(pose[3]), float(pose[4]), float(pose[5])),
                height=float(pose[2]),
                raised=leg,
                com_margin=margin,
                joint_margin=JOINT_MARGIN,
            )
            try:
                return solve_pose(self._model, targets, start)
            except IkError as error:
                best = error
        raise IkError(f"no pose balances without foot {leg.name}: {best}")


def nearest(times: Times, t: float) -> int:
    """Index of the one of the increasing ``times`` that is nearest to ``t``, the first of two."""
    after = min(int(np.searchsorted(times, t)), len(times) - 1)
    before = max(after - 1, 0)
    return before if abs(float(times[before]) - t) <= abs(float(times[after]) - t) else after


@dataclass(frozen=True, slots=True, kw_only=True)
class Stepping:
    """What is known of a stretch in which feet step, at n instants."""

    times: Times  #: (n,) increasing, evenly [s]
    p_com: Float[np.ndarray, "n 3"]  #: (n, 3) where the CoM would be [m]
    stance: Bool[np.ndarray, "n 4"]  #: (n, 4) feet that stand
    p_feet: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) where the feet are [m]
    gravity: float  #: [m/s^2]
    bias: Float[np.ndarray, "n 2"]  #: (n, 2) zero-moment point less that of the pendulum [m]

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
    """What to add to the place of the CoM in a stretch; its ``bias`` may change.

    The sway x keeps zero-moment point and CoM inside where G x <= h, one row for an edge at an
    instant; first those of the zero-moment point. A row has 8 numbers that are not 0, those of the
    4 coefficients of x and y that count at its instant, by turns; so all matrices are bands.
    """

    def __init__(self, stepping: Stepping) -> None:
        """Set it up for ``stepping``, with any bias: every edge at every instant.

        The CoM's edges count where more than two feet stand.
        """
        spline = _Spline(stepping)
        self._spline, self._period = spline, float(np.mean(np.diff(stepping.times)))
        zmp = spline.values - stepping.lever[:, None] * spline.curvature
        normals, bounds = _edges(stepping)
        edges, rows = np.nonzero(np.isfinite(bounds).T)  # edge after edge
        own = np.flatnonzero((stepping.stance.sum(axis=1) > 2)[rows])
        place = np.concatenate([np.arange(len(rows)), own])
        self._rows, self._of_com = rows[place], len(rows)
        self._normals, self._bounds = normals[rows, edges][place], bounds[rows, edges][place]
        along = np.vstack([zmp[rows], spline.values[rows[own]]])
        self._G = (along[:, :, None] * self._normals[:, None, :]).reshape(-1, 8)
        own_cost = self._period * _gram(spline.first, spline.values, spline.count)
        ones = np.arange(spline.count - 3)
        own_cost += SMOOTHING**6 * _gram(ones, np.tile(spline.jerk, (len(ones), 1)), spline.count)
        self._H = np.zeros((8, 2 * spline.count))
        self._H[::2] = np.repeat(own_cost, 2, axis=1)
        self._x = np.zeros(2 * spline.count)

    def solve(self, stepping: Stepping) -> Float[np.ndarray, "n 2"]:
        """The way [m] in the same stretch with its bias; nothing, at rest, at both ends."""
        spline = self._spline
        if spline.count <= 2 * FIXED:
            return np.zeros((len(stepping.times), 2))
        first, rest = self._rows[: self._of_com], self._rows[self._of_com :]
        points = np.concatenate([stepping.zmp()[first], stepping.p_com[rest, :2]])
        h = self._bounds - (self._normals * points).sum(axis=1)
        x = self._least(h, STIFFNESS * self._period).reshape(-1, 2)
        counted = x[spline.first[:, None] + np.arange(4)]  # n, 4, 2
        return (spline.values[:, :, None] * counted).sum(axis=1)

    def _least(self, h: Float[np.ndarray, " k"], stiffness: float) -> Float[np.ndarray, " m"]:
        """The x of least f(x) = x' H x + s |max(0, G x - h)|^2.

        Newton's steps from the last x, halved until f falls; they end where they would gain
        nothing.
        """
        H, G, first = self._H, self._G, 2 * self._spline.first[self._rows]
        columns, free = first[:, None] + np.arange(8), slice(2 * FIXED, -2 * FIXED)
        x = self._x

        def left(x: Float[np.ndarray, " m"]) -> Float[np.ndarray, " k"]:
            return np.einsum("ij,ij->i", G, x[columns]) - h

        def f(x: Float[np.ndarray, " m"], beyond: Float[np.ndarray, " k"]) -> float:
            own = x @ (H[0] * x) + 2.0 * sum(x[d:] @ (H[d, :-d] * x[:-d]) for d in (2, 4, 6))
            beyond = beyond[beyond > 0.0]
            return float(own + stiffness * beyond @ beyond)

        now = left(x)
        for _ in range(MOST_STEPS):
            active, wanted = now > 0.0, (1.0 - GAIN) * f(x, now)
            rows, place = G[active], first[active]
            band = H + stiffness * _gram(place, rows, len(x))
            force = np.zeros_like(x)
            np.add.at(force, columns[active], rows * h[active, None])
            way = -x
            way[free] += solveh_banded(band[:, free], stiffness * force[free], lower=True)
            tried = ((p, left(p)) for p in (x + share * way for share in HALVES))
            better = next(((p, one) for p, one in tried if f(p, one) < wanted), None)
            if better is None:
                break
            x, now = better
        self._x = x
        return x


FIXED = 3  #: Coefficients at either end that are 0: there the sway is nothing, at rest


class _Spline:
    """A uniform cubic spline over the times of a stretch: what its coefficients count for.

    At each of the n times 4 coefficients do, from ``first`` on (of ``count``): for the value, and
    the second derivative; and 4 for the jerk of a piece, scaled by the root of its length, so that
    squares sum to an integral.
    """

    def __init__(self, stepping: Stepping) -> None:
        times = stepping.times
        is_change = (stepping.stance[1:] != stepping.stance[:-1]).any(axis=1)
        spans = np.diff(times[1:][is_change])
        shortest = float(spans.min()) if len(spans) else LONGEST * KNOTS
        wanted = min(max(shortest / KNOTS, SHORTEST), LONGEST)
        pieces = max(round((times[-1] - times[0]) / wanted), 1)
        length = (times[-1] - times[0]) / pieces
        knots = times[0] + length * np.arange(-3, pieces + 4)
        inside = np.clip(times, knots[3], knots[-4])
        table = BSpline.design_matrix(inside, knots, 3)
        self.count = pieces + 3
        self.first = table.indices.reshape(-1, 4)[:, 0].astype(np.int64)
        self.values = table.data.reshape(-1, 4)
        u = (inside - knots[3 + self.first]) / length
        # Second differences over length^2, linear in between.
        self.curvature = np.column_stack([1.0 - u, 3.0 * u - 2.0, 1.0 - 3.0 * u, u]) / length**2
        self.jerk = np.array([-1.0, 3.0, -3.0, 1.0]) / length**2.5


def _gram(
    first: Int[np.ndarray, " k"], rows: Float[np.ndarray, "k w"], size: int
) -> Float[np.ndarray, "w size"]:
    """R' R as a lower band, of a matrix R with the numbers ``rows`` from columns ``first`` on."""
    width = rows.shape[1]
    band = np.zeros((width, size))
    for i in range(width):
        for j in range(i + 1):
            band[i - j] += np.bincount(first + j, rows[:, i] * rows[:, j], size)
    return band


def _edges(stepping: Stepping) -> tuple[Float[np.ndarray, "n 4 2"], Float[np.ndarray, "n 4"]]:
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


def swayed(
    now: Instants,
    body: Poses,
    stance: Bool[np.ndarray, "n 4"],
    raised: Bool[np.ndarray, "n 4"],
    tracks: LegTracks,
    model: RobotModel,
) -> Float[np.ndarray, "n 2"]:
    """Places x, y [m] of the base, near those of ``body``, in which the ground can hold it.

    In a stretch in which feet step; ``raised``: legs in the air that do not.
    """
    joints, p_feet = tracks.paths(now).q, now.ground.p_feet
    com, rpy = centres_of_mass(body, joints, model), body[:, 3:]
    stepping = Stepping(
        times=now.times,
        p_com=com,
        stance=stance,
        p_feet=p_feet,
        gravity=model.gravity,
        bias=np.zeros((len(com), 2)),
    )
    wanted = Wanted(
        p=com,
        is_com=np.ones(len(com), dtype=bool),
        R=now.R,
        q_joints=joints,
        raised=raised,
        p_feet=p_feet,
    )
    problem, p_base = SwayProblem(stepping), body[:, :3]
    for _ in range(PASSES):
        way = problem.solve(stepping)
        wanted = replace(wanted, p=com + np.pad(way, ((0, 0), (0, 1))))
        placed = place(wanted, CENTRING_STEPS, model)
        true = _zmp(now.times, np.hstack([placed.p_base, rpy]), placed.q_joints, model)
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
