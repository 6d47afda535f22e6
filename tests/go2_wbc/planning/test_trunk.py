"""The trunk's way: its pose while walking, and its reference on a slope."""

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.contacts import GAITS
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.force_mpc import fill_goals
from go2_wbc.planning.ground import FOLLOW, Ground
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.mpc import NODES
from go2_wbc.planning.trunk import (
    ANGLE_WINDOW,
    LEVEL,
    RATE,
    STRIDE_RATE,
    STRIDE_WINDOW,
    BodyPose,
    Command,
    PoseConfig,
    PoseEnvelope,
    Trunk,
    accelerate,
    advance_pose,
    fill_body,
    follow_heading,
    follow_position,
    gained,
    level,
    pose_turn,
    ramp,
)
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.reference import Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy, yaw_rotation
from tests.engine_helpers import standing_q, state_of
from tests.go2_wbc.planning.squared import MODEL

SLOPE = np.array([0.2, -0.1])
EXACT = 1e-12
TICK = 0.002
ARRIVED = 2e-3  # of what is left a second after the greatest rate ends: exp(-5) of 0.07 rad
DERIVED = 1e-6  # of central differences over 1e-5 s
angles = st.floats(-0.6, 0.6)
poses = st.builds(BodyPose, st.floats(-0.1, 0.1), angles, angles, angles)


def attitude(yaw: float, slope: np.ndarray) -> np.ndarray:
    target = Target()
    fill_body(Trunk(yaw=yaw), Ground(slope=slope / FOLLOW), 0.3, target)
    return target.R_world_base


def test_a_trunk_on_a_slope_keeps_its_heading_and_has_its_normal_up() -> None:
    R = attitude(0.7, SLOPE)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=EXACT)
    np.testing.assert_allclose(R[:, 2], np.array([-0.2, 0.1, 1.0]) / np.sqrt(1.05), atol=EXACT)
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(0.7, abs=EXACT)
    np.testing.assert_allclose(attitude(0.7, np.zeros(2)), yaw_rotation(0.7), atol=EXACT)


@pytest.mark.parametrize("seed", range(5))
def test_a_command_is_ramped_straight_to_at_the_rates_and_arrives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    v, command = rng.uniform(-1.0, 1.0, 3), Command(velocity=rng.uniform(-1.0, 1.0, 3))
    for _ in range(int(3.0 / TICK)):
        before = v.copy()
        missing = command.velocity - before
        ramp(v, command, 1.5, 4.0, TICK)
        far = math.hypot(*missing[:2])
        step = missing[:2] * min(1.5 * TICK / far, 1.0) if far > EXACT else missing[:2]
        np.testing.assert_allclose(v[:2] - before[:2], step, atol=EXACT)
        assert v[2] - before[2] == pytest.approx(np.clip(missing[2], -4 * TICK, 4 * TICK))
    np.testing.assert_allclose(v, command.velocity, atol=EXACT)


def test_what_the_ramp_adds_is_foretold() -> None:
    trunk, command = Trunk(), Command(velocity=np.array([3.0, -4.0, 0.0]))
    accelerate(trunk, command, 2.0, 1.0, 0.5)  # so long that the smoothed rate is the ramp's
    np.testing.assert_allclose(trunk.acceleration, [1.2, -1.6])
    np.testing.assert_allclose(trunk.missing, command.velocity[:2] - trunk.velocity[:2])
    lasts = 4.0 / 2.0  # for what is missing
    for axis, time in ((0, 0.2), (0, 2.9), (1, 0.4), (1, 5.0)):
        t = np.linspace(0.0, time, 20001)
        v = trunk.acceleration[axis] * np.minimum(t, lasts)
        found = gained(trunk, axis, time)
        assert found == pytest.approx((v[-1], np.trapezoid(v, t)), rel=1e-6)
    trunk.missing[0] = -0.1
    assert gained(trunk, 0, 1.0) == (0.0, 0.0)


