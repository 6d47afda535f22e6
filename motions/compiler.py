"""Timeline -> plan: the trunk's path, the legs' joints and the contacts, as smooth curves.

The tracks are sampled a hundred times a second, the legs solved in closed form, and cubic splines
laid through the CoM, the attitude and the joints; so positions, velocities and accelerations of a
plan are each other's derivatives. What cannot be done as written does not end in a near miss: it is
kept in ``problems``, which the feasibility check reports.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from go2_wbc.contacts import ContactSchedule
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS
from go2_wbc.robot.leg_kinematics import LegAngles
from go2_wbc.robot.model import RobotModel
from motions.balance import Balancer
from motions.compiled_plan import CompiledPlan, event_at
from motions.footing import Footing, standing_feet
from motions.keys import BalanceShift, Mark
from motions.language.written import SAME
from motions.placement import centres_of_mass
from motions.problem import Problem
from motions.swaying import Span, swayed
from motions.timeline import Timeline
from motions.tracks import (
    LegTracks,
    Times,
    body_path,
    flights,
    home_poses,
    sample_times,
    swings,
)

REACH_TOLERANCE = 5e-3
"""Distance [m] by which a place may be out of reach before it counts: own choice, less than the 12
mm that tracking adds."""
UNLOAD_TIME = 0.3
"""Time [s] over which a foot gives up its load before lift-off, if there is that much: own choice,
so that the forces of the others change slowly."""
LEAST_RAMP = 0.03
"""The same [s] where one foot lands as another lifts off."""


def compile_quasi_static(
    timeline: Timeline, model: RobotModel, p_feet: Float[np.ndarray, "4 3"] | None = None
) -> CompiledPlan:
    """The plan of ``timeline`` without dynamic blocks, in the frame of the motion.

    It tracks the CoM, which balance is about, and not the base. Clamped splines begin and end at
    rest.

    Args:
        timeline: what to compile.
        model: of the robot; compiling uses its data, so it must not be that of a control loop that
            runs in another thread.
        p_feet: where the feet's centres stand at first [m], by default below the hips; the trunk
            starts above them, with their heading.

    Raises:
        TimelineError: if it is empty, or a raised foot steps.
    """
    if not timeline.keys:
        raise TimelineError(
            f"motion {timeline.name!r} is empty: it needs at least one body(), foot() or leg()"
        )
    times = sample_times(timeline.end)
    home = home_poses(model)
    footing = Footing(timeline, standing_feet(model), p_feet)
    tracks = LegTracks(timeline, footing, model, home[timeline.entry])
    body = body_path(timeline, home, times, footing.frames(times))
    offsets, problems = Balancer(timeline, tracks, model, times, body).balance()
    body[:, :2] += offsets
    contacts = contact_schedule(timeline)
    steps = _swings(timeline, contacts)
    raised = ~(contacts.at_times(times).stance | steps[event_at(contacts, times)])
    for shift in timeline.in_order(BalanceShift):
        if shift.is_swaying:
            rows = slice(*np.searchsorted(times, [shift.start - SAME, shift.end + SAME]).tolist())
            span = Span(times[rows], contacts.at_times(times[rows]).stance, raised[rows])
            body[rows, :2] = swayed(span, body[rows], tracks, model)
    paths = [tracks.path(leg, times, body) for leg in LEGS]
    joints = np.hstack([path.q for path in paths])
    com = centres_of_mass(body, joints, model)
    problems += _out_of_reach(paths, times)
    feet = tracks.feet(raised, footing.places(times), body, joints)
    samples = np.hstack([com, body[:, 3:], joints, feet.reshape(-1, 12)])
    return CompiledPlan(
        name=timeline.name,
        entry=timeline.entry,
        exit=timeline.exit,
        curves=CubicSpline(times, samples, bc_type="clamped"),
        contacts=contacts,
        swings=steps,
        ramp=_ramp(timeline),
        problems=tuple(problems),
        spans={mark.name: (mark.start, mark.end) for mark in timeline.in_order(Mark)},
        beats=timeline.beats,
    )


def _out_of_reach(paths: Sequence[LegAngles], times: Times) -> list[Problem]:
    """The worst instant of every leg whose foot is asked for more than it reaches."""
    problems = []
    for leg, path in zip(LEGS, paths, strict=True):
        worst = int(np.argmax(path.miss))
        if path.miss[worst] > REACH_TOLERANCE:
            miss = float(path.miss[worst])
            problems.append(Problem("way of a foot", leg.name, float(times[worst]), miss))
    return problems


def _swings(timeline: Timeline, contacts: ContactSchedule) -> Bool[np.ndarray, "m 4"]:
    """Feet that step, from each event on."""
    starts = np.array(contacts.times)
    modes = np.zeros_like(contacts.modes)
    for leg in LEGS:
        for start, end in swings(timeline, leg):
            modes[(starts > start - SAME) & (starts < end - SAME), leg] = True
    return modes


def contact_schedule(timeline: Timeline) -> ContactSchedule:
    """Who stands when, as events."""
    spans = {leg: flights(timeline, leg) for leg in LEGS}
    changes = [t for legs in spans.values() for span in legs for t in span if np.isfinite(t)]
    times = _distinct([0.0, *changes])
    modes = np.ones((len(times), 4), dtype=bool)
    for leg, flown in spans.items():
        for lift_off, touchdown in flown:
            first, last = (bisect_left(times, t - SAME) for t in (lift_off, touchdown))
            modes[first:last, leg] = False
    return ContactSchedule(tuple(times), modes)


def _distinct(times: list[float]) -> list[float]:
    """In order; of those that are the same but for rounding, the first."""
    ordered = sorted(times)
    return ordered[:1] + [t for before, t in pairwise(ordered) if t > before + SAME]


def _ramp(timeline: Timeline) -> float:
    """Half of the shortest time on the ground between two flights, at most ``UNLOAD_TIME``.

    Before the first flight the foot may use all the time that there is. Where a foot that has
    stepped follows another one, it takes over within the time on four feet between them.
    """
    spans = [flights(timeline, leg) for leg in LEGS]
    before = [flown[0][0] for flown in spans if flown]
    between = [(up - down) / 2 for flown in spans for (_, down), (up, _) in pairwise(flown)]
    lift_offs = sorted(up for flown in spans for up, _ in flown)
    steps = [down for leg in LEGS for _, down in swings(timeline, leg)]
    following = [bisect_left(lift_offs, down - SAME) for down in steps]
    handed = [
        max(lift_offs[index] - down, LEAST_RAMP)
        for down, index in zip(steps, following, strict=True)
        if index < len(lift_offs)
    ]
    return min([UNLOAD_TIME, *(t for t in (*before, *between, *handed) if t > 0.0)])
