"""A plan's feet land when they meet the ground; its time and its tempo stay what they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.legs import Leg
from go2_wbc.planning.landing import (
    EARLIEST,
    NEAR,
    PRESS_DEPTH,
    PRESS_SPEED,
    TIME_OUT,
)
from go2_wbc.planning.playback import Playback, ReadablePlayback
from go2_wbc.reference import Anchor, LegTask, Reference
from go2_wbc.robot.model import FOOT_RADIUS, RobotModel
from motions.plan.compiled_plan import CompiledPlan
from tests.engine_helpers import standing_q, state_of
from tests.stepping_plans import LANDING, LIFT_OFF, TAKE_OFF, TOUCHDOWN, hop_plan, step_plan

MODEL = RobotModel()
TICK = 0.002
STEP, HOP = step_plan(MODEL, Leg.FR, 0.05), hop_plan(MODEL, 0.1)
GROUND = float(MODEL.snapshot(state_of(standing_q())).p_world_feet[0, 2]) - FOOT_RADIUS
CORRECTION = 5e-3
"""What the steady-state correction has added before [m]."""
BOTH = pytest.mark.parametrize("kind", [Playback, ReadablePlayback])
Kind = type[Playback] | type[ReadablePlayback]


class Follower:
    """Plays a plan on a robot that always stands in the same way, but for its contacts."""

    def __init__(self, kind: Kind, plan: CompiledPlan, height: float = GROUND) -> None:
        self.plan, self.t = plan, 0.0
        self.playback = kind(Anchor(np.array([0.0, 0.0, height]), 0.0), plan.footsteps)
        self.contact, self.shift = np.ones(4, dtype=bool), np.zeros(3)

    def until(self, t: float) -> Reference:
        """Play on to ``t``; the reference of the last tick."""
        tracked = self._tick()
        while self.t < t - 1e-9:
            self.t += TICK
            tracked = self._tick()
        return tracked

    def _tick(self) -> Reference:
        q = standing_q()
        q[:3] += self.shift
        state = replace(state_of(q), feet_in_contact=self.contact.copy())
        row = self.plan.row_at(self.t)
        return self.playback.follow(row, MODEL.snapshot(state), self.t, TICK)


@BOTH
def test_a_foot_that_meets_the_ground_early_stands_from_then_on(kind: Kind) -> None:
    player = Follower(kind, STEP)
    early = LIFT_OFF + EARLIEST * (TOUCHDOWN - LIFT_OFF)
    assert player.until(early - 2 * TICK).legs[Leg.FR] is LegTask.SWING, "still lifting off"
    player.contact[:] = False
    player.until(early + 0.01)
    player.contact[:] = True
    landed = player.until(early + 0.02)
    assert landed.stance.all()
    half = player.until(early + 0.02 + STEP.ramp / 2)
    share = half.normal_force_max[Leg.FR] / half.normal_force_max[Leg.FL]
    assert share == pytest.approx(0.5, abs=0.15), "its load is ramped from when it came down"
    player.contact[Leg.FR] = False
    assert player.until(TOUCHDOWN - 0.01).stance.all(), "a foot that bounces goes on standing"


@BOTH
def test_a_late_foot_is_pressed_down_until_it_meets_the_ground(kind: Kind) -> None:
    player = Follower(kind, STEP)
    player.until(LIFT_OFF)
    player.contact[Leg.FR] = False
    late = player.until(TOUCHDOWN + 0.05)
    assert late.legs[Leg.FR] is LegTask.SWING
    assert late.normal_force_max[Leg.FR] == 0.0
    planned = STEP.at(TOUCHDOWN).p_world_feet[Leg.FR] + [0.0, 0.0, GROUND]
    below = planned - late.p_world_feet[Leg.FR]
    np.testing.assert_allclose(below, [0.0, 0.0, 0.05 * PRESS_SPEED], atol=1e-3)
    np.testing.assert_allclose(late.v_world_feet[Leg.FR], [0.0, 0.0, -PRESS_SPEED])
    deep = player.until(TOUCHDOWN + PRESS_DEPTH / PRESS_SPEED + 0.01)
    assert planned[2] - deep.p_world_feet[Leg.FR, 2] == pytest.approx(PRESS_DEPTH)
    assert not deep.v_world_feet[Leg.FR].any()
    player.contact[Leg.FR] = True
    assert player.until(player.t + TICK).stance.all()
    assert player.playback.landings.missed == 0


@BOTH
def test_a_foot_that_never_meets_the_ground_stands_after_a_time_and_is_told(kind: Kind) -> None:
    player = Follower(kind, STEP)
    player.until(LIFT_OFF)
    player.contact[:] = False
    assert not player.until(TOUCHDOWN + TIME_OUT - TICK).stance.all()
    assert player.until(TOUCHDOWN + TIME_OUT + 2 * TICK).stance.all()
    assert player.playback.landings.missed == 1


@BOTH
def test_in_flight_the_plan_goes_where_the_body_goes(kind: Kind) -> None:
    player = Follower(kind, HOP)
    before = player.until(TAKE_OFF - 2 * TICK)
    assert before.stance.all()
    player.contact[:] = False
    player.shift = np.array([0.03, -0.02, 0.1])
    flying = player.until(TAKE_OFF + 0.1)
    com = MODEL.snapshot(state_of(standing_q() + np.r_[player.shift, np.zeros(16)])).p_world_com
    left = np.linalg.norm(flying.body.p_world[:2] - com[:2])
    assert left == pytest.approx(NEAR, abs=CORRECTION), "but for what the legs make up for"
    planned = HOP.at(player.t)
    wanted = planned.p_world_feet - planned.body.p_world
    ours = flying.p_world_feet - flying.body.p_world
    np.testing.assert_allclose(ours[:, :2], wanted[:, :2], atol=CORRECTION)
    player.contact[:] = True
    landed = player.until(LANDING + 0.1)
    planned = HOP.at(player.t)
    shifts = (landed.body.p_world - planned.body.p_world)[:2]
    player.shift = np.zeros(3)
    later = player.until(LANDING + 0.2)
    kept = (later.p_world_feet - HOP.at(player.t).p_world_feet)[:, :2]
    assert np.ptp(kept, axis=0).max() < 1e-12, "all feet move alike"
    assert np.linalg.norm(shifts) > 0.01, "and stay where they landed"


@BOTH
def test_feet_come_down_in_their_places_if_the_body_is_near_its_own(kind: Kind) -> None:
    player = Follower(kind, HOP)
    player.until(TAKE_OFF - 2 * TICK)
    player.contact[:] = False
    com = MODEL.snapshot(state_of(standing_q())).p_world_com
    player.shift = HOP.at(TAKE_OFF).body.p_world - com + [0.5 * NEAR, -0.5 * NEAR, 0.1]
    flying = player.until(TAKE_OFF + 0.02)
    planned = HOP.at(player.t)
    np.testing.assert_allclose(flying.p_world_feet[:, :2], planned.p_world_feet[:, :2], atol=1e-12)
    np.testing.assert_allclose(flying.v_world_feet[:, :2], planned.v_world_feet[:, :2], atol=1e-12)


@BOTH
def test_the_ground_is_learnt_from_feet_that_touch_it_only(kind: Kind) -> None:
    higher = GROUND + 0.03  # the plan takes the ground for lower than it is
    heights = {}
    for touches in (True, False):
        player = Follower(kind, STEP, higher)
        player.until(LIFT_OFF)
        player.contact[:] = False
        player.until(TOUCHDOWN + 0.05)
        player.contact[Leg.FR] = touches
        end = player.until(TOUCHDOWN + TIME_OUT + 0.1)
        heights[touches] = end.p_world_feet[Leg.FL, 2] - STEP.at(player.t).p_world_feet[Leg.FL, 2]
    assert heights[False] == pytest.approx(higher)
    assert heights[True] == pytest.approx(higher - 0.3 * 0.03, abs=1e-3)


@BOTH
def test_a_plan_whose_feet_do_not_step_is_played_as_it_is(kind: Kind) -> None:
    joints = replace(STEP, swings=np.zeros_like(STEP.swings))
    assert joints.footsteps is None
    player = Follower(kind, joints)
    player.contact[:] = False
    for t in (LIFT_OFF + 0.3, TOUCHDOWN + 0.01):
        tracked = player.until(t)
        assert tracked.legs == joints.at(player.t).legs
        np.testing.assert_array_equal(
            tracked.normal_force_max, joints.at(player.t).normal_force_max
        )


@BOTH
def test_where_a_foot_has_landed_is_told(kind: Kind) -> None:
    player = Follower(kind, STEP)
    player.until(TOUCHDOWN + 0.1)
    planned = STEP.at(player.t).p_world_feet[Leg.FR, :2]
    stands = MODEL.snapshot(state_of(standing_q())).p_world_feet[Leg.FR, :2]
    assert player.playback.landings.error == pytest.approx(np.linalg.norm(stands - planned))
