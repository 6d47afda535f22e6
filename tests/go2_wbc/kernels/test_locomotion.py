"""The planner's kernel is held to the readable planner, tick by tick, on robots that stumble."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, ContactPhase, Gait
from go2_wbc.kernels.locomotion import foot_phase
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.compiled import CompiledPlanner
from go2_wbc.planning.contact import ContactConfig
from go2_wbc.planning.ground import GroundConfig
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.mpc import MpcConfig
from go2_wbc.planning.pose import LEVEL, BodyPose, PoseConfig
from go2_wbc.planning.slip import SlipConfig
from go2_wbc.planning.swing import SwingConfig
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload import NO_PAYLOAD, Payload
from go2_wbc.robot.snapshot import Snapshot
from tests.engine_helpers import random_state, standing_q, state_of

TICK = 0.002
ROUNDING = 1e-8  # of accelerations up to 100 m/s^2; measured 2e-10
OF_FORCES = 1e-6  # of planned forces up to 250 N and what they make of the trunk
ODD = Gait("odd", period=0.37, duty=0.61, offsets=(0.13, 0.58, 0.0, 0.83), width=0.87)
ODD_CONFIG = LocomotionConfig(
    height=0.27,
    linear_acceleration=1.1,
    angular_acceleration=3.3,
    velocity_feedback=0.17,
    stride_margin=0.31,
    position_leash=0.05,
    yaw_leash=0.21,
    foothold_reach=0.13,
    normal_force_min=3.0,
    normal_force_max=310.0,
    settle_speed=0.3,
    capture_margin=0.07,
    square_tolerance=0.05,
    swing=SwingConfig(apex=0.083, touchdown_depth=0.011, full_depth_way=0.17),
    slip=SlipConfig(0.12, 0.007, 0.015, 1.9, 0.18, 0.22, 0.14, 0.55, 0.34),
    contact=ContactConfig(0.62, 0.013),
    ground=GroundConfig(0.41, 0.59, 0.018, 0.052, 0.73, 0.057, 0.29),
    pose=PoseConfig(0.13, 0.47, 4.1),
)
"""No two numbers alike, so that one in another's place is seen."""
ODD_MPC = MpcConfig(
    step=0.028,
    interval=0.012,
    force_max=180.0,
    prior_weight=4e-3,
    load_ramp=0.02,
    throw_time=0.3,
)


GALLOP = Gait("gallop", 0.36, 0.40, (0.0, 0.15, 0.5, 0.65), apex=0.05)
AT_ONCE = Gait("at once", 0.31, 0.42, (0.0, 0.5, 0.5, 0.0), starts_at_once=True)
"""A first stride like that of steps for balance, which has a flight."""


