"""A plan's feet land when they meet the ground; its time and its tempo stay what they are."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.legs import Leg
from go2_wbc.reference import Anchor, LegTask, Reference, Target
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.tracking.landing import (
    EARLIEST,
    NEAR,
    PLAN_SHARE,
    PRESS_DEPTH,
    PRESS_SPEED,
    TIME_OUT,
    Landing,
    carry,
    land,
)
from go2_wbc.tracking.plan_curves import StanceLoad
from go2_wbc.tracking.plan_tracking import PlanTracker
from motions.plan.compiled_plan import CompiledPlan
from tests.engine_helpers import standing_q, state_of
from tests.stepping_plans import LANDING, LIFT_OFF, TAKE_OFF, TOUCHDOWN, hop_plan, step_plan

FOOT_RADIUS = find_profile().foot_radius

MODEL = RobotModel()
TICK = 0.002
STEP, HOP = step_plan(MODEL, Leg.FR, 0.05), hop_plan(MODEL, 0.1)
GROUND = float(MODEL.snapshot(state_of(standing_q())).p_world_feet[0, 2]) - FOOT_RADIUS
CORRECTION = 5e-3  #: What the steady-state correction has added before [m]


class Follower:
    """Plays a plan on a robot that always stands in the same way, but for its contacts."""

    def __init__(self, plan: CompiledPlan, height: float = GROUND) -> None:
        self.plan, self.t = plan, 0.0
        self.tracker = PlanTracker(Anchor(np.array([0.0, 0.0, height]), 0.0), plan.footsteps)
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
        plan = Target.of(self.plan.row_at(self.t))
        return self.tracker.track(plan, MODEL.snapshot(state), self.t, TICK)


def test_a_foot_that_meets_the_ground_early_stands_from_then_on() -> None:
    player = Follower(STEP)
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


def test_a_foot_that_never_meets_the_ground_stands_after_a_time_and_is_told() -> None:
    player = Follower(STEP)
    player.until(LIFT_OFF)
    player.contact[:] = False
    assert not player.until(TOUCHDOWN + TIME_OUT - TICK).stance.all()
    assert player.until(TOUCHDOWN + TIME_OUT + 2 * TICK).stance.all()
    assert player.tracker.landings.missed == 1


def test_in_flight_the_plan_goes_where_the_body_goes() -> None:
    player = Follower(HOP)
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


def test_a_plan_whose_feet_do_not_step_is_played_as_it_is() -> None:
    joints = replace(STEP, swings=np.zeros_like(STEP.swings))
    assert joints.footsteps is None
    player = Follower(joints)
    player.contact[:] = False
    for t in (LIFT_OFF + 0.3, TOUCHDOWN + 0.01):
        tracked = player.until(t)
        assert tracked.legs == joints.at(player.t).legs
        np.testing.assert_array_equal(
            tracked.normal_force_max, joints.at(player.t).normal_force_max
        )


def test_where_a_foot_has_landed_is_told() -> None:
    player = Follower(STEP)
    player.until(TOUCHDOWN + 0.1)
    planned = STEP.at(player.t).p_world_feet[Leg.FR, :2]
    stands = MODEL.snapshot(state_of(standing_q())).p_world_feet[Leg.FR, :2]
    assert player.tracker.landings.error == pytest.approx(np.linalg.norm(stands - planned))


DOWN, IN_AIR = False, True
BEFORE, AFTER = EARLIEST - 0.01, EARLIEST + 0.01
"""Share of a swing that is over when contacts do not count yet, and do."""
IN_TIME, TOO_LATE = TIME_OUT - 0.01, TIME_OUT + 0.01  #: Time [s] since a foot should have come down
ST, SW, JO = LegTask
TABLE = (
    # it is, what the plan asked before, asks now, since, contact; it will be, is asked to, missed
    (DOWN, ST, ST, 1.0, True, DOWN, ST, 0),
    (DOWN, ST, ST, 1.0, False, DOWN, ST, 0),
    (DOWN, ST, SW, 0.0, True, IN_AIR, SW, 0),
    (DOWN, ST, SW, 0.0, False, IN_AIR, SW, 0),
    (DOWN, SW, SW, AFTER, False, DOWN, ST, 0),
    (DOWN, SW, ST, 0.0, False, DOWN, ST, 0),
    (IN_AIR, SW, SW, BEFORE, True, IN_AIR, SW, 0),
    (IN_AIR, SW, SW, BEFORE, False, IN_AIR, SW, 0),
    (IN_AIR, SW, SW, AFTER, True, DOWN, ST, 0),
    (IN_AIR, SW, SW, AFTER, False, IN_AIR, SW, 0),
    (IN_AIR, SW, ST, 0.0, True, DOWN, ST, 0),
    (IN_AIR, ST, ST, IN_TIME, True, DOWN, ST, 0),
    (IN_AIR, ST, ST, IN_TIME, False, IN_AIR, SW, 0),
    (IN_AIR, ST, ST, 0.05, False, IN_AIR, SW, 0),
    (IN_AIR, ST, ST, TOO_LATE, True, DOWN, ST, 0),
    (IN_AIR, ST, ST, TOO_LATE, False, DOWN, ST, 1),
    (IN_AIR, SW, JO, AFTER, False, DOWN, JO, 0),
    (DOWN, ST, JO, AFTER, True, DOWN, JO, 0),
    (DOWN, JO, SW, 0.0, False, IN_AIR, SW, 0),
    (DOWN, JO, ST, 0.0, False, DOWN, ST, 0),
)
HIGHER = 0.05  #: By which the plan takes the ground for higher than it is [m]
LOAD = StanceLoad(0.1, 3.0, 300.0)


def landing(is_in_air: bool, before: LegTask, leg: int) -> Landing:
    """A leg of which the plan asked ``before``, of a robot whose other feet stand."""
    s = Landing.at(Anchor(np.array([0.2, -0.1, GROUND + HIGHER]), 0.0))
    foot = s.feet[leg]
    foot.planned, foot.is_in_air, foot.is_awaited = before, is_in_air, is_in_air
    return s


def tick(
    s: Landing, leg: int, planned: LegTask, since: float, unload: float, *, contact: bool
) -> Target:
    """What ``land`` makes of 1 s long phase of ``leg``, ``since`` seconds after it began."""
    target = Target(legs=np.full(4, ST), normal_force_max=np.full(4, 400.0))
    target.legs[leg], target.v_world_feet[:] = planned, 1.0
    changes = np.tile([-np.inf, np.inf, np.inf], (1, 4, 1))
    changes[0, leg] = 5.0 - since, 6.0 - since, 5.0 + unload
    touches, now = np.ones(4, dtype=bool), MODEL.snapshot(state_of(standing_q()))
    touches[leg] = contact
    land(5.0, touches, np.zeros(1), changes, LOAD, now, s, target)
    return target


@pytest.mark.parametrize("leg", range(4))
@pytest.mark.parametrize("case", TABLE)
def test_what_becomes_of_a_foot(case: tuple[float, ...], leg: int) -> None:
    was, before, planned, since, contact, will_be, asked, missed = case
    s = landing(bool(was), LegTask(int(before)), leg)
    target = tick(s, leg, LegTask(int(planned)), since, np.inf, contact=bool(contact))
    foot = s.feet[leg]
    assert foot.is_in_air == will_be
    assert target.legs[leg] == asked
    assert s.missed == missed
    assert foot.planned == planned
    has_landed = was and not will_be and planned != JO
    assert foot.touchdown == (5.0 if has_landed else -np.inf)
    left = 1.0 - PLAN_SHARE if has_landed and contact else 1.0
    assert s.anchor.p_world[2] == pytest.approx(GROUND + left * HIGHER)
    others = [other for other in range(4) if other != leg]
    assert (target.legs[others] == ST).all()
    assert (target.normal_force_max[others] == 400.0).all(), "feet that never stepped"
    if asked == SW:
        assert target.normal_force_max[leg] == 0.0
        depth = PRESS_SPEED * since if planned == ST else 0.0
        assert target.p_world_feet[leg, 2] == pytest.approx(-min(depth, PRESS_DEPTH))
        pressed = [0.0, 0.0, -PRESS_SPEED if depth < PRESS_DEPTH else 0.0]
        assert target.v_world_feet[leg].tolist() == (pressed if planned == ST else [1.0] * 3)


@pytest.mark.parametrize(
    ("since", "unload", "share"),
    [
        (0.0, np.inf, 0.0),
        (0.05, np.inf, 0.5),
        (0.2, np.inf, 1.0),
        (0.2, 0.025, 0.25),
        (0.2, -0.01, 0.0),
        (0.04, 0.02, 0.2),
    ],
)
def test_the_load_is_ramped_from_touchdown_and_to_when_it_is_given_up(
    since: float, unload: float, share: float
) -> None:
    s = landing(DOWN, ST, 2)
    s.feet[2].touchdown = 5.0 - since
    target = tick(s, 2, ST, 0.3, unload, contact=True)
    assert target.normal_force_max[2] == pytest.approx(300.0 * share, abs=1e-9)
    assert target.normal_force_min[2] == pytest.approx(3.0 * share, abs=1e-9)


def test_an_early_foot_is_loaded_whatever_the_plan_unloads_then() -> None:
    s = landing(DOWN, SW, 1)
    s.feet[1].touchdown = 5.0 - 0.05
    target = tick(s, 1, SW, AFTER, 0.0, contact=True)
    assert target.normal_force_max[1] == pytest.approx(150.0)


def test_a_landing_is_judged_once_and_by_where_the_plan_was_at_first() -> None:
    s = landing(DOWN, ST, 0)
    s.feet[0].is_awaited = True
    s.anchor.p_world[:2] += [0.03, -0.02]
    tick(s, 0, ST, 0.3, np.inf, contact=True)
    stands = MODEL.snapshot(state_of(standing_q())).p_world_feet[0, :2]
    assert s.error == pytest.approx(np.linalg.norm(stands + [0.03, -0.02]))
    assert not s.feet[0].is_awaited
    s.anchor.p_world[0] += 1.0
    before = s.error
    tick(s, 0, ST, 0.4, np.inf, contact=True)
    assert s.error == before


def test_a_leg_that_follows_its_joints_forgets_its_landing() -> None:
    s = landing(DOWN, ST, 3)
    s.feet[3].touchdown, s.feet[3].is_awaited = 4.0, True
    tick(s, 3, JO, 0.1, np.inf, contact=False)
    assert s.feet[3].touchdown == -np.inf
    assert not s.feet[3].is_awaited
    assert tick(s, 3, ST, 0.0, np.inf, contact=False).normal_force_max[3] == 400.0, "as planned"


@pytest.mark.parametrize("away", [0.5 * NEAR, 1.5 * NEAR, 10.0 * NEAR])
def test_in_flight_body_feet_and_plan_move_as_one_and_what_is_left_is_near(away: float) -> None:
    rng, now = np.random.default_rng(4), MODEL.snapshot(state_of(standing_q()))
    now = now.replaced(v_world_com=rng.normal(size=3))
    s, direction = Landing.at(Anchor(rng.normal(size=3), 0.0)), np.array([0.6, -0.8, 0.0])
    off, feet = -away * direction + [0.0, 0.0, 0.3], rng.normal(size=(2, 4, 3))
    planned = Target(
        p_world=now.p_world_com + off,
        v_world=rng.normal(size=3),
        p_world_feet=feet[0],
        v_world_feet=feet[1],
    )
    target = Target.of(planned.row.copy())
    carry(now, s, target)
    moved = max(away - NEAR, 0.0) * direction
    np.testing.assert_allclose(target.p_world - planned.p_world, moved, atol=1e-12)
    np.testing.assert_allclose(s.anchor.p_world - s.origin.p_world, moved, atol=1e-12)
    np.testing.assert_allclose(target.p_world_feet - feet[0], np.tile(moved, (4, 1)), atol=1e-12)
    share = max(1.0 - NEAR / away, 0.0) * np.array([1.0, 1.0, 0.0])
    faster = share * (now.v_world_com - planned.v_world)
    np.testing.assert_allclose(target.v_world_feet - feet[1], np.tile(faster, (4, 1)), atol=1e-12)
    np.testing.assert_array_equal(target.v_world, planned.v_world)
