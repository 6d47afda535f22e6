"""A motion as the check saw it, and the one place where all that stands for one is told apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from go2_wbc.errors import CommandError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.recording import Recording
from go2_wbc.robot.model import RobotModel
from motions.authoring import Motion
from motions.dynamics.phases import Progress
from motions.feasibility.forces import Forces
from motions.feasibility.report import FeasibilityReport
from motions.language.timeline import Timeline
from motions.language.timeline_data import NEAREST
from motions.plan.compiled_plan import LEAST_FEET, CompiledPlan
from motions.plan.timeline_compiler import Broken, compile_timeline
from motions.plan.trajectory import Trajectory
from motions.registry import load_motion
from motions.saved.plan_file import is_saved_plan, load_plan


@dataclass(frozen=True, slots=True)
class CheckedMotion:
    """A checked motion, with what the check worked out on its way.

    Attributes:
        plan: what was checked.
        report: what the check says.
        path: the movement of the whole robot, in the frame of the motion.
        forces: contact forces and torques along it.
    """

    plan: MotionPlan
    report: FeasibilityReport
    path: Trajectory
    forces: Forces

    def recording(self) -> Recording:
        """The plan in the form of a recorded run, for viewers: 100 samples a second.

        Labels are the names of the plan's holds, elsewhere the feet that are in the air.
        """
        path = self.path
        (support,) = (series for series in self.report.series if series.check == "support")
        has_area = path.stance.sum(axis=1) >= LEAST_FEET
        spans = self.plan.spans if isinstance(self.plan, CompiledPlan) else {}
        return Recording(
            time=path.times,
            q=path.q,
            v=path.v,
            tau=self.forces.tau,
            foot_forces=self.forces.contact[:, :, 2],
            stance=path.stance,
            p_world_com=path.p_com,
            support_margin=np.where(has_area, support.values[:, 0], np.nan),
            labels=tuple(
                _label(float(t), stands, spans)
                for t, stands in zip(path.times, path.stance, strict=True)
            ),
        )


Playable = str | Path | Motion | Timeline | MotionPlan | CheckedMotion
"""What stands for a motion: a name of the library, the file of a saved motion or plan, a motion
(with its default parameters), a timeline, a plan, or a motion that was checked before."""


def compile_motion(
    motion: object,
    model: RobotModel,
    *,
    mend: Broken | None = None,
    progress: Progress | None = None,
) -> MotionPlan:
    """The plan of ``motion`` on the robot ``model``; what is compiled already is not done again.

    Args:
        motion: a ``Playable``; anything else is refused.
        model: must not be that of a control loop that runs in another thread.
        mend, progress: as for ``compile_timeline``; ``mend`` is asked for timelines with
            ``physics="nearest"`` only.

    Raises:
        CommandError: for an unknown name, or for what stands for no motion.
        TimelineError: if the timeline is empty or its parameters are not valid.
        MotionFileError: for a file that cannot be used.
    """
    if isinstance(motion, CheckedMotion):
        return motion.plan
    if isinstance(motion, MotionPlan):
        return motion
    if isinstance(motion, str | Path) and is_saved_plan(motion):
        return load_plan(motion, model=model)
    line = timeline_of(motion)
    if line is None:
        raise CommandError(
            "motion must be a name of the library, a function with @motion before it, a Timeline, "
            f"a plan or a CheckedMotion, got {motion!r}"
        )
    asked = mend if line.physics == NEAREST else None
    return compile_timeline(line, model, mend=asked, progress=progress)


def timeline_of(motion: object) -> Timeline | None:
    """The timeline of ``motion``; of a plan, or of what stands for no motion, none.

    Raises:
        CommandError: for an unknown name.
    """
    if isinstance(motion, str | Path):
        return None if is_saved_plan(motion) else load_motion(motion)
    if isinstance(motion, Motion):
        return motion()
    return motion if isinstance(motion, Timeline) else None


def _label(
    time: float, stance: Bool[np.ndarray, "4"], spans: Mapping[str, tuple[float, float]]
) -> str:
    for name, (start, end) in spans.items():
        if start <= time < end:
            return name
    raised = [leg.name for leg in LEGS if not stance[leg]]
    return f"{' and '.join(raised)} up" if raised else "on four feet"
