"""Timeline -> plan: the trunk's path, the legs' joints and the contacts, as smooth curves.

The tracks are sampled a hundred times a second, the legs solved in closed form, and cubic splines
laid through the CoM, the attitude and the joints; so positions, velocities and accelerations of a
plan are each other's derivatives. What cannot be done as written does not end in a near miss: it is
kept in ``problems``, which the feasibility check reports.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from go2_wbc.contacts import ContactSchedule
from go2_wbc.curves import CurvePoint
from go2_wbc.errors import TimelineError
from go2_wbc.kernels.layout import REFERENCE
from go2_wbc.legs import LEGS
from go2_wbc.reference import MotionPlan, Posture, Reference, TrackedPoint
from go2_wbc.robot.model import RobotModel
from motions.balance import Balancer, Problem
from motions.keys import Mark
from motions.placement import attitudes, centres_of_mass
from motions.plan import NORMAL_FORCE_MAX, NORMAL_FORCE_MIN, reference
from motions.samples import PlanSamples
from motions.timeline import Timeline
from motions.tracks import (
    LegTracks,
    body_path,
    flights,
    home_poses,
    sample_times,
)

REACH_TOLERANCE = 1e-3
"""Distance [m] by which a place may be out of reach before it counts: own choice, less than what
tracking adds."""
UNLOAD_TIME = 0.3
"""Time [s] over which a foot gives up its load before lift-off, if there is that much: own choice,
so that the forces of the others change slowly."""


@dataclass(frozen=True, slots=True)
class CompiledPlan(MotionPlan):
    """A timeline, ready to be played.

    Attributes:
        name, entry, exit: see ``MotionPlan``.
        curves: spline of CoM [m], roll, pitch, yaw [rad] and the twelve joints [rad]: (18,).
        contacts: who stands when.
        ramp: time [s] over which a foot is unloaded before lift-off and loaded after touchdown.
        problems: what could not be done as written.
        spans: start and end [s] of the named holds.
    """

    name: str
    entry: Posture
    exit: Posture
    curves: CubicSpline
    contacts: ContactSchedule
    ramp: float
    problems: tuple[Problem, ...]
    spans: Mapping[str, tuple[float, float]]
    _tables: tuple[Any, Any, Any, Any, Any, Any] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Bind what the kernel reads."""
        contacts, curves = self.contacts, self.curves
        modes, events = contacts.modes.astype(float), np.array(contacts.times)
        tables = (curves.x, curves.c, events, modes, contacts.since, contacts.until)
        object.__setattr__(self, "_tables", tables)

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length of the motion [s]."""
        return float(self.curves.x[-1])

    def at(self, t: float) -> Reference:
        """The reference at ``t``; see ``MotionPlan.at``."""
        return Reference.of_row(self.row_at(t))

    def row_at(self, t: float) -> Float[np.ndarray, " size"]:
        """Its numbers, by a kernel; see ``MotionPlan.row_at``."""
        from go2_wbc.kernels.playing import planned_at

        row = np.empty(REFERENCE.size)
        planned_at(*self._tables, self.ramp, NORMAL_FORCE_MIN, NORMAL_FORCE_MAX, t, row)
        return row

    def readable_at(self, t: float) -> Reference:
        """The same as ``at``, step by step: what the kernel is held to."""
        curves, phase = self._curves_at(t), self.contacts.at(t)
        body, joints = (
            CurvePoint(*(curve[part] for curve in curves)) for part in (slice(6), slice(6, None))
        )
        share = phase.load_share(self.ramp)
        return reference(TrackedPoint.COM, body, joints, phase.stance, share)

    def _curves_at(self, t: float) -> Float[np.ndarray, "3 18"]:
        """Values, rates and accelerations of all curves: a cubic and its two derivatives."""
        knots, end = self.curves.x, self.duration
        inside = min(max(t, 0.0), end)
        piece = min(int(np.searchsorted(knots, inside, side="right")), len(knots) - 1) - 1
        s = inside - float(knots[piece])
        powers = np.array([[s**3, s * s, s, 1], [3 * s * s, 2 * s, 1, 0], [6 * s, 2, 0, 0]])
        if inside != t:
            powers[1:] = 0.0  # the ends are held
        return powers @ self.curves.c[:, piece]

    def samples(self, times: Float[np.ndarray, " n"]) -> PlanSamples:
        """What the references at ``times`` ask for; ``at`` gives the same one by one."""
        values = self.curves(np.clip(times, 0.0, self.duration))
        phase = self.contacts.at_times(times)
        return PlanSamples(
            times=times,
            p_world=values[:, :3],
            is_com=np.ones(len(times), dtype=bool),
            R_world_base=attitudes(values[:, 3:6]),
            q_joints=values[:, 6:],
            stance=phase.stance,
            raised=~phase.stance,
            normal_force_max=NORMAL_FORCE_MAX * phase.load_share(self.ramp),
        )


def compile_timeline(timeline: Timeline, model: RobotModel) -> CompiledPlan:
    """The plan of ``timeline``, in the frame of the motion.

    It tracks the CoM, which balance is about, and not the base. Clamped splines begin and end at
    rest.

    Args:
        timeline: what to compile.
        model: of the robot; compiling uses its data, so it must not be that of a control loop that
            runs in another thread.

    Raises:
        TimelineError: if it is empty.
    """
    if not timeline.keys:
        raise TimelineError(
            f"motion {timeline.name!r} is empty: it needs at least one body(), foot() or leg()"
        )
    times = sample_times(timeline.end)
    home = home_poses(model)
    tracks = LegTracks(timeline, model, home[timeline.entry])
    body = body_path(timeline, home, times)
    offsets, problems = Balancer(timeline, tracks, model, times, body).balance()
    body[:, :2] += offsets
    paths = [tracks.path(leg, times, body) for leg in LEGS]
    joints = np.hstack([path.q for path in paths])
    com = centres_of_mass(body, joints, model)
    for leg, path in zip(LEGS, paths, strict=True):
        worst = int(np.argmax(path.miss))
        if path.miss[worst] > REACH_TOLERANCE:
            miss = float(path.miss[worst])
            problems.append(Problem("way of a foot", leg.name, float(times[worst]), miss))
    samples = np.hstack([com, body[:, 3:], joints])
    return CompiledPlan(
        name=timeline.name,
        entry=timeline.entry,
        exit=timeline.exit,
        curves=CubicSpline(times, samples, bc_type="clamped"),
        contacts=contact_schedule(timeline),
        ramp=_ramp(timeline),
        problems=tuple(problems),
        spans={mark.name: (mark.start, mark.end) for mark in timeline.in_order(Mark)},
    )


def contact_schedule(timeline: Timeline) -> ContactSchedule:
    """Who stands when, as events."""
    spans = {leg: flights(timeline, leg) for leg in LEGS}
    changes = {t for legs in spans.values() for span in legs for t in span if np.isfinite(t)}
    times = sorted({0.0, *changes})
    modes = np.ones((len(times), 4), dtype=bool)
    for leg, flown in spans.items():
        for lift_off, touchdown in flown:
            modes[bisect_left(times, lift_off) : bisect_left(times, touchdown), leg] = False
    return ContactSchedule(tuple(times), modes)


def _ramp(timeline: Timeline) -> float:
    """Half of the shortest time on the ground between two flights, at most ``UNLOAD_TIME``.

    Before the first flight the foot may use all the time that there is.
    """
    spans = [flights(timeline, leg) for leg in LEGS]
    before = [flown[0][0] for flown in spans if flown]
    between = [(up - down) / 2 for flown in spans for (_, down), (up, _) in pairwise(flown)]
    return min([UNLOAD_TIME, *(stood for stood in (*before, *between) if stood > 0.0)])
