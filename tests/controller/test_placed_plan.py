"""A plan at many instants is what it is at each of them, and its distances are those of one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controller.placed_plan import PlacedPlan
from go2_wbc.curves import Curve
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.reference import Anchor, LegTask, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from motions import Timeline, compile_timeline, deg
from motions.postures import PosturePlan
from tests.go2_wbc.plant.helpers import empty_recording

ROUNDING = 1e-12
WHERE = Anchor(np.array([0.3, -0.2, 0.01]), 0.7)


def plans() -> list[MotionPlan]:
    """Of the CoM with a paw that is raised, and of the base with four feet on the ground."""
    line = Timeline(name="raise").body(pitch=deg(8), over=0.4).foot("FR", z=0.06, over=0.5)
    way = Curve((0.0, 1.0), (np.zeros(6), np.array([0.02, 0.01, 0.28, 0.1, -0.2, 0.3])))
    lift = PosturePlan("lift", Posture.LIE, Posture.STAND, TrackedPoint.BASE, way)
    return [compile_timeline(line.home(over=0.5), RobotModel()), lift]


def recording(times: np.ndarray) -> TruthRecording:
    """A robot that is anywhere."""
    rng, n = np.random.default_rng(5), len(times)
    return replace(
        empty_recording(n, np.zeros((n, 4, 3))),
        time=times,
        q=rng.normal(size=(n, 19)),
        rpy=rng.uniform(-3.0, 3.0, size=(n, 3)),
        p_world_com=rng.normal(size=(n, 3)),
    )


@pytest.mark.parametrize("plan", plans(), ids=lambda plan: plan.name)
def test_it_is_what_the_plan_asks_for_at_each_instant(plan: MotionPlan) -> None:
    times = np.linspace(-0.1, plan.duration + 0.1, 60)
    truth, asked = recording(times), PlacedPlan.of(plan, times, WHERE)
    trunk, turned = asked.trunk_off(truth), asked.turned_off(truth)
    for k, t in enumerate(times.tolist()):
        reference = plan.at(t).placed(WHERE)
        body, legs = reference.body, [LegTask(int(task)) for task in asked.tasks[k]]
        assert legs == [reference.legs[leg] for leg in LEGS]
        assert (asked.does(LegTask.STANCE)[k] == reference.stance).all()
        np.testing.assert_allclose(asked.p_world_feet[k], reference.p_world_feet, atol=ROUNDING)
        np.testing.assert_array_equal(asked.q_joints[k], reference.q_joints)
        point = truth.p_world_com[k] if body.point is TrackedPoint.COM else truth.q[k, :3]
        turn = body.R_world_base @ rotation_from_rpy(*truth.rpy[k].tolist()).T
        assert trunk[k] == pytest.approx(np.linalg.norm(point - body.p_world), abs=ROUNDING)
        assert turned[k] == pytest.approx(np.linalg.norm(log_rotation(turn)), abs=1e-9)
    assert asked.does(LegTask.JOINTS).any() or plan.name == "lift"