def stumbling(model: RobotModel, rng: np.random.Generator, tick: int, at: np.ndarray) -> Snapshot:
    """A measured state near ``at``: calm for a while, then wild, now and then upright at rest.

    Now and then the robot carries something, and knows it.
    """
    state = random_state(rng, tilt=0.3 if tick % 1000 >= 500 else 0.02)
    q = state.q.copy()
    q[:3] = [*(at + rng.normal(scale=0.02, size=2)), 0.3 + 0.02 * rng.normal()]
    if tick % 700 >= 350:
        q[3:] = standing_q()[3:]
    pace = 0.02 if tick % 1400 >= 700 else 1.0
    contact = rng.random(4) < 0.1  # so that feet are met early, late and never
    if tick % 900 >= 450:  # and some long enough to slide
        contact = np.random.default_rng(tick // 40).random(4) < 0.6
    return model.snapshot(
        replace(
            state,
            time=tick * TICK,
            q=q,
            v=pace * state.v,
            tau=rng.normal(scale=10.0, size=12),
            feet_in_contact=contact,
        ),
        Payload(5.0, (0.06, -0.08, 0.03)) if tick % 600 >= 400 else NO_PAYLOAD,
    )


@pytest.mark.parametrize(
    ("gait", "config"),
    [
        (GAITS["trot"], LocomotionConfig()),
        (ODD, ODD_CONFIG),
        (GALLOP, replace(ODD_CONFIG, mpc=ODD_MPC)),
        (AT_ONCE, replace(ODD_CONFIG, mpc=ODD_MPC)),
    ],
    ids=["trot", "odd", "gallop", "flight at once"],
)
def test_references_are_those_of_the_readable_planner(gait: Gait, config: LocomotionConfig) -> None:
    model, rng, of_poses = RobotModel(), np.random.default_rng(8), np.random.default_rng(9)
    readable = LocomotionPlanner(model, gait, config)
    compiled = CompiledPlanner(model, gait, config)
    start = model.snapshot(state_of(standing_q()))
    readable.start(start)
    compiled.start(start)
    command, pose, at = ZERO_COMMAND, LEVEL, start.p_world_com[:2]
    starts, frictions, early = 0, set[float](), 0
    for tick in range(1, 3501):
        if tick % 200 == 0:
            command = VelocityCommand(*rng.normal(size=3)) if rng.random() < 0.6 else ZERO_COMMAND
        if tick % 300 == 0:
            leans = tick % 900 == 0  # level for long enough that the robot may come to rest
            pose = BodyPose(*of_poses.uniform(-0.3, 0.3, 4)) if leans else LEVEL
        snapshot = stumbling(model, rng, tick, at)
        was_stepping = readable.is_stepping
        theirs = readable.update(snapshot, command, pose)
        ours = compiled.update(snapshot, command, pose)
        rounding = OF_FORCES if theirs.force_weight else ROUNDING
        assert np.abs(ours.row - theirs.row).max() <= rounding, (tick, ours, theirs)
        assert ours.legs == theirs.legs
        assert compiled.is_stepping == readable.is_stepping
        assert abs(compiled.heading - readable.heading) <= ROUNDING
        starts += readable.is_stepping and not was_stepping
        frictions.add(theirs.friction)
        early += int((readable._contacts.stance & ~readable._was_stance).sum())
        at = theirs.body.p_world[:2]
        assert np.abs(np.subtract(compiled.velocity, readable.velocity)).max() <= ROUNDING
        if tick % 900 == 0:
            assert compiled.square_up(snapshot) == readable.square_up(snapshot)
        if tick % 1100 == 0:
            other = (gait, GAITS["walk"], GALLOP)[tick // 1100 % 3]
            readable.change_gait(other)
            compiled.change_gait(other)
    assert starts >= 3, "the comparison must go through standing and stepping"
    assert len(frictions) > 10, "and through slips"
    assert early > 0, "and through feet that find a step"


@pytest.mark.parametrize(
    "gait",
    [
        GAITS["trot"],
        ODD,
        Gait("walk", 0.5, 0.75, (0.0, 0.5, 0.75, 0.25)),
        Gait("all", 0.4, 1.0, (0.0, 0.0, 0.0, 0.0)),
    ],
    ids=lambda gait: gait.name,
)
def test_the_gait_is_that_of_the_contact_schedule(gait: Gait) -> None:
    schedule, form = gait.schedule(), (gait.period, gait.duty)
    events = [event + shift for event in schedule.times for shift in (-2e-9, 0.0, 1e-10)]
    for t in (*np.arange(0.0, 3 * gait.period, 0.0007), *events, *np.add(events, gait.period)):
        time = max(float(t), 0.0)
        phase: ContactPhase = schedule.at(time)
        for leg in range(4):
            stance, elapsed, remaining = foot_phase(time, gait.offsets[leg], *form)
            assert stance == phase.stance[leg], (t, leg)
            assert elapsed == pytest.approx(phase.elapsed[leg], abs=2e-9)
            assert remaining == pytest.approx(phase.remaining[leg], abs=2e-9)
