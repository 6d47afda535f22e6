"""Trotting: how well it follows a velocity, within which limits, and what pushes it survives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from benchmarks.pushes import PUSH_TIME, force_of, measure_impulses, push_metrics
from benchmarks.study import Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
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
COMMANDS = {
    "0.3": VelocityCommand(0.3),
    "0.5": VelocityCommand(0.5),
    "1.0": VelocityCommand(1.0),
    "lateral": VelocityCommand(0.0, 0.5),
    "yaw": VelocityCommand(0.0, 0.0, 1.0),
}
LIMITS = (
    Metric("trot.torque", "trot 1.0 m/s, limits", "peak torque / limit", "", 1.0),
    Metric("trot.joint_speed", "trot 1.0 m/s, limits", "peak joint speed / limit", "", 1.0),
)
TROT_METRICS = (
    Metric("trot.mean_0.3", "trot 0.3 m/s, 20 s", "mean velocity error", "%", 1.0),
    Metric("trot.mae_0.3", "trot 0.3 m/s, 20 s", "mean absolute error", "m/s", 0.01),
    Metric("trot.mean_0.5", "trot 0.5 m/s, 20 s", "mean velocity error", "%", 1.0),
    Metric("trot.mae_0.5", "trot 0.5 m/s, 20 s", "mean absolute error", "m/s", 0.015),
    Metric("trot.mean_1.0", "trot 1.0 m/s, 20 s", "mean velocity error", "%", 1.0),
    Metric("trot.mae_1.0", "trot 1.0 m/s, 20 s", "mean absolute error", "m/s", 0.025),
    *LIMITS,
    Metric("trot.mean_lateral", "trot sideways 0.5 m/s, 20 s", "mean velocity error", "%", 2.0),
    Metric("trot.mean_yaw", "trot turning 1 rad/s, 20 s", "mean yaw rate error", "%", 2.0),
)
PUSH_METRICS = push_metrics(
    "trot.push", "trot 0.5 m/s, push 0.1 s, 8 phases", lateral=18.0, forward=24.0
)


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
    for name, command in COMMANDS.items():
        try:
            with TrialRobot(trial) as robot:
                _start(robot, command)
                robot.wait(START_TIME + WINDOW)
                values |= _measured(name, robot.truth.recording())
        except TrialFailed as failed:
            metrics = [metric for metric in TROT_METRICS if metric.name.endswith(f"_{name}")]
            metrics += LIMITS if name == "1.0" else ()
            failures |= {metric.name: str(failed) for metric in metrics}
    return Measurement(values, failures)


def _start(robot: TrialRobot, command: VelocityCommand) -> None:
    robot.require(robot.go2.stand())
    robot.require(robot.go2.walk())
    robot.go2.move(command.linear_x, command.angular_z, linear_y=command.linear_y)
    robot.truth.clear()


def _measured(name: str, recorded: TruthRecording) -> dict[str, float]:
    window, command = recorded.since(recorded.time[0] + START_TIME), COMMANDS[name]
    if name == "yaw":
        rate = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        return {"trot.mean_yaw": 100.0 * abs(rate - command.angular_z) / command.angular_z}
    axis, wanted = (1, command.linear_y) if name == "lateral" else (0, command.linear_x)
    error = window.com_velocity[:, axis] - wanted
    values = {f"trot.mean_{name}": 100.0 * abs(float(error.mean())) / wanted}
    if axis == 0:
        values[f"trot.mae_{name}"] = float(np.abs(error).mean())
    if name == "1.0":
        model = RobotModel()
        values["trot.torque"] = float(recorded.torque_shares(model).max())
        values["trot.joint_speed"] = recorded.peak_speed_share(model)
    return values


def measure_pushes(trial: Trial) -> Measurement:
    """Largest impulse on the base that is survived at every phase, in a metric's directions.

    The phases are eight instants of the stride, evenly spread. Survived is: 2 s later the robot is
    upright, and its mean velocity over the last two strides is within 0.15 m/s of the command.
    """
    trial = replace(trial, has_nominal_friction=True)
    trotting: list[TrialRobot] = []  # one for many pushes; after a failure a new one

    def failure_of(impulse: float, direction: str) -> str | None:
        lost: list[str] = []
        for phase in range(PHASES):
            try:
                if not trotting:
                    trotting.append(TrialRobot(trial))
                    _start(trotting[0], VelocityCommand(PUSHED_SPEED))
                    trotting[0].wait(START_TIME)
                _push(trotting[0], force_of(impulse, direction), phase)
            except TrialFailed as failed:
                trotting.pop().close()
                lost.append(f"phase {phase}: {failed}")
        return "; ".join(lost) or None

    try:
        return measure_impulses(PUSH_METRICS, failure_of)
    finally:
        for robot in trotting:
            robot.close()


def _push(robot: TrialRobot, force: np.ndarray, phase: int) -> None:
    period = GAITS["trot"].period
    # The gait's clock started with the command, when the truth was cleared.
    elapsed = robot.plant.time - robot.truth.start
    phase_time = phase * period / PHASES
    target = phase_time + math.ceil((elapsed - phase_time) / period) * period
    robot.wait(max(target - elapsed, 0.0))
    robot.push(force, PUSH_TIME)
    robot.wait(RECOVERY_TIME)
    strides = robot.truth.recording(since=robot.plant.time - 2.0 * period)
    speed = float(strides.com_velocity[:, 0].mean())
    if abs(speed - PUSHED_SPEED) > SPEED_TOLERANCE:
        raise TrialFailed(f"walks at {speed:.2f} m/s two seconds after the push")


TROT = Study("trot", TROT_METRICS, measure_trot)
PUSHES = Study("trot-pushes", PUSH_METRICS, measure_pushes)
