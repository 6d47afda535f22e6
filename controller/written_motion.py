"""How far the simulated robot was from its plan, and from what was written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant.mujoco.ground_truth import TruthRecording, true_runs
from go2_wbc.records import layout_of
from go2_wbc.reference import STANCE, Anchor, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.batch_kinematics import attitudes
from motions.dynamics.phases import PhaseProblem
from motions.feasibility.goal_errors import misses_of
from motions.plan.compiled_plan import CompiledPlan
from motions.plan.dynamic_span import DynamicSpan

STRIDE = 5
"""Every fifth tick is compared with what was written."""
LANDED = 0.1
"""Time [s] after a touchdown at which the place of a foot counts: it has its load by then."""


def placed(plan: MotionPlan, times: Float[np.ndarray, " m"], anchor: Anchor) -> np.ndarray:
    """The targets (m,) of ``plan`` at ``times`` [s], as ``plan.at(t).placed(anchor)`` has each.

    That is a structured array: fields ``legs``, ``p_world``, ``R_world_base``, ``p_world_feet`` and
    ``q_joints`` of ``Target`` are those of a motion that began at ``anchor``.
    """
    R, layout = yaw_rotation(anchor.yaw), layout_of(Target)
    rows = np.empty((len(times), layout.size))
    for k, t in enumerate(times.tolist()):
        rows[k] = plan.row_at(t)
    asked = rows.view(layout.dtype)[:, 0]
    asked["p_world"] = anchor.p_world + asked["p_world"] @ R.T
    asked["R_world_base"] = R @ asked["R_world_base"]
    asked["p_world_feet"] = anchor.p_world + asked["p_world_feet"] @ R.T
    return asked


def trunk_off(asked: np.ndarray, truth: TruthRecording) -> Float[np.ndarray, " m"]:
    """Distances [m] of the tracked point from its place in ``placed`` targets of the same times."""
    point = np.where(asked["is_com"][:, None] != 0.0, truth.p_world_com, truth.q[:, :3])
    return np.linalg.norm(point - asked["p_world"], axis=1)


def turned_off(asked: np.ndarray, truth: TruthRecording) -> Float[np.ndarray, " m"]:
    """Angles [rad] between the trunk's orientation and the planned one, 0 to pi."""
    turn = asked["R_world_base"] @ attitudes(truth.rpy).transpose(0, 2, 1)
    pairs = ((2, 1), (0, 2), (1, 0))
    twice_sine = np.linalg.norm([turn[:, i, j] - turn[:, j, i] for i, j in pairs], axis=0)
    return np.arctan2(twice_sine, turn.trace(axis1=1, axis2=2) - 1.0)


def off_written(
    recorded: TruthRecording, plan: MotionPlan, model: RobotModel
) -> Float[np.ndarray, "4"]:
    """Largest deviations of the recording of a played ``plan`` from what was written.

    They are those of the tracked point of the trunk [m], of its attitude [rad], of a foot in the
    air, and of one that came down, in the world [m].

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
            found = np.maximum(found, _off_asked(recorded, span, anchor, model))
    return found


def _off_curves(
    recorded: TruthRecording, plan: MotionPlan, anchor: Anchor, solved: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, "4"]:
    """Trunk and feet against the plan's curves, where no part is solved."""
    rows = np.flatnonzero(~solved[::STRIDE]) * STRIDE
    truth = recorded.part(rows)
    asked = placed(plan, truth.time - recorded.time[0], anchor)
    trunk, turned = trunk_off(asked, truth), turned_off(asked, truth)
    stance = asked["legs"] == STANCE
    feet = np.linalg.norm(truth.p_world_feet - asked["p_world_feet"], axis=2)
    in_air, landed = feet[~stance].max(initial=0.0), _landed_off(truth.time, stance, feet)
    return np.array([trunk.max(initial=0.0), turned.max(initial=0.0), in_air, landed])


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
) -> Float[np.ndarray, "4"]:
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
    away, turned = np.nan_to_num(found.away), np.nan_to_num(found.turned)
    feet = away[:, 1:]
    in_air, landed = (feet[which].max(initial=0.0) for which in (~lands, lands))
    return np.array([away[:, 0].max(), turned.max(), in_air, landed])


def _landings(asked: PhaseProblem) -> Bool[np.ndarray, "k 4"]:
    """Which feet come down at the end of each phase."""
    stands = np.array([[leg in phase.stance for leg in LEGS] for phase in asked.phases])
    return ~stands & np.vstack([stands[1:], stands[-1:]])
