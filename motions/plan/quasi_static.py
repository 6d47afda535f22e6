"""Timeline -> plan: the trunk's path, the legs' joints and the contacts, as smooth curves.

The tracks are sampled a hundred times a second, the legs solved in closed form, and cubic splines
laid through the CoM, the attitude and the joints; so positions, velocities and accelerations of a
plan are each other's derivatives. What cannot be done as written does not end in a near miss: it is
kept in ``problems``, which the feasibility check reports.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import centres_of_mass
from motions.language.clock import SAME
from motions.language.footing import Footing
from motions.language.keys import BalanceShift, FootHold, Mark
from motions.language.timeline import Timeline
from motions.plan.balance import Balancer
from motions.plan.com_trajectory import Span, swayed
from motions.plan.compiled_plan import CompiledPlan, Problem, event_at
from motions.plan.contact_schedule import contact_schedule, load_ramp, stepping_feet
from motions.plan.tracks import JointPaths, LegTracks, Times, body_path, sample_times
from motions.postures import home_poses, standing_feet

REACH_TOLERANCE = 5e-3
"""Distance [m] by which a place may be out of reach before it counts: own choice, less than the 12
mm that tracking adds."""


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
    times, home = sample_times(timeline.end), home_poses(model)
    footing = Footing(timeline, standing_feet(model), p_feet)
    ground = footing.at(times)
    tracks = LegTracks(timeline, footing, model, home[timeline.entry])
    body = body_path(timeline, home, times, ground)
    offsets, problems = Balancer(timeline, tracks, model, times, body).balance()
    body[:, :2] += offsets
    contacts = contact_schedule(timeline)
    steps = stepping_feet(timeline, contacts)
    raised = ~(contacts.at_times(times).stance | steps[event_at(contacts, times)])
    for shift in timeline.in_order(BalanceShift):
        if shift.is_swaying:
            rows = slice(*np.searchsorted(times, [shift.start - SAME, shift.end + SAME]).tolist())
            span = Span(times[rows], contacts.at_times(times[rows]).stance, raised[rows])
            body[rows, :2] = swayed(span, body[rows], tracks, model)
    legs = tracks.paths(times, body, ground)
    com = centres_of_mass(body, legs.q, model)
    problems += _out_of_reach(legs, times)
    feet = tracks.feet(raised, ground, body, legs.q)
    samples = np.hstack([com, body[:, 3:], legs.q, feet.reshape(-1, 12)])
    return CompiledPlan(
        name=timeline.name,
        entry=timeline.entry,
        exit=timeline.exit,
        curves=CubicSpline(times, samples, bc_type="clamped"),
        contacts=contacts,
        swings=steps,
        ramp=load_ramp(timeline),
        problems=tuple(problems),
        spans={mark.name: (mark.start, mark.end) for mark in timeline.in_order(Mark)},
        beats=timeline.beats,
        held={key.name: key.leg for key in timeline.in_order(FootHold)},
    )


def _out_of_reach(legs: JointPaths, times: Times) -> list[Problem]:
    """The worst instant of every leg whose foot is asked for more than it reaches."""
    problems = []
    for leg in LEGS:
        worst = int(np.argmax(legs.miss[:, leg]))
        miss = float(legs.miss[worst, leg])
        if miss > REACH_TOLERANCE:
            problems.append(Problem("way of a foot", leg.name, float(times[worst]), miss))
    return problems
