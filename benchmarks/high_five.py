"""The high five: how high, how steady, how far from every limit; and what hits the held paw."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.robots import DIRECTIONS, standing_failure
from benchmarks.study import Study, TrialResult
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.geometry import moving_support_margins
from go2_wbc.legs import LEGS, SIDES, Leg
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.recording import true_runs
from go2_wbc.robot.model import RobotModel

HOLD = 2.0  # Time [s] for which the paw is asked to be held
HELD_TIME = 1.9
"""Length [s] of the window in which the paw's height is measured: the hold without its edges."""
HELD_ROWS = (
    ("height", "paw height held 2 s", ">= 0.6 m"),
    ("margin", "least CoM margin, held", ">= 6 cm"),
    ("margin_phase", "the same, on three legs", ">= cm"),
    ("load", "least foot load, held", ">= 25 N"),
    ("load_phase", "the same, on three legs", ">= N"),
    ("slip", "support slip at contact", "<= 2 mm"),
    ("torque", "peak torque / limit", "<= 0.4"),
    ("joints", "least joint distance, held", ">= 0.03 rad"),
    ("joints_phase", "the same, on three legs", ">= rad"),
)
RAISED = 0.5  #: Height [m] of the paw from which on it counts as raised; it is held at 0.6 m
SETTLE_TIME = 1.5  #: Time [s] from then to the first slap; the rest of the lift takes 0.3 s
RETURN_TIME = 2.0  #: Time [s] after a slap within which the paw must be back in its place
PAUSE = 0.3  # Time [s] from there to the next slap
PLACE_TOLERANCE = 30.0
"""mm; a paw this near to its place is back in the pose. Dry friction in the joints keeps a part."""


def measure_held(trial: Trial, found: TrialResult) -> None:
    """Give a high five with either paw; every value is the worse of both sides.

    On three legs is the longest time in which the raised foot touches nothing; held are the ticks
    of the 1.9 s in which its lowest point in time is highest. Slip is of a foot's material at its
    contact point (its centre moves further, because round feet roll), at any time on three legs.
    """
    sides: list[dict[str, float]] = []
    with TrialRobot(trial) as robot:
        robot.require(robot.go2.stand())
        for side, leg in SIDES.items():
            robot.truth.clear()
            robot.require(robot.go2.high_five(side, hold=HOLD))
            sides.append(_measured(robot.truth.recording(), leg))
    for name, _, bar in HELD_ROWS:
        found.values[name] = (min if bar.startswith(">=") else max)(side[name] for side in sides)


def _measured(recorded: TruthRecording, leg: Leg) -> dict[str, float]:
    on_three_legs = recorded.part(longest_run(recorded.foot_forces[:, leg] == 0.0))
    ticks = round(HELD_TIME / float(recorded.time[-1] - recorded.time[-2]))
    held = on_three_legs.part(highest_window(on_three_legs.p_world_feet[:, leg, 2], ticks))
    support = [other for other in LEGS if other is not leg]
    model = RobotModel()
    return {
        "height": float(held.p_world_feet[:, leg, 2].min()),
        "margin": 100.0 * least_margin(held, support),
        "margin_phase": 100.0 * least_margin(on_three_legs, support),
        "load": float(held.foot_forces[:, support].min()),
        "load_phase": float(on_three_legs.foot_forces[:, support].min()),
        "slip": 1000.0 * largest_slip(on_three_legs, support),
        "torque": float(on_three_legs.torque_shares(model).max()),
        "joints": held.joint_distance(model),
        "joints_phase": on_three_legs.joint_distance(model),
    }


def longest_run(flags: Bool[np.ndarray, " n"]) -> slice:
    """Where ``flags`` is true for the longest time; empty if nowhere."""
    return max(true_runs(flags), key=lambda run: run.stop - run.start, default=slice(0, 0))


def highest_window(heights: Float[np.ndarray, " n"], length: int) -> slice:
    """The ``length`` consecutive samples whose least height is greatest.

    Raises:
        TrialFailed: if there are fewer samples.
    """
    if len(heights) < length:
        raise TrialFailed(f"the paw was in the air for {len(heights)} ticks, {length} were asked")
    least = np.lib.stride_tricks.sliding_window_view(heights, length).min(axis=1)
    start = int(np.argmax(least))
    return slice(start, start + length)


def least_margin(recorded: TruthRecording, support: list[Leg]) -> float:
    """Least distance [m] of the CoM to the edges of the supporting contact points."""
    feet, com = recorded.p_world_contacts[:, support, :2], recorded.p_world_com[:, :2]
    if not np.isfinite(feet).all():
        return -math.inf  # a supporting foot left the ground
    return float(moving_support_margins(feet, com).min())


