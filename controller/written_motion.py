"""How far the simulated robot was from what was written: trunk, raised feet, landed feet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from controller.placed_plan import PlacedPlan
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant.mujoco.ground_truth import TruthRecording, true_runs
from go2_wbc.reference import Anchor, LegTask
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.dynamics.phases import PhaseProblem
from motions.feasibility.goal_errors import misses_of
from motions.plan.compiled_plan import CompiledPlan
from motions.plan.dynamic_span import DynamicSpan

STRIDE = 5
"""Every fifth tick is compared with what was written."""
LANDED = 0.1
"""Time [s] after a touchdown at which the place of a foot counts: it has its load by then."""


@dataclass(frozen=True, slots=True)
class OffWritten:
    """Largest deviations from what was written, in MuJoCo's truth.

    Attributes:
        trunk_off: of the tracked point of the trunk [m].
        turned_off: of its attitude [rad].
        paw_off: of a foot in the air, in the world [m].
        landed_off: of a foot that came down, in the world [m].
    """

    trunk_off: float
    turned_off: float
    paw_off: float
    landed_off: float

    def joined(self, other: OffWritten) -> OffWritten:
        """The larger one of each."""
        pairs = ((getattr(self, n), getattr(other, n)) for n in OffWritten.__slots__)
        return OffWritten(*(max(pair) for pair in pairs))


def off_written(recorded: TruthRecording, plan: MotionPlan, model: RobotModel) -> OffWritten:
    """What the recording of a played ``plan`` misses.

    Parts that follow curves are compared with these in every ``STRIDE``-th tick; solved parts with
    what was asked of them (see ``motions.feasibility.goal_errors``): their plan is only one answer.
    """
    anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), model.foot_radius)
    spans = plan.dynamic if isinstance(plan, CompiledPlan) else ()
    times = recorded.time - recorded.time[0]
    solved = np.zeros(len(times), dtype=bool)
    for span in spans:
        solved |= (times >= span.start) & (times < span.end)
    found = _off_curves(recorded, plan, anchor, solved)
    for span in spans:
        if span.start < times[-1]:
            found = found.joined(_off_asked(recorded, span, anchor, model))
    return found


def _off_curves(
    recorded: TruthRecording, plan: MotionPlan, anchor: Anchor, solved: Bool[np.ndarray, " n"]
) -> OffWritten:
    """Trunk and feet against the plan's curves, where no part is solved."""
    rows = np.flatnonzero(~solved[::STRIDE]) * STRIDE
    truth = recorded.part(rows)
    asked = PlacedPlan.of(plan, truth.time - recorded.time[0], anchor)
    trunk, turned = asked.trunk_off(truth), asked.turned_off(truth)
    stance = asked.does(LegTask.STANCE)
    feet = np.linalg.norm(truth.p_world_feet - asked.p_world_feet, axis=2)
    return OffWritten(
        float(trunk.max(initial=0.0)),
        float(turned.max(initial=0.0)),
        float(feet[~stance].max(initial=0.0)),
        _landed_off(truth.time, stance, feet),
    )


def _landed_off(
    times: Float[np.ndarray, " m"], stance: Bool[np.ndarray, "m 4"], off: Float[np.ndarray, "m 4"]
) -> float:
    """Largest distance [m] of a foot from its place, ``LANDED`` after it should have come down."""
    worst = 0.0
    for leg in LEGS:
        for phase in true_runs(stance[:, leg]):
            if phase.start > 0:
                settled = int(np.searchsorted(times, times[phase.start] + LANDED))
                worst = max(worst, float(off[min(settled, phase.stop - 1), leg]))
    return worst


def _off_asked(
    recorded: TruthRecording, span: DynamicSpan, anchor: Anchor, model: RobotModel
) -> OffWritten:
    """A solved part against what was asked: as its plan is judged, with the truth instead of it."""
    plan, R = span.trajectory, yaw_rotation(anchor.yaw)
    when = recorded.time[0] + span.start + plan.times
    rows = np.minimum(np.searchsorted(recorded.time, when), len(recorded.time) - 1)
    q, turn = recorded.q[rows].copy(), pin.Quaternion(R.T)
    q[:, :3] = (q[:, :3] - anchor.p_world) @ R
    q[:, 3:7] = [(turn * pin.Quaternion(xyzw)).coeffs() for xyzw in q[:, 3:7]]
    places = (recorded.p_world_feet[rows] - anchor.p_world) @ R
    found = misses_of(replace(span, trajectory=replace(plan, q=q)), places, model)
    lands = np.ones((len(found.times), 4), dtype=bool)
    if isinstance(span.asked, PhaseProblem):
        lands = _landings(span.asked)
    away = np.nan_to_num(found.away)
    feet = away[:, 1:]
    return OffWritten(
        float(away[:, 0].max()),
        float(np.nan_to_num(found.turned).max()),
        float(feet[~lands].max(initial=0.0)),
        float(feet[lands].max(initial=0.0)),
    )


def _landings(asked: PhaseProblem) -> Bool[np.ndarray, "k 4"]:
    """Which feet come down at the end of each phase."""
    stands = np.array([[leg in phase.stance for leg in LEGS] for phase in asked.phases])
    return ~stands & np.vstack([stands[1:], stands[-1:]])
