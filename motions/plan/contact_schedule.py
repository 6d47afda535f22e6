"""Who stands when: lift-offs and touchdowns of a timeline, and over how long feet are unloaded."""

from __future__ import annotations

from bisect import bisect_left
from itertools import pairwise

import numpy as np
from jaxtyping import Bool

from go2_wbc.contacts import ContactSchedule
from go2_wbc.legs import LEGS, Leg
from motions.language.clock import SAME
from motions.language.keys import LegKey, StepKey
from motions.language.timeline import Timeline
from motions.language.timeline_data import distinct

UNLOAD_TIME = 0.3
"""Time [s] over which a foot gives up its load before lift-off, if there is that much: own choice,
so that the forces of the others change slowly."""
LEAST_RAMP = 0.03
"""The same [s] where one foot lands as another lifts off: as ``LocomotionConfig.load_ramp``."""


def flights(timeline: Timeline, leg: Leg) -> list[tuple[float, float]]:
    """Spans [s] in which a foot is off the ground; the last one may be endless."""
    spans = swings(timeline, leg)
    begin: float | None = None
    for key in timeline.in_order(LegKey):
        if key.leg is not leg:
            continue
        if begin is None:
            begin = key.start
        if key.target.is_on_ground:
            spans.append((begin, key.end))
            begin = None
    return sorted(spans if begin is None else [*spans, (begin, np.inf)])


def swings(timeline: Timeline, leg: Leg) -> list[tuple[float, float]]:
    """Spans [s] in which a foot steps."""
    return [(key.start, key.end) for key in timeline.in_order(StepKey) if key.leg is leg]


def stepping_feet(timeline: Timeline, contacts: ContactSchedule) -> Bool[np.ndarray, "m 4"]:
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
    times = distinct(*sorted([0.0, *changes]))
    modes = np.ones((len(times), 4), dtype=bool)
    for leg, flown in spans.items():
        for lift_off, touchdown in flown:
            first, last = (bisect_left(times, t - SAME) for t in (lift_off, touchdown))
            modes[first:last, leg] = False
    return ContactSchedule(times, modes)


def load_ramp(timeline: Timeline) -> float:
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
