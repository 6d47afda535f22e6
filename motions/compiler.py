"""Timeline -> plan: the trunk's path, the legs' joints and the contacts, as smooth curves.

The tracks are sampled a hundred times a second, the legs solved in closed form, and cubic splines
laid through the CoM, the attitude and the joints; so positions, velocities and accelerations of a
plan are each other's derivatives. What cannot be done as written does not end in a near miss: it is
kept in ``problems``, which the feasibility check reports.
"""

from __future__ import annotations

from bisect import bisect_left
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from go2_wbc.contacts import ContactSchedule
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from motions.balance import Balancer
from motions.compiled_plan import CompiledPlan
from motions.keys import Mark
from motions.placement import centres_of_mass
from motions.problem import Problem
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
    contacts = contact_schedule(timeline)
    samples = np.hstack(
        [com, body[:, 3:], joints, tracks.feet(contacts.at_times(times).stance, body, joints)]
    )
    return CompiledPlan(
        name=timeline.name,
        entry=timeline.entry,
        exit=timeline.exit,
        curves=CubicSpline(times, samples, bc_type="clamped"),
        contacts=contacts,
        swings=np.zeros_like(contacts.modes),
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
