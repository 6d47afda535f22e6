"""Slaps on the held paw, and leaning on it, from six directions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.postures import standing_fault
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from go2_wbc.legs import SIDES, Leg

RAISED = 0.5
"""Height [m] of the paw from which on it counts as raised; it is held at 0.6 m."""
SETTLE_TIME = 1.5
"""Time [s] from then to the first slap; the rest of the lift takes 0.3 s."""
RETURN_TIME = 2.0
"""Time [s] after a slap within which the paw must be back in its place."""
PAUSE = 0.3
"""Time [s] from there to the next slap."""
PLACE_TOLERANCE = 30.0
"""mm; a paw this near to its place is back in the pose. Dry friction in the joints keeps a part."""

DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "to the left": (0.0, 1.0, 0.0),
    "to the right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True, slots=True)
class Slap:
    """A force on the held paw.

    Attributes:
        name: begins the names of its rows.
        item: what the report calls it.
        force: [N].
        duration: [s].
    """

    name: str
    item: str
    force: float
    duration: float

    @property
    def cycle(self) -> float:
        """Time [s] from one slap to the next."""
        return self.duration + RETURN_TIME + PAUSE

    @property
    def rows(self) -> tuple[Row, Row, Row]:
        """Directions survived, how far the paw stays off its place, and what the call said."""
        count = float(len(DIRECTIONS))
        survived, off = "directions survived, of 6", "paw off its place after 2 s"
        return (
            Row(f"{self.name}.survived", self.item, survived, "", count, Direction.AT_LEAST),
            Row(f"{self.name}.off", self.item, off, "mm", PLACE_TOLERANCE),
            Row(f"{self.name}.said", self.item, "high_five() said True", "", None),
        )


SLAPS = (
    Slap("slap", "slap on the held paw, 40 N, 0.1 s", 40.0, 0.1),
    Slap("lean", "leaning on the held paw, 15 N, 1 s", 15.0, 1.0),
)
ROWS = tuple(row for slap in SLAPS for row in slap.rows)


def measure(trial: Trial) -> Measurement:
    """Slap and lean on the paw while it is held, left for even seeds and right for odd ones.

    - directions survived: of six, along the axes of the robot's heading; the robot must not fall
      until the high five is over, and must stand then. The call itself may say False, if the slap
      took the paw below its height;
    - paw off its place: distance, in the world, of the foot's centre 2 s after the end of the
      force from where it was before; worst direction.
    """
    side = ("left", "right")[trial.seed % 2]
    trial = Trial(trial.seed, has_nominal_friction=True)
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for slap in SLAPS:
        survived, off, said = slap.rows
        found = _slap_all(trial, side, slap)
        values[survived.name] = float(len(DIRECTIONS) - len(found.lost))
        values[said.name] = found.said
        if found.distances:
            values[off.name] = max(found.distances.values())
        if found.lost:
            reason = "; ".join(f"{direction}: {why}" for direction, why in found.lost.items())
            failures |= {survived.name: reason, off.name: reason}
    return Measurement(values, failures)


@dataclass(frozen=True, slots=True)
class _Slapped:
    """What came of slaps, by direction: why it was lost, or the paw's distance [mm] afterwards.

    ``said`` is 1 if the last call of ``high_five`` said True.
    """

    lost: dict[str, str]
    distances: dict[str, float]
    said: float


def _slap_all(trial: Trial, side: str, slap: Slap) -> _Slapped:
    """Slaps from all directions; after a fall a new robot goes on with the next one."""
    lost: dict[str, str] = {}
    distances: dict[str, float] = {}
    remaining, said = list(DIRECTIONS), False
    while remaining:
        with Subject(trial) as robot:
            slapper = Slapper(robot, SIDES[side], slap, remaining)
            robot.truth.on_tick = slapper
            try:
                robot.require(robot.go2.stand())
                hold = SETTLE_TIME + slap.cycle * len(remaining)
                said = robot.go2.high_five(side, hold=hold)
                fault = robot.truth.fall() or standing_fault(robot)
            except Failed as failed:
                fault = str(failed)
            distances |= slapper.distances
            if fault is not None:
                culprit = remaining[min(len(slapper.distances), len(remaining) - 1)]
                lost[culprit] = f"{fault} ({robot.go2.last_outcome.reason})"
                distances.pop(culprit, None)
        remaining = [d for d in remaining if d not in lost and d not in distances]
    return _Slapped(lost, distances, float(said))


class Slapper:
    """Slaps the paw in the given directions, one after the other, once it is raised.

    A robot that has fallen, or whose paw is down, after a slap ends the call with ``Failed``.

    Attributes:
        distances: how far [mm] the paw was off its place afterwards, by direction.
    """

    def __init__(self, robot: Subject, leg: Leg, slap: Slap, directions: list[str]) -> None:
        """Slap ``leg``'s paw of ``robot``; call the slapper after every tick."""
        self._robot, self._leg, self._slap = robot, leg, slap
        self._waiting = deque(directions)
        self._events: deque[tuple[float, Callable[[], None]]] | None = None
        self.distances: dict[str, float] = {}

    def __call__(self) -> None:
        """Do what is due at this tick."""
        now = self._robot.plant.time
        if self._events is None:
            if self._paw[2] > RAISED:
                self._events = deque(self._schedule(now + SETTLE_TIME))
            return
        while self._events and now >= self._events[0][0]:
            self._events.popleft()[1]()

    def _schedule(self, start: float) -> list[tuple[float, Callable[[], None]]]:
        slap, events = self._slap, []
        for index in range(len(self._waiting)):
            begin = start + index * slap.cycle
            events.append((begin, self._hit))
            events.append((begin + slap.duration + RETURN_TIME, self._look))
        return events

    def _hit(self) -> None:
        self._place = self._paw
        direction = np.array(DIRECTIONS[self._waiting[0]])
        self._robot.push(self._slap.force * direction, self._slap.duration, self._leg.foot)

    def _look(self) -> None:
        fall = self._robot.truth.fall()
        if fall is not None or self._paw[2] < RAISED:
            raise Failed(fall or f"the paw is at {self._paw[2]:.2f} m two seconds later")
        distance = 1000.0 * float(np.linalg.norm(self._paw - self._place))
        self.distances[self._waiting.popleft()] = distance

    @property
    def _paw(self) -> np.ndarray:
        return self._robot.plant.p_world_feet[self._leg]


FAMILY = Family("slaps", ROWS, measure)
