"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds.

Here: standing up, reaching a goal and the demo. The other rows have files of their own; how a
velocity is followed is in ``locomotion``, what pushes are survived in ``balance``.
"""

import math
import time

import numpy as np

from benchmarks import high_five, library
from benchmarks.command import Benchmark
from benchmarks.high_five import highest_window
from benchmarks.robots import standing_failure, way_between
from benchmarks.study import Study, TrialResult
from controller.demo.steps import DemoProgress, run_demo
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle
from go2_wbc.robot.state import RobotState

STAND = (
    ("time", "time", "<= 3 s"),
    ("torque", "peak torque / limit", "<= 0.4"),
    ("height", "final CoM height off", "<= 5 mm"),
    ("tilt", "final tilt", "deg"),
)
DISTANCE, ANGLE = 1.0, math.pi / 2  # m, rad
GOALS = {
    "move_forward(1.0)": (
        ("miss", "distance from the goal", "<= 20 mm"),
        ("heading", "heading error", "<= 1 deg"),
    ),
    "turn_left(pi/2)": (("turn", "angle error", "<= 1.5 deg"), ("drift", "base moved by", "mm")),
}

DEMO = {
    "whole demo sequence": (
        ("done", "share of seeds done", ">= 1"),
        ("untrue", "True that does not hold", "<= 0"),
    ),
    "whole run headless": (("pace", "real-time factor, CPU", ">= 2.5"),),
}
SIT_PITCH = math.radians(-25.0)
"""Pitch of the trunk of a sitting robot: at least this much nose up."""
SIT_REAR_HEIGHT = 0.16
"""Height [m] below which the rear end of the trunk is down; it is at 0.29 m when standing."""
REAR_END = -0.1934  # m; the rear hips in the base frame, by the URDF
FORWARD_WAY = (0.30, 0.44)  # Way [m] of two seconds at 0.2 m/s, from rest
FORWARD_ASIDE = 0.05
STOP_SPEED = 0.05  # m/s
TURN = (math.pi / 2, math.radians(2.0))
PAW_HEIGHT, PAW_TIME = 0.60, 1.9
"""Height [m] that the paw keeps, and for how long [s]: the hold without its edges."""
PAW_SUPPORT = 5.0  # N on every other foot meanwhile


def measure_stand(trial: Trial, found: TrialResult) -> None:
    """Stand up from lying; values are of plant time, and of MuJoCo's CoM when ``stand()`` ends."""
    with TrialRobot(trial) as robot:
        start = robot.plant.time
        robot.require(robot.go2.stand())
        recorded = robot.truth.recording()
        off = float(recorded.p_world_com[-1, 2]) - find_profile().stand_height
        found.values = {
            "time": robot.plant.time - start,
            "torque": float(recorded.torque_shares(RobotModel()).max()),
            "height": 1000.0 * abs(off),
            "tilt": math.degrees(robot.plant.truth().tilt),
        }
        if failure := standing_failure(robot):
            found.failures["height"] = failure


def measure_goals(trial: Trial, found: TrialResult) -> None:
    """Stand, walk one metre, turn a quarter to the left; errors are against before each call."""
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


def measure_demo(trial: Trial, found: TrialResult) -> None:
    """Run the demo and check every step that it calls done by this module's own criteria.

    The real-time factor is robot time over processor time of the process, from building the plant
    to closing it, imports and recording the truth excluded.
    """
    cpu_start = time.process_time()
    with TrialRobot(trial) as robot:
        check = StepCheck(robot)
        report = run_demo(robot.go2, check)
        robot_time, recording_time = robot.plant.time, robot.truth.cpu_time
    cpu_time = time.process_time() - cpu_start - recording_time
    found.values = {
        "done": float(report.ok),
        "untrue": float(len(check.untrue)),
        "pace": robot_time / cpu_time,
    }
    undone = [f"{step.name}: {step.reason}" for step in report.steps if not step.ok]
    failures = {"done": "; ".join(undone), "untrue": "; ".join(check.untrue)}
    found.failures = {name: why for name, why in failures.items() if why}


