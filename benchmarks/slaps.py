"""Slaps on the held paw, and leaning on it, from six directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.postures import standing_failure
from benchmarks.pushes import DIRECTIONS
from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.legs import SIDES

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


@dataclass(frozen=True, slots=True)
class Slap:
    """A ``force`` [N] on the held paw for ``duration`` [s]; ``name`` begins its metrics' names."""

    name: str
    item: str
    force: float
    duration: float

    @property
    def cycle(self) -> float:
        """Time [s] from one slap to the next."""
        return self.duration + RETURN_TIME + PAUSE

    @property
    def metrics(self) -> tuple[Metric, Metric, Metric]:
        """Directions survived, how far the paw stays off its place, and what the call said."""
        count = float(len(DIRECTIONS))
        survived, off = "directions survived, of 6", "paw off after 2 s"
        return (
            Metric(f"{self.name}.survived", self.item, survived, "", count, Direction.AT_LEAST),
            Metric(f"{self.name}.off", self.item, off, "mm", PLACE_TOLERANCE),
            Metric(f"{self.name}.said", self.item, "high_five() said True", "", None),
        )


SLAPS = (
    Slap("slap", "slap on the held paw, 40 N, 0.1 s", 40.0, 0.1),
    Slap("lean", "leaning on the held paw, 15 N, 1 s", 15.0, 1.0),
)


def measure(trial: Trial) -> Measurement:
    """Slap and lean on the paw while it is held, left for even seeds and right for odd ones.

    - directions survived: of six, along the axes of the robot's heading; the robot must not fall
      until the high five is over, and must stand then. The call itself may say False, if the slap
      took the paw below its height;
    - paw off its place: distance, in the world, of the foot's centre 2 s after the end of the
      force from where it was before; worst direction.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for slap in SLAPS:
        survived, off, said = (metric.name for metric in slap.metrics)
        distances, lost, values[said] = _slap_all(replace(trial, has_nominal_friction=True), slap)
        values[survived] = float(len(DIRECTIONS) - len(lost))
        if distances:
            values[off] = max(distances.values())
        if lost:
            reason = "; ".join(f"{direction}: {why}" for direction, why in lost.items())
            failures |= {survived: reason, off: reason}
    return Measurement(values, failures)


def _slap_all(trial: Trial, slap: Slap) -> tuple[dict[str, float], dict[str, str], float]:
    """Slaps from all directions; after a fall a new robot goes on with the next one.

    Returns:
        By direction the paw's distance [mm] from its place, or why it was lost; and 1 if the last
        call of ``high_five`` said True.
    """
    side = ("left", "right")[trial.seed % 2]
    distances: dict[str, float] = {}
    lost: dict[str, str] = {}
    remaining, said = list(DIRECTIONS), False
    while remaining:
        with TrialRobot(trial) as robot:
            found: dict[str, float] = {}
            ticks = _slaps(robot, side, slap, remaining, found)
            robot.truth.on_tick = partial(next, ticks, None)
            try:
                robot.require(robot.go2.stand())
                said = robot.go2.high_five(side, hold=SETTLE_TIME + slap.cycle * len(remaining))
                failure = robot.truth.fall() or standing_failure(robot)
            except TrialFailed as failed:
                failure = str(failed)
            if failure is not None:
                culprit = remaining[min(len(found), len(remaining) - 1)]
                lost[culprit] = f"{failure} ({robot.go2.last_outcome.reason})"
                found.pop(culprit, None)
            distances |= found
        remaining = [d for d in remaining if d not in lost and d not in distances]
    return distances, lost, float(said)


def _slaps(
    robot: TrialRobot, side: str, slap: Slap, directions: Sequence[str], found: dict[str, float]
) -> Iterator[None]:
    """Slap the paw from one direction after the other, once it is raised; one ``next`` a tick.

    Puts into ``found`` how far [mm] the paw was off its place afterwards. A robot that has fallen,
    or whose paw is down, raises ``TrialFailed``.
    """
    leg = SIDES[side]
    while robot.plant.p_world_feet[leg, 2] <= RAISED:
        yield
    start = robot.plant.time + SETTLE_TIME
    for index, direction in enumerate(directions):
        begin = start + index * slap.cycle
        yield from _until(robot, begin)
        place = robot.plant.p_world_feet[leg]
        robot.push(slap.force * np.array(DIRECTIONS[direction]), slap.duration, leg.foot)
        yield from _until(robot, begin + slap.duration + RETURN_TIME)
        paw, fall = robot.plant.p_world_feet[leg], robot.truth.fall()
        if fall is not None or paw[2] < RAISED:
            raise TrialFailed(fall or f"the paw is at {paw[2]:.2f} m two seconds later")
        found[direction] = 1000.0 * float(np.linalg.norm(paw - place))


def _until(robot: TrialRobot, time: float) -> Iterator[None]:
    while robot.plant.time < time:
        yield


STUDY = Study("slaps", tuple(metric for slap in SLAPS for metric in slap.metrics), measure)
