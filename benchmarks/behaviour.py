"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds.

Here: standing up, following a velocity, reaching a goal. The other rows have files of their own.
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks import demo_sequence, high_five, library, model, pushes
from benchmarks.command import Benchmark
from benchmarks.robots import standing_failure, way_between
from benchmarks.study import Measurement, Metric, Study
from controller.sweeps.studies import set_off
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle
from motions.postures import STAND_HEIGHT

STAND_METRICS = (
    Metric("stand.time", "lying -> standing", "time", "s", 3.0),
    Metric("stand.torque", "lying -> standing", "peak torque / limit", "", 0.4),
    Metric("stand.height", "lying -> standing", "final CoM height off", "mm", 5.0),
    Metric("stand.tilt", "lying -> standing", "final tilt", "deg", None),
)
START_TIME, WINDOW = 1.5, 20.0
"""Time [s] after a command that is left out, where the ramp takes 0.7 s, and that is measured."""
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
DISTANCE, ANGLE = 1.0, math.pi / 2
"""m, rad"""
_DRIVE, _TURN = "move_forward(1.0)", "turn_left(pi/2)"
GOAL_METRICS = (
    Metric("goal.miss", _DRIVE, "distance from the goal", "mm", 20.0),
    Metric("goal.heading", _DRIVE, "heading error", "deg", 1.0),
    Metric("goal.turn", _TURN, "angle error", "deg", 1.5),
    Metric("goal.drift", _TURN, "base moved by", "mm", None),
)


def measure_stand(trial: Trial) -> Measurement:
    """Stand up from lying.

    - time: from the call of ``stand()`` to its return, in plant time;
    - peak torque: largest |tau| / limit of any joint on the way;
    - final CoM height off: |height of MuJoCo's CoM over the floor - 0.29 m| when ``stand()``
      returns.
    """
    with TrialRobot(trial) as robot:
        start = robot.plant.time
        robot.require(robot.go2.stand())
        recorded = robot.truth.recording()
        values = {
            "stand.time": robot.plant.time - start,
            "stand.torque": float(recorded.torque_shares(RobotModel()).max()),
            "stand.height": 1000.0 * abs(float(recorded.p_world_com[-1, 2]) - STAND_HEIGHT),
            "stand.tilt": math.degrees(robot.plant.truth().tilt),
        }
        failure = standing_failure(robot)
    return Measurement(values, {} if failure is None else {"stand.height": failure})


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
                set_off(robot, "trot", command)
                robot.wait(START_TIME + WINDOW)
                values |= _measured(name, robot.truth.recording())
        except TrialFailed as failed:
            metrics = [metric for metric in TROT_METRICS if metric.name.endswith(f"_{name}")]
            metrics += LIMITS if name == "1.0" else ()
            failures |= {metric.name: str(failed) for metric in metrics}
    return Measurement(values, failures)


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


def measure_goals(trial: Trial) -> Measurement:
    """Stand, walk one metre, turn a quarter to the left.

    - distance from the goal: of the base, in the plane, from the point one metre ahead of where it
      was, along its heading then;
    - heading and angle errors: of the base's yaw, against before the call.
    """
    values: dict[str, float] = {}
    with TrialRobot(trial) as robot:
        try:
            robot.require(robot.go2.stand())
            start = robot.plant.truth()
            robot.require(robot.go2.move_forward(DISTANCE))
            there = robot.plant.truth()
            x, y, turned = way_between(start, there)
            values["goal.miss"] = 1000.0 * math.hypot(x - DISTANCE, y)
            values["goal.heading"] = math.degrees(abs(turned))
            robot.require(robot.go2.turn_left(ANGLE))
            x, y, turned = way_between(there, robot.plant.truth())
            values["goal.turn"] = math.degrees(abs(wrap_angle(turned - ANGLE)))
            values["goal.drift"] = 1000.0 * math.hypot(x, y)
        except TrialFailed as failed:
            return Measurement(values, reason=str(failed))
    return Measurement(values)


STUDIES: tuple[Study, ...] = (
    model.AGREEMENT,
    model.SOLUTIONS,
    Study("stand", STAND_METRICS, measure_stand),
    pushes.STAND_PUSHES,
    Study("trot", TROT_METRICS, measure_trot),
    pushes.TROT_PUSHES,
    Study("goals", GOAL_METRICS, measure_goals),
    high_five.HELD,
    high_five.IMPACTS,
    library.ON_TRUTH,
    demo_sequence.STUDY,
)
"""In the order of the report."""
BENCHMARK = Benchmark(
    "behaviour",
    "Stand, trot, pushes, goals, high five, slaps, the motions and the whole demo\n"
    "in MuJoCo, with friction, mass, heading and joint angles drawn by each seed.",
    STUDIES,
    takes="11 minutes, two cores",
    examples=(
        "--rows stand trot --jobs 4",
        "--json --out behaviour.json",
        "--sensors imu --seeds 4",
    ),
    more_seeds="; the demo takes 5 times N",
    sensors=True,
)
register, run = BENCHMARK.register, BENCHMARK.run
