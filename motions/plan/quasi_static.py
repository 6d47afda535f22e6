"""Timeline -> plan: the trunk's path, the legs' joints and the contacts, as smooth curves.

The tracks are sampled a hundred times a second, the legs solved in closed form, and cubic splines
laid through the CoM, the attitude and the joints; so velocities and accelerations of a plan are the
derivatives of its positions. What cannot be done as written is listed in ``problems``, which the
feasibility check reports.
"""

from __future__ import annotations

from bisect import bisect_left
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from go2_wbc.contacts import ContactSchedule
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import centres_of_mass
from motions.language.footing import Footing
from motions.language.keys import BalanceShift, FootHold, LegKey, Mark, StepKey
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME, distinct
from motions.memory import Memory
from motions.plan.balance import Balancer, swayed
from motions.plan.compiled_plan import CompiledPlan, Problem, event_at
from motions.plan.tracks import (
    Instants,
    JointPaths,
    LegTracks,
    Times,
    body_path,
    followed,
    sample_times,
)
from motions.postures import home_poses, standing_feet

REACH_TOLERANCE = 5e-3
"""Distance [m] by which a place may be out of reach before it counts: own choice, less than the 12
mm that tracking adds."""
UNLOAD_TIME = 0.3
"""Time [s] over which a foot gives up its load before lift-off, if there is that much: own choice,
so that the forces of the others change slowly."""
LEAST_RAMP = 0.03  #: The same [s] where one foot lands as another lifts off


def compile_quasi_static(
    timeline: Timeline,
    model: RobotModel,
    p_feet: Float[np.ndarray, "4 3"] | None = None,
    memory: Memory | None = None,
) -> CompiledPlan:
    """The plan of ``timeline`` without dynamic blocks, in the frame of the motion.

    It tracks the CoM, which balance is about, and not the base. Clamped splines begin and end at
    rest.

    Args:
        model: of the robot; compiling uses its data, so it must not be that of a control loop that
            runs in another thread.
        p_feet: where the feet's centres stand at first [m], by default below the hips; the trunk
            starts above them, with their heading.
        memory: of the poses that balance; none by default.

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
    shifts, problems = Balancer(timeline, tracks, model, times, body, memory).balance()
    body[:, :2] += followed(times, np.zeros(2), shifts)
    feet = FootContacts(timeline)
    contacts = feet.schedule()
    steps = feet.stepping(contacts)
    raised = ~(contacts.at_times(times).stance | steps[event_at(contacts, times)])
    for shift in timeline.in_order(BalanceShift):
        if shift.is_swaying:
            rows = slice(*np.searchsorted(times, [shift.start - SAME, shift.end + SAME]).tolist())
            own = shift.start + sample_times(shift.end - shift.start)
            places = footing.at(own)
            trunk = body_path(timeline, home, own, places)
            trunk[:, :2] += followed(own, np.zeros(2), shifts)
            stance = contacts.at_times(own).stance
            held = ~(stance | steps[event_at(contacts, own)])
            now = Instants.of(own, trunk, places)
            way = swayed(now, trunk, stance, held, tracks, model) - trunk[:, :2]
            body[rows, :2] += CubicSpline(own, way, bc_type="clamped")(times[rows])
    now = Instants.of(times, body, ground)
    legs = tracks.paths(now)
    com = centres_of_mass(body, legs.q, model)
    problems += _out_of_reach(legs, times)
    p_feet = tracks.feet(raised, now, legs.q)
    samples = np.hstack([com, body[:, 3:], legs.q, p_feet.reshape(-1, 12)])
    return CompiledPlan(
        name=timeline.name,
        entry=timeline.entry,
        exit=timeline.exit,
        curves=CubicSpline(times, samples, bc_type="clamped"),
        contacts=contacts,
        swings=steps,
        ramp=feet.ramp(),
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


class FootContacts:
    """The feet of a timeline: when they are off the ground, and when they step."""

    def __init__(self, timeline: Timeline) -> None:
        self.swings: dict[Leg, list[tuple[float, float]]] = {leg: [] for leg in LEGS}
        """Spans [s] of steps."""
        for step in timeline.in_order(StepKey):
            self.swings[step.leg].append((step.start, step.end))
        self.flights = {leg: list(spans) for leg, spans in self.swings.items()}
        """Of each leg, spans [s] in which its foot is in the air; the last may be endless."""
        begun: dict[Leg, float] = {}
        for key in timeline.in_order(LegKey):
            begin = begun.setdefault(key.leg, key.start)
            if key.target.is_on_ground:
                self.flights[key.leg].append((begin, key.end))
                del begun[key.leg]
        for leg, spans in self.flights.items():
            spans += [(begun[leg], np.inf)] if leg in begun else []
            spans.sort()

    def schedule(self) -> ContactSchedule:
        """Who stands when, as events."""
        changes = [t for spans in self.flights.values() for span in spans for t in span]
        times = distinct(*sorted([0.0, *(t for t in changes if np.isfinite(t))]))
        modes = np.ones((len(times), 4), dtype=bool)
        for leg, spans in self.flights.items():
            for lift_off, touchdown in spans:
                first, last = (bisect_left(times, t - SAME) for t in (lift_off, touchdown))
                modes[first:last, leg] = False
        return ContactSchedule(times, modes)

    def stepping(self, contacts: ContactSchedule) -> Bool[np.ndarray, "m 4"]:
        """Feet that step, from each event on."""
        starts, modes = np.array(contacts.times), np.zeros_like(contacts.modes)
        for leg, spans in self.swings.items():
            for start, end in spans:
                modes[(starts > start - SAME) & (starts < end - SAME), leg] = True
        return modes

    def ramp(self) -> float:
        """Half of the shortest time on the ground between two flights, at most ``UNLOAD_TIME``.

        Before the first flight the foot may use all the time that there is. Where a foot that has
        stepped follows another one, it takes over within the time on four feet between them.
        """
        spans = [flown for flown in self.flights.values() if flown]
        before = [flown[0][0] for flown in spans]
        between = [(up - down) / 2 for flown in spans for (_, down), (up, _) in pairwise(flown)]
        lift_offs = sorted(up for flown in spans for up, _ in flown)
        steps = [down for swung in self.swings.values() for _, down in swung]
        following = [bisect_left(lift_offs, down - SAME) for down in steps]
        handed = [
            max(lift_offs[index] - down, LEAST_RAMP)
            for down, index in zip(steps, following, strict=True)
            if index < len(lift_offs)
        ]
        return min([UNLOAD_TIME, *(t for t in (*before, *between, *handed) if t > 0.0)])
