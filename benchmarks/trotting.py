"""Trotting: how well it follows a velocity, within which limits, and what pushes it survives."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from benchmarks.ground_truth import Track
from benchmarks.pushes import PUSH_TIME, Heading, force_of, measure_rungs, push_rows
from benchmarks.rows import Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Supply, Trial
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.model import RobotModel

START_TIME = 1.5
"""Time [s] after a command that is left out: the ramp to 1 m/s takes 0.7 s, settling the rest."""
WINDOW = 20.0
"""Time [s] over which the velocity is compared with the command."""
PHASES = 8
"""Instants of the stride, evenly spread, at which the trotting robot is pushed."""
PUSHED_SPEED = 0.5
"""m/s"""
RECOVERY_TIME = 2.0
"""Time [s] after a push within which the robot must be trotting again."""
SPEED_TOLERANCE = 0.15
"""Error [m/s] of the mean over the last two strides that still counts as trotting again."""

FORWARD: dict[str, tuple[float, float]] = {
    "0.3": (0.3, 0.01),
    "0.5": (0.5, 0.015),
    "1.0": (1.0, 0.025),
}
"""By name: forward speed [m/s] and bar of its mean absolute error [m/s]."""


def _forward_rows(name: str, speed: float, error_bar: float) -> tuple[Row, ...]:
    item = f"trot {speed:.1f} m/s, 20 s"
    return (
        Row(f"trot.mean_{name}", item, "mean velocity error", "%", 1.0),
        Row(f"trot.mae_{name}", item, "mean absolute error", "m/s", error_bar),
    )


TROT_ROWS = (
    *(row for name, (v, bar) in FORWARD.items() for row in _forward_rows(name, v, bar)),
    Row("trot.torque", "trot 1.0 m/s, limits", "peak torque / limit", "", 1.0),
    Row("trot.joint_speed", "trot 1.0 m/s, limits", "peak joint speed / limit", "", 1.0),
    Row("trot.mean_lateral", "trot sideways 0.5 m/s, 20 s", "mean velocity error", "%", 2.0),
    Row("trot.mean_yaw", "trot turning 1 rad/s, 20 s", "mean yaw rate error", "%", 2.0),
)
PUSH_ROWS = push_rows("trot.push", "trot 0.5 m/s, push 0.1 s, 8 phases", lateral=18.0, forward=24.0)


def measure_trot(trial: Trial) -> Measurement:
    """Follow five velocity commands, each with a robot of its own.

    - velocity: of MuJoCo's CoM in the heading frame, every tick of 20 s, from 1.5 s after the
      command on;
    - mean velocity error: |mean - command| / |command|;
    - mean absolute error: mean of |velocity - command| over the ticks, in the direction of the
      command, oscillation within the stride included;
    - mean yaw rate error: from the heading (unwrapped) at both ends of the window;
    - limits: largest |tau| / limit and |joint velocity| / limit of any joint, start included.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    commands = {name: VelocityCommand(speed) for name, (speed, _) in FORWARD.items()}
    commands |= {"lateral": VelocityCommand(0.0, 0.5), "yaw": VelocityCommand(0.0, 0.0, 1.0)}
    for name, command in commands.items():
        try:
            track = _trot(trial, command)
        except Failed as failed:
            failures |= {row: str(failed) for row in _rows_of(name)}
        else:
            values |= _figures(name, command, track)
    return Measurement(values, failures)


def _trot(trial: Trial, command: VelocityCommand) -> Track:
    with Subject(trial) as robot:
        _start(robot, command)
        robot.truth.clear()
        robot.wait(START_TIME + WINDOW)
        return robot.truth.track()


def _start(robot: Subject, command: VelocityCommand) -> None:
    robot.require(robot.go2.stand())
    robot.require(robot.go2.walk())
    robot.go2.move(command.linear_x, command.angular_z, linear_y=command.linear_y)


def _rows_of(name: str) -> list[str]:
    rows = [row.name for row in TROT_ROWS if row.name.endswith(f"_{name}")]
    return [*rows, "trot.torque", "trot.joint_speed"] if name == "1.0" else rows


def _figures(name: str, command: VelocityCommand, track: Track) -> Mapping[str, float]:
    window = track.since(track.time[0] + START_TIME)
    if name == "yaw":
        rate = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        return {"trot.mean_yaw": 100.0 * abs(rate - command.angular_z) / command.angular_z}
    axis, wanted = (1, command.linear_y) if name == "lateral" else (0, command.linear_x)
    error = window.com_velocity[:, axis] - wanted
    values = {f"trot.mean_{name}": 100.0 * abs(float(error.mean())) / wanted}
    if name in FORWARD:
        values[f"trot.mae_{name}"] = float(np.abs(error).mean())
    if name == "1.0":
        model = RobotModel()
        values["trot.torque"] = float((np.abs(track.tau) / model.torque_limits).max())
        values["trot.joint_speed"] = float((np.abs(track.v[:, 6:]) / model.speed_limits).max())
    return values


def measure_pushes(trial: Trial) -> Measurement:
    """Largest impulse on the base that is survived at every phase, in the row's directions.

    The phases are eight instants of the stride, evenly spread. Survived is: 2 s later the robot is
    upright, and its mean velocity over the last two strides is within 0.15 m/s of the command.
    """
    trial = Trial(trial.seed, has_nominal_friction=True)
    with Supply(trial, _start_pushed) as supply:

        def fault_of(impulse: float, direction: Heading) -> str | None:
            lost = []
            for phase in range(PHASES):
                try:
                    _push_trotting(supply.robot(), force_of(impulse, direction), phase)
                except Failed as failed:
                    lost.append(f"phase {phase}: {failed}")
                    supply.drop()
            return "; ".join(lost) or None

        return measure_rungs(PUSH_ROWS, fault_of)


def _start_pushed(robot: Subject) -> None:
    _start(robot, VelocityCommand(PUSHED_SPEED))
    robot.truth.clear()
    robot.wait(START_TIME)


def _push_trotting(robot: Subject, force: np.ndarray, phase: int) -> None:
    period = GAITS["trot"].period
    # The gait's clock started with the command, when the track was cleared.
    elapsed = robot.plant.time - robot.truth.start
    phase_time = phase * period / PHASES
    target = phase_time + math.ceil((elapsed - phase_time) / period) * period
    robot.wait(max(target - elapsed, 0.0))
    robot.push(force, PUSH_TIME)
    robot.wait(RECOVERY_TIME)
    track = robot.truth.track().since(robot.plant.time - 2.0 * period)
    speed = float(track.com_velocity[:, 0].mean())
    if abs(speed - PUSHED_SPEED) > SPEED_TOLERANCE:
        raise Failed(f"walks at {speed:.2f} m/s two seconds after the push")


TROT = Family("trot", TROT_ROWS, measure_trot)
PUSHES = Family("trot-pushes", tuple(item.row for item in PUSH_ROWS), measure_pushes)
