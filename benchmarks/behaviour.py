"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds.

Here: standing up, following a velocity, reaching a goal. The other rows have files of their own.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from benchmarks import demo_sequence, high_five, library, model, pushes
from benchmarks.command import Benchmark
from benchmarks.robots import standing_failure, way_between
from benchmarks.study import Rows, Study, TrialResult
from controller.sweeps.studies import set_off
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.profile import find_profile
from go2_wbc.robot.rotations import wrap_angle

STAND = (
    ("time", "time", "<= 3 s"),
    ("torque", "peak torque / limit", "<= 0.4"),
    ("height", "final CoM height off", "<= 5 mm"),
    ("tilt", "final tilt", "deg"),
)
START_TIME, WINDOW = 1.5, 20.0
"""Time [s] after a command that is left out, where the ramp takes 0.7 s, and that is measured."""
MEAN, MAE = "mean velocity error", "mean absolute error"
TROTS: dict[str, tuple[VelocityCommand, dict[str, Rows]]] = {
    "0.3": (
        VelocityCommand(0.3),
        {"trot 0.3 m/s, 20 s": (("mean_0.3", MEAN, "<= 1 %"), ("mae_0.3", MAE, "<= 0.01 m/s"))},
    ),
    "0.5": (
        VelocityCommand(0.5),
        {"trot 0.5 m/s, 20 s": (("mean_0.5", MEAN, "<= 1 %"), ("mae_0.5", MAE, "<= 0.015 m/s"))},
    ),
    "1.0": (
        VelocityCommand(1.0),
        {
            "trot 1.0 m/s, 20 s": (("mean_1.0", MEAN, "<= 1 %"), ("mae_1.0", MAE, "<= 0.025 m/s")),
            "trot 1.0 m/s, limits": (
                ("torque", "peak torque / limit", "<= 1"),
                ("joint_speed", "peak joint speed / limit", "<= 1"),
            ),
        },
    ),
    "lateral": (
        VelocityCommand(0.0, 0.5),
        {"trot sideways 0.5 m/s, 20 s": (("mean_lateral", MEAN, "<= 2 %"),)},
    ),
    "yaw": (
        VelocityCommand(0.0, 0.0, 1.0),
        {"trot turning 1 rad/s, 20 s": (("mean_yaw", "mean yaw rate error", "<= 2 %"),)},
    ),
}
"""What is followed, and asked of it."""
DISTANCE, ANGLE = 1.0, math.pi / 2  # m, rad
GOALS = {
    "move_forward(1.0)": (
        ("miss", "distance from the goal", "<= 20 mm"),
        ("heading", "heading error", "<= 1 deg"),
    ),
    "turn_left(pi/2)": (("turn", "angle error", "<= 1.5 deg"), ("drift", "base moved by", "mm")),
}


def measure_stand(trial: Trial, found: TrialResult) -> None:
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
        found.values = {
            "time": robot.plant.time - start,
            "torque": float(recorded.torque_shares(RobotModel()).max()),
            "height": 1000.0
            * abs(float(recorded.p_world_com[-1, 2]) - find_profile().stand_height),
            "tilt": math.degrees(robot.plant.truth().tilt),
        }
        if failure := standing_failure(robot):
            found.failures["height"] = failure


def measure_trot(trial: Trial, found: TrialResult, name: str) -> None:
    """Follow a velocity.

    - velocity: of MuJoCo's CoM in the heading frame, every tick of 20 s, from 1.5 s after the
      command on;
    - mean velocity error: |mean - command| / |command|;
    - mean absolute error: mean of |velocity - command| over the ticks, in the direction of the
      command, oscillation within the stride included;
    - mean yaw rate error: from the heading (unwrapped) at both ends of the window;
    - limits: largest |tau| / limit and |joint velocity| / limit of any joint, start included.
    """
    with TrialRobot(trial) as robot:
        set_off(robot, "trot", TROTS[name][0])
        robot.wait(START_TIME + WINDOW)
        found.values = _measured(name, robot.truth.recording())


def _measured(name: str, recorded: TruthRecording) -> dict[str, float]:
    window, command = recorded.since(recorded.time[0] + START_TIME), TROTS[name][0]
    if name == "yaw":
        rate = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        return {"mean_yaw": 100.0 * abs(rate - command.angular_z) / command.angular_z}
    axis, wanted = (1, command.linear_y) if name == "lateral" else (0, command.linear_x)
    error = window.com_velocity[:, axis] - wanted
    values = {f"mean_{name}": 100.0 * abs(float(error.mean())) / wanted}
    if axis == 0:
        values[f"mae_{name}"] = float(np.abs(error).mean())
    if name == "1.0":
        values["torque"] = float(recorded.torque_shares(RobotModel()).max())
        values["joint_speed"] = recorded.peak_speed_share(RobotModel())
    return values


def measure_goals(trial: Trial, found: TrialResult) -> None:
    """Stand, walk one metre, turn a quarter to the left.

    - distance from the goal: of the base, in the plane, from the point one metre ahead of where it
      was, along its heading then;
    - heading and angle errors: of the base's yaw, against before the call.
    """
    with TrialRobot(trial) as robot:
        robot.require(robot.go2.stand())
        start = robot.plant.truth()
        robot.require(robot.go2.move_forward(DISTANCE))
        there = robot.plant.truth()
        x, y, turned = way_between(start, there)
        found.values["miss"] = 1000.0 * math.hypot(x - DISTANCE, y)
        found.values["heading"] = math.degrees(abs(turned))
        robot.require(robot.go2.turn_left(ANGLE))
        x, y, turned = way_between(there, robot.plant.truth())
        found.values["turn"] = math.degrees(abs(wrap_angle(turned - ANGLE)))
        found.values["drift"] = 1000.0 * math.hypot(x, y)


STUDIES: tuple[Study, ...] = (
    model.AGREEMENT,
    model.SOLUTIONS,
    Study("stand", {"lying -> standing": STAND}, measure_stand),
    pushes.STAND_PUSHES,
    *(
        Study(f"trot-{name}", table, partial(measure_trot, name=name), "trot", group="trot")
        for name, (_, table) in TROTS.items()
    ),
    pushes.TROT_PUSHES,
    Study("goals", GOALS, measure_goals, "goal"),
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
