"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds.

Here: standing up and reaching a goal. The other rows have files of their own; how a velocity is
followed is in ``locomotion``, what pushes are survived in ``balance``.
"""

import math

from benchmarks import demo_sequence, high_five, library
from benchmarks.command import Benchmark
from benchmarks.robots import standing_failure, way_between
from benchmarks.study import Study, TrialResult
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle

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


STUDIES: tuple[Study, ...] = (
    Study("stand", {"lying -> standing": STAND}, measure_stand),
    Study("goals", GOALS, measure_goals, "goal"),
    high_five.HELD,
    high_five.IMPACTS,
    library.ON_TRUTH,
    demo_sequence.STUDY,
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
