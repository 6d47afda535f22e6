"""The one place where a name, a motion, a timeline and a plan are told apart."""

from __future__ import annotations

from go2_wbc.errors import CommandError
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions.authoring import Motion
from motions.compiler import compile_timeline
from motions.feasibility.checked_motion import CheckedMotion
from motions.registry import load_motion
from motions.timeline import Timeline

Playable = str | Motion | Timeline | MotionPlan | CheckedMotion
"""What stands for a motion: a name of the library, a motion (with its default parameters), a
timeline, a plan, or a motion that was checked before."""


def compile_motion(motion: object, model: RobotModel) -> MotionPlan:
    """The plan of ``motion`` on the robot ``model``; what is compiled already is not done again.

    Args:
        motion: a ``Playable``; anything else is refused.
        model: must not be that of a control loop that runs in another thread.

    Raises:
        CommandError: for an unknown name, or for what stands for no motion.
        TimelineError: if the timeline is empty or its parameters are not valid.
    """
    if isinstance(motion, CheckedMotion):
        return motion.plan
    if isinstance(motion, MotionPlan):
        return motion
    if isinstance(motion, str):
        motion = load_motion(motion)
    elif isinstance(motion, Motion):
        motion = motion()
    if not isinstance(motion, Timeline):
        raise CommandError(
            "motion must be a name of the library, a function with @motion before it, a Timeline, "
            f"a plan or a CheckedMotion, got {motion!r}"
        )
    return compile_timeline(motion, model)