@pytest.mark.parametrize("yaw", [-3.1, 0.4, 3.1])
def test_the_trunk_s_way_is_integrated_and_never_farther_ahead_than_the_leash(yaw: float) -> None:
    q = standing_q()
    q[3:7] = pin.Quaternion(yaw_rotation(yaw)).coeffs()
    now = MODEL.snapshot(state_of(q))
    com = now.p_world_com[:2]
    trunk = Trunk(velocity=np.array([0.5, -0.2, 0.7]), pose=np.array([0.0, 0.0, 0.0, 0.03]))
    way = (yaw_rotation(yaw) @ [0.05, -0.02, 0.0])[:2]
    for leash, share, ahead in ((0.5, 1.0, 0.1), (0.02, 0.02 / np.linalg.norm(way), 0.02)):
        trunk.yaw, trunk.position[:] = yaw, com
        follow_position(trunk, now, leash, 0.1)
        np.testing.assert_allclose(trunk.position, com + share * way, atol=EXACT)
        follow_heading(trunk, now, leash, 0.1)
        assert trunk.yaw + 0.03 - yaw == pytest.approx(ahead, abs=EXACT)  # the pose turns it, too
    trunk.yaw = yaw + 2.0 * np.pi - 0.4
    follow_heading(trunk, now, 0.25, 0.0)
    assert trunk.yaw == pytest.approx(yaw + 2.0 * np.pi - 0.28)


@pytest.mark.parametrize("slope", [(0.0, 0.3), (0.3, 0.0)])
def test_the_turn_that_is_planned_for_is_that_of_the_slope(slope: tuple[float, float]) -> None:
    walk = Walk.of(MODEL, GAITS["trot"], LocomotionConfig())
    planner = Planner(ground=Ground(slope=np.array(slope) / FOLLOW))
    fill_goals(planner, walk, Command())
    turn = log_rotation(attitude(0.0, np.array(slope)))
    np.testing.assert_allclose(planner.horizon.goals[:, :3], np.tile(turn, (NODES, 1)), atol=EXACT)
    assert np.linalg.norm(turn) == pytest.approx(np.arctan(0.3))


@pytest.mark.parametrize("missing", [None, 0, 1, 2, 3])
@pytest.mark.parametrize("is_stepping", [False, True])
def test_the_lean_is_integrated_from_the_error_of_the_vertical_while_it_is_known(
    missing: int | None, is_stepping: bool
) -> None:
    """In the world, of roll and pitch alone: d offset / dt = rate (z x z_wanted)."""
    wanted, measured = rotation_from_rpy(0.02, -0.03, 0.4), rotation_from_rpy(-0.01, 0.015, -0.5)
    q = standing_q()
    q[3:7] = pin.Quaternion(measured).coeffs()
    contact, offset = np.arange(4) != missing, np.array([0.003, -0.002])
    trunk, target = Trunk(lean_offset=offset.copy()), Target(R_world_base=wanted.copy())
    level(trunk, MODEL.snapshot(state_of(q)), contact, is_stepping, TICK, target)
    if is_stepping or missing is None:
        rate = STRIDE_RATE if is_stepping else RATE
        window = STRIDE_WINDOW if is_stepping else ANGLE_WINDOW
        error = np.cross(measured[:, 2], wanted[:, 2])[:2]
        offset += rate * TICK * np.clip(error, -window, window)
    np.testing.assert_allclose(trunk.lean_offset, offset, atol=EXACT)
    np.testing.assert_allclose(target.R_world_base, pin.exp3(np.array([*offset, 0.0])) @ wanted)


def test_a_pose_beyond_the_envelope_is_refused_with_every_bound_that_it_breaks() -> None:
    envelope = PoseEnvelope(lowest=-0.05, highest=0.01, roll=0.1, pitch=0.2, yaw=0.3)
    envelope.require(BodyPose(-0.05, 0.1, -0.2, 0.3))
    with pytest.raises(CommandError) as refusal:
        envelope.require(BodyPose(-0.06, 0.0, 0.21, -0.3))
    text = str(refusal.value)
    assert "height must be -0.05 to 0.01 m, got -0.06" in text
    assert "pitch must be -0.2 to 0.2 rad, got 0.21" in text
    assert "roll" not in text
    assert "yaw" not in text


