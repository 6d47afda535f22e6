"""Who stands when: lift-offs and touchdowns of a timeline, and how long feet are unloaded."""

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
"""The same [s] where one foot lands as another lifts off."""


class FootContacts:
    """The feet of a timeline: when they are off the ground, and when they step.

    Attributes:
        flights: of each leg, spans [s] in which its foot is in the air; the last may be endless.
        swings: of each leg, spans [s] in which its foot steps.
    """

    def __init__(self, timeline: Timeline) -> None:
        """Of the keys of ``timeline``."""
        self.swings: dict[Leg, list[tuple[float, float]]] = {leg: [] for leg in LEGS}
        for step in timeline.in_order(StepKey):
            self.swings[step.leg].append((step.start, step.end))
        self.flights = {leg: list(spans) for leg, spans in self.swings.items()}
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