def largest_slip(recorded: TruthRecording, support: list[Leg]) -> float:
    """Largest distance [m] that the material of a supporting foot slides at its contact point."""
    steps = np.diff(recorded.time)[:, None, None] * recorded.v_world_contacts[1:, support]
    return float(np.linalg.norm(np.cumsum(steps, axis=0), axis=2).max())


@dataclass(frozen=True, slots=True)
class Impact:
    """A ``force`` [N] on the held paw for ``duration`` [s]; ``name`` begins its rows' names."""

    name: str
    item: str
    force: float
    duration: float

    @property
    def cycle(self) -> float:
        """Time [s] from one slap to the next."""
        return self.duration + RETURN_TIME + PAUSE


IMPACT_KINDS = (
    Impact("slap", "slap on the held paw, 40 N, 0.1 s", 40.0, 0.1),
    Impact("lean", "leaning on the held paw, 15 N, 1 s", 15.0, 1.0),
)


def measure_impacts(trial: Trial, found: TrialResult) -> None:
    """Slap and lean on the paw while it is held, left for even seeds and right for odd ones.

    A direction is survived by a robot that does not fall until the high five is over, and stands
    then. The call itself may say False, if the slap took the paw below its height.
    """
    trial = replace(trial, has_nominal_friction=True)
    for kind in IMPACT_KINDS:
        survived, off, said = (f"{kind.name}.{row}" for row in ("survived", "off", "said"))
        distances, lost, found.values[said] = _hit_all(trial, kind)
        found.values[survived] = float(len(DIRECTIONS) - len(lost))
        if distances:
            found.values[off] = max(distances.values())
        if lost:
            reason = "; ".join(f"{direction}: {why}" for direction, why in lost.items())
            found.failures |= {survived: reason, off: reason}


def _hit_all(trial: Trial, kind: Impact) -> tuple[dict[str, float], dict[str, str], float]:
    """Slaps from all directions; after a fall a new robot goes on with the next one.

    Returns:
        By direction the paw's distance [mm] from its place, or why it was lost; and 1 if the last
        call of ``high_five`` said True.
    """
    side = ("left", "right")[trial.seed % 2]
    found, lost, said = dict[str, float](), dict[str, str](), False
    while remaining := [d for d in DIRECTIONS if d not in lost and d not in found]:
        with TrialRobot(trial) as robot:
            before = len(found)
            ticks = _hits(robot, side, kind, remaining, found)
            robot.truth.on_tick = partial(next, ticks, None)
            try:
                robot.require(robot.go2.stand())
                said = robot.go2.high_five(side, hold=SETTLE_TIME + kind.cycle * len(remaining))
                failure = robot.truth.fall() or standing_failure(robot)
            except TrialFailed as failed:
                failure = str(failed)
            if failure is not None:
                culprit = remaining[min(len(found) - before, len(remaining) - 1)]
                lost[culprit] = f"{failure} ({robot.go2.last_outcome.reason})"
                found.pop(culprit, None)
    return found, lost, float(said)


def _hits(
    robot: TrialRobot, side: str, kind: Impact, directions: Sequence[str], found: dict[str, float]
) -> Iterator[None]:
    """Slap the paw from one direction after the other, once it is raised; one ``next`` a tick.

    Puts into ``found`` how far [mm] the paw was off its place afterwards. A robot that has fallen,
    or whose paw is down, raises ``TrialFailed``.
    """
    leg, plant = SIDES[side], robot.plant
    while plant.p_world_feet[leg, 2] <= RAISED:
        yield
    start = plant.time + SETTLE_TIME
    for index, direction in enumerate(directions):
        begin = start + index * kind.cycle
        while plant.time < begin:
            yield
        place = plant.p_world_feet[leg]
        robot.push(kind.force * np.array(DIRECTIONS[direction]), kind.duration, leg.foot)
        while plant.time < begin + kind.duration + RETURN_TIME:
            yield
        paw, fall = plant.p_world_feet[leg], robot.truth.fall()
        if fall is not None or paw[2] < RAISED:
            raise TrialFailed(fall or f"the paw is at {paw[2]:.2f} m two seconds later")
        found[direction] = 1000.0 * float(np.linalg.norm(paw - place))


HELD = Study("high-five", {"high five, either side": HELD_ROWS}, measure_held, "five")
IMPACT_ROWS = {
    kind.item: (
        (f"{kind.name}.survived", "directions survived, of 6", f">= {len(DIRECTIONS)}"),
        (f"{kind.name}.off", "paw off after 2 s", f"<= {PLACE_TOLERANCE:g} mm"),
        (f"{kind.name}.said", "high_five() said True", ""),
    )
    for kind in IMPACT_KINDS
}
IMPACTS = Study("slaps", IMPACT_ROWS, measure_impacts, "")