@pytest.mark.parametrize(
    ("bounds", "told"),
    [
        ({"lowest": 0.01}, "lowest must be between -1 and 0, got 0.01"),
        ({"lowest": -math.inf}, "lowest must be between -1 and 0, got -inf"),
        ({"roll": -0.1}, "PoseEnvelope.roll"),
    ],
)
def test_an_envelope_without_the_level_pose_is_refused(bounds: dict[str, float], told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        PoseEnvelope(**bounds)


@pytest.mark.parametrize("seed", range(4))
def test_a_pose_is_approached_without_a_jump_and_not_overshot(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, last = (BodyPose(*rng.uniform(-1.0, 1.0, 4) * [0.1, 0.6, 0.6, 0.6]) for _ in range(2))
    config = PoseConfig()
    most = np.array([config.height_rate] + [config.turning_rate] * 3)
    pose, rate = np.zeros(4), np.zeros(4)
    for target in (first, last):
        start = pose.copy()
        low, high = np.minimum(start, target.row), np.maximum(start, target.row)
        for _ in range(round(5.0 / TICK)):
            before = rate.copy()
            advance_pose(pose, rate, config, target.row, TICK)
            assert (np.abs(rate) <= most + EXACT).all()
            assert (np.abs(rate - before) <= config.sharpness * most * TICK + EXACT).all()
            assert (pose >= low - EXACT).all()
            assert (pose <= high + EXACT).all()
        np.testing.assert_allclose(pose, target.row, atol=ARRIVED)


def turn_of(yaw: float, pose: BodyPose, rate: BodyPose = LEVEL) -> tuple[np.ndarray, np.ndarray]:
    turn, w = np.empty((2, 3))
    pose_turn(yaw, pose.row, rate.row, turn, w)
    return turn, w


@given(st.floats(-3.0, 3.0), poses)
def test_the_turn_of_a_pose_is_that_from_a_level_trunk_with_its_yaw(
    yaw: float, pose: BodyPose
) -> None:
    level = yaw_rotation(yaw + pose.yaw)
    R = yaw_rotation(yaw) @ rotation_from_rpy(pose.roll, pose.pitch, pose.yaw)
    turn, _ = turn_of(yaw, pose)
    np.testing.assert_allclose(turn, log_rotation(R @ level.T), atol=1e-9)


@given(st.floats(-3.0, 3.0), poses, poses)
def test_the_angular_velocity_of_a_pose_is_the_derivative_of_its_rotation(
    yaw: float, pose: BodyPose, rate: BodyPose
) -> None:
    step = 1e-5

    def rotation(t: float) -> np.ndarray:
        _, roll, pitch, aside = pose.row + t * rate.row
        return yaw_rotation(yaw) @ rotation_from_rpy(roll, pitch, aside)

    _, w = turn_of(yaw, pose, rate)
    derived = log_rotation(rotation(step) @ rotation(-step).T) / (2 * step)
    np.testing.assert_allclose(w, derived, atol=DERIVED)


def test_the_reference_of_a_walking_robot_arrives_at_the_pose_and_the_feet_stay() -> None:
    model, asked = RobotModel(), BodyPose(-0.04, 0.1, 0.12, 0.2)
    planners = [LocomotionPlanner(model, GAITS["trot"], LocomotionConfig()) for _ in range(2)]
    start = model.snapshot(state_of(standing_q()))
    for planner in planners:
        planner.start(start)
    command = VelocityCommand(0.0, 0.0, 1e-9)

    def reference(
        planner: LocomotionPlanner, pose: BodyPose, tick: int, q: np.ndarray
    ) -> Reference:
        return planner.update(model.snapshot(state_of(q, time=tick * TICK)), command, pose)

    qs, asks = [standing_q(), standing_q()], (LEVEL, asked)
    for tick in range(1, 1500):
        for planner, pose, q in zip(planners, asks, qs, strict=True):
            R = reference(planner, pose, tick, q).body.R_world_base
            q[3:7] = pin.Quaternion(R).coeffs()  # the robot leans as it is asked to
    level, leaning = map(reference, planners, asks, (1500, 1500), qs)
    turned = level.body.R_world_base.T @ leaning.body.R_world_base
    np.testing.assert_allclose(turned, rotation_from_rpy(0.1, 0.12, 0.2), atol=ARRIVED)
    assert planners[1].heading == pytest.approx(planners[0].heading, abs=1e-6)
