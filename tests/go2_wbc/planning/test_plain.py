"""What runs compiled is the Python that is written: one planner each way, tick by tick."""

import itertools
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.compilation import plain
from go2_wbc.contacts import GAITS, Gait
from go2_wbc.planning import force_mpc
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner, plan
from go2_wbc.planning.mpc import Horizon, MpcConfig
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant.terrain import Stairs
from go2_wbc.reference import Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload
from go2_wbc.robot.state import Snapshot
from tests.engine_helpers import random_state, standing_q, state_of
from tests.go2_wbc.planning.seen import exact_map

TICK = 0.002
TICKS = 240
EACH = 3  # Plans of forces from one that is solved by plain Python, in 0.3 s, to the next
ROUNDING = 1e-8  # of accelerations up to 100 m/s^2, where numpy's sine is not libm's
SWIFT = LocomotionConfig(settle_speed=0.3, square_tolerance=0.05, capture_margin=0.07)
SEEN = Stairs(0.1, 3, 0.31, start=0.2)
AT_ONCE = Gait("at once", 0.31, 0.42, (0.0, 0.5, 0.5, 0.0), starts_at_once=True)


def stumbling(model: RobotModel, rng: np.random.Generator, tick: int, at: np.ndarray) -> Snapshot:
    """A measured state near ``at``, calm for a while, then wild, now and then with a payload."""
    state = random_state(rng, tilt=0.3 if tick % 80 >= 40 else 0.02)
    q, pace = state.q.copy(), 0.02 if tick % 120 >= 60 else 1.0
    q[:3] = [*(at + rng.normal(scale=0.02, size=2)), 0.3 + 0.02 * rng.normal()]
    if tick % 60 >= 30:
        q[3:] = standing_q()[3:]
    contact = np.random.default_rng(tick // 20).random(4) < 0.5
    tau = rng.normal(scale=10.0, size=12)
    state = replace(
        state, time=tick * TICK, q=q, v=pace * state.v, tau=tau, feet_in_contact=contact
    )
    return model.snapshot(
        state, Payload(5.0, (0.06, -0.08, 0.03)) if tick % 90 > 60 else NO_PAYLOAD
    )


class Skipped(Exception):
    """A plan of forces that is not solved again."""


@pytest.mark.parametrize(
    ("gait", "terrain"),
    [(GAITS["trot"], None), (GAITS["trot"], SEEN), (GAITS["walk"], None), (AT_ONCE, None)],
    ids=["trot", "trot by sight", "walk", "at once"],
)
def test_the_planner_compiled_is_the_planner_as_it_is_written(
    gait: Gait, terrain: Stairs | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, plans = force_mpc.solve_mpc, itertools.count()

    def solved_now_and_then(c: MpcConfig, h: Horizon) -> int:
        if next(plans) % EACH:
            raise Skipped
        return solve(c, h)

    monkeypatch.setattr(force_mpc, "solve_mpc", solved_now_and_then)
    model, rng = RobotModel(), np.random.default_rng(8)
    heights = None if terrain is None else exact_map(terrain, -1.5, 1.5, 0.8)
    planner = LocomotionPlanner(model, gait, SWIFT, heights)
    planner.start(model.snapshot(state_of(standing_q())))
    at, starts, seen, frictions = np.zeros(2), 0, 0, set[float]()
    for tick in range(1, TICKS + 1):
        command = VelocityCommand(*rng.normal(size=3)) if tick % 100 < 60 else ZERO_COMMAND
        pose = BodyPose(*rng.uniform(-0.3, 0.3, 4)) if tick % 50 < 20 else LEVEL
        now, target, was_stepping = stumbling(model, rng, tick, at), Target(), planner.is_stepping
        state = type(planner._state).of(planner._state.row.copy())
        reference = planner.update(now, command, pose)
        velocity = command.linear_x, command.linear_y, command.angular_z
        planner._command.row[:3] = velocity  # which the planner has slowed down
        told = now.state.feet_in_contact, now.state.tau, state, planner._walk, planner._command
        with np.errstate(all="ignore"), suppress(Skipped):
            plain(plan)(now, np.float64(now.state.time), *told, target, planner._heights)
            np.testing.assert_allclose(target.row, reference.row, rtol=0, atol=ROUNDING)
            np.testing.assert_allclose(state.row, planner._state.row, rtol=0, atol=ROUNDING)
        seen += planner.sight.uneven_way > 0.0
        starts += planner.is_stepping and not was_stepping
        frictions.add(reference.friction)
        at = reference.body.p_world[:2]
    assert starts >= 1
    assert (seen > TICKS // 4) == (terrain is not None)
    assert next(plans) >= 30
    assert len(frictions) > 3


def test_a_gait_that_waits_is_compiled_as_it_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    def not_solved(c: MpcConfig, h: Horizon) -> int:
        raise Skipped

    monkeypatch.setattr(force_mpc, "solve_mpc", not_solved)
    model, stopped, compared = RobotModel(), 44, 0
    start = model.snapshot(state_of(standing_q()))
    planner = LocomotionPlanner(model, GAITS["trot"], LocomotionConfig())
    planner.start(start, friction=0.6)
    for tick in range(stopped + 20):
        contact = np.array([tick == stopped, True, True, False])
        now = start.replaced(state=replace(start.state, time=tick * TICK, feet_in_contact=contact))
        state, target = type(planner._state).of(planner._state.row.copy()), Target()
        reference = planner.update(now, VelocityCommand(1.0))
        if not planner._state.clock.is_waiting:
            continue
        told = contact, now.state.tau, state, planner._walk, planner._command
        with suppress(Skipped):
            plain(plan)(now, np.float64(now.state.time), *told, target, planner._heights)
            np.testing.assert_allclose(target.row, reference.row, rtol=0, atol=ROUNDING)
            np.testing.assert_allclose(state.row, planner._state.row, rtol=0, atol=ROUNDING)
            compared += 1
    assert compared > 5
