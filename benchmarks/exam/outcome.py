"""What physics makes of a motion: played in MuJoCo whatever the check says."""

from __future__ import annotations

from controller.motion_measurement import MotionMeasurement, measure_motion
from controller.sweeps.trials import TrialRobot
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import MotionPlan, Posture
from go2_wbc.robot.model import RobotModel

FRICTION = 0.5
"""Friction coefficient of the floor: the one that the check counts on."""


def play(
    plan: MotionPlan, model: RobotModel, seed: int, sensors: str = "ideal"
) -> MotionMeasurement:
    """Play a plan, unchecked, from its entry posture, on a plant of these ``sensors``.

    Raises:
        TrialFailed: if the robot does not get ready.
    """
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=seed, sensors=sensors)) as robot:
        robot.require(robot.go2.stand())
        if plan.entry is Posture.SIT:
            robot.require(robot.go2.sit())
        return measure_motion(robot.go2, robot.truth, plan, model)