class StepCheck:
    """Reads the robot's state when a step begins and ends, and what was recorded in between.

    Attributes:
        untrue: steps that were called done although they were not, with the reason.
    """

    def __init__(self, robot: TrialRobot) -> None:
        self._robot, self._before = robot, robot.plant.truth()
        self.untrue: list[str] = []

    def __call__(self, progress: DemoProgress) -> None:
        """Take note of a step's begin, or check its end."""
        if (result := progress.result) is None:
            self._before = self._robot.plant.truth()
            self._robot.truth.clear()
        elif result.ok:
            failure = self._robot.truth.fall() if "sit" not in result.name else None
            failure = failure or failure_of(result.name, self._robot, self._before)
            if failure is not None:
                self.untrue.append(f"{result.name}: {failure}")


def failure_of(step: str, robot: TrialRobot, before: RobotState) -> str | None:
    """What is missing for a step to be true, by its name; every step of the demo must have one."""
    state = robot.plant.truth()
    ahead, left, turned = way_between(before, state)
    match step:
        case "stand" | "walk":
            return standing_failure(robot)
        case "sit" | "sit_again":
            pitch, rear = float(state.rpy[1]), state.q[2] + REAR_END * state.R_world_base[2, 0]
            if pitch > SIT_PITCH:
                return f"pitch {math.degrees(pitch):.0f} deg"
            return f"rear end at {rear:.2f} m" if rear > SIT_REAR_HEIGHT else None
        case "forward":
            is_there = FORWARD_WAY[0] <= ahead <= FORWARD_WAY[1] and abs(left) <= FORWARD_ASIDE
            return None if is_there else f"went {ahead:.3f} m ahead and {left:.3f} m aside"
        case "turn":
            asked, tolerance = TURN
            is_there = abs(wrap_angle(turned - asked)) <= tolerance
            return None if is_there else f"turned {math.degrees(turned):.1f} deg"
        case "stop":
            speed = float(np.linalg.norm(robot.truth.recording().com_velocity[-1, :2]))
            return f"moves at {speed:.2f} m/s" if speed > STOP_SPEED else standing_failure(robot)
        case "high_five":
            return _paw_failure(robot) or standing_failure(robot)
    raise KeyError(step)


def _paw_failure(robot: TrialRobot) -> str | None:
    recorded, leg = robot.truth.recording(), Leg.FR
    ticks = round(PAW_TIME / robot.plant.control_period)
    try:
        held = recorded.part(highest_window(recorded.p_world_feet[:, leg, 2], ticks))
    except TrialFailed as failed:
        return str(failed)
    height = float(held.p_world_feet[:, leg, 2].min())
    if height < PAW_HEIGHT:
        return f"paw held at {height:.3f} m"
    load = float(held.foot_forces[:, [other for other in LEGS if other is not leg]].min())
    return f"a supporting foot carried {load:.1f} N only" if load < PAW_SUPPORT else None


STUDIES: tuple[Study, ...] = (
    Study("stand", {"lying -> standing": STAND}, measure_stand),
    Study("goals", GOALS, measure_goals, "goal"),
    high_five.HELD,
    high_five.IMPACTS,
    library.ON_TRUTH,
    Study("sequence", DEMO, measure_demo, "demo", seed_factor=5),
)
BENCHMARK = Benchmark(
    "behaviour",
    "Stand, goals, high five, slaps, the motions and the whole demo\n"
    "in MuJoCo, with friction, mass, heading and joint angles drawn by each seed.\n"
    "The demo takes 5 times the seeds.",
    STUDIES,
    takes="7 minutes, two cores",
    examples=(
        "--rows stand goals --jobs 4",
        "--json --out behaviour.json",
        "--sensors imu --seeds 4",
    ),
    sensors=True,
)
run = BENCHMARK.run
