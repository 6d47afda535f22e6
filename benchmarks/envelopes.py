"""``python -m benchmarks envelopes``: how fast each gait follows, ahead, back, aside and turning.

A speed is held if under every seed the robot does not fall, follows within ``ERROR`` on the mean of
the window, keeps every joint's speed limit, and has some motor at its limit (of the torque-speed
line) in ``SATURATED`` of the ticks at most. The greatest is bisected between 0 and ``MOST``, with
the planner's default numbers.
``--store`` writes what ``go2_wbc.planning.envelopes`` reads: the seeds are those of tuning, not
those that ``benchmarks.locomotion`` judges by.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np

from benchmarks.command import FOLDER, Jobs, Output, RowsFile, run_sweep
from benchmarks.robots import UNTOLD, plant_of
from controller.motion_measurement import FULL
from controller.sweeps.sweep_file import Row
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.files import write_atomically
from go2_wbc.planning.command import VelocityEnvelope
from go2_wbc.planning.envelopes import FILE
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel

FIRST_SEED = 5200  #: Of those that measure an envelope; nothing is judged by them
SEEDS = 4
ERROR, SATURATED = 0.05, 0.05  # Share of the command, and of the ticks
LEAST_ERROR = 0.02  #: m/s, rad/s; an error below it is none, however slow the command
LEAD, WINDOW = 1.0, 2.0  #: Time [s] after the ramp that is left out, and that is measured
MOST = {"forward": 4.0, "backward": 3.0, "lateral": 2.0, "turning": 7.0}  # m/s, rad/s
WAYS = dict(zip(MOST, np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1.0]]), strict=True))
"""Ahead, to the left, turning to the left."""
STEPS = 6  # Halvings: a bound is exact to a 64th of ``MOST``
ITEMS = tuple(product(GAITS, MOST))
CONFIG = Config(envelope=VelocityEnvelope(forward=1e3, backward=1e3, lateral=1e3, turning=1e3))


def run(
    *,
    store: Annotated[bool, "store them in the package"] = False,
    rows: RowsFile = FOLDER / "envelopes.sqlite",
    jobs: Jobs = 1,
    output: Output,
) -> int:
    """The greatest speed of each gait, ahead, back, aside and turning.

    Inside the limits of torque and joint speed and without a fall, by bisection.

    Examples:
    python -m benchmarks envelopes           measure and print; ten minutes
    python -m benchmarks envelopes --store   also store them in the package
    """
    result = run_sweep(trial, len(ITEMS), rows, jobs)
    bounds = collected(result.rows)
    is_whole = not result.failures and all(len(b) == len(MOST) for b in bounds.values())
    if store and is_whole:
        write(bounds)
    return output.publish({"passed": is_whole, "envelopes": bounds}, render(bounds))


def trial(seed: int) -> Row:
    """The bound of the gait and direction that the seed stands for."""
    gait, axis = ITEMS[seed]
    low, high = 0.0, MOST[axis]
    for _ in range(STEPS):
        middle = (low + high) / 2
        if all(holds(gait, axis, middle, n) for n in range(SEEDS)):
            low = middle
        else:
            high = middle
    return {"gait": gait, "axis": axis, "bound": low}


def holds(gait: str, axis: str, speed: float, seed: int) -> bool:
    """Whether a robot under the conditions of ``seed`` follows that speed; see the module."""
    x, y, turn = speed * WAYS[axis]
    unbounded = replace(GAITS[gait], name=f"{gait}, unbounded")
    rate = CONFIG.locomotion.angular_acceleration if turn else CONFIG.locomotion.linear_acceleration
    try:
        with TrialRobot(plant_of(Trial(seed), FIRST_SEED, UNTOLD), CONFIG) as robot:
            robot.require(robot.go2.walk(unbounded))
            robot.go2.move(float(x), float(turn), linear_y=float(y))
            robot.wait(speed / rate + LEAD)
            robot.truth.clear()
            robot.wait(WINDOW)
            return is_held(robot.truth.recording(), axis, speed)
    except TrialFailed:
        return False


def is_held(window: TruthRecording, axis: str, speed: float) -> bool:
    """Whether a recording shows that the speed was followed inside the limits."""
    model = RobotModel()
    turning = (window.rpy[-1, 2] - window.rpy[0, 2]) / np.ptp(window.time)
    reached = float(WAYS[axis] @ [*window.com_velocity.mean(axis=0)[:2], turning])
    saturated = float((window.torque_shares(model) >= FULL).mean())
    is_inside = saturated <= SATURATED and window.peak_speed_share(model) <= 1.0
    return is_inside and abs(reached - speed) <= max(ERROR * speed, LEAST_ERROR)


def collected(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """The bounds by gait and direction."""
    bounds: dict[str, dict[str, float]] = {gait: {} for gait in GAITS}
    for row in rows:
        bounds[str(row["gait"])][str(row["axis"])] = round(float(row["bound"]), 4)
    return bounds


def write(bounds: dict[str, dict[str, float]], file: Path = FILE) -> None:
    """Write the bounds where the package looks for them."""
    about = {"measured_by": "python -m benchmarks envelopes --store", "seeds": SEEDS}
    text = json.dumps({"about": about, "gaits": bounds}, indent=1)
    write_atomically(file, (text + "\n").encode())


def render(bounds: dict[str, dict[str, float]]) -> str:
    """The table, at most 80 columns wide."""
    rows = {gait: [f"{v[a]:.2f}" if a in v else "?" for a in MOST] for gait, v in bounds.items()}
    lines = [f"{gait:<14}{''.join(map('{:>16}'.format, row))}" for gait, row in rows.items()]
    head = f"{'gait':<14}{''.join(map('{:>16}'.format, MOST))}"
    return "\n".join([head, "-" * 78, *lines, "m/s; turning in rad/s"])
