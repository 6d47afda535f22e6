"""What is measured of a played motion is what happened in it, and nothing beside it."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.motion_measurement import (
    FELL,
    LANDED,
    SETTLED_CONTACT,
    _landed_off,
    _slip,
    failures_of,
    measure_motion,
    off_written,
    placed,
    trunk_off,
    turned_off,
)
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth, TruthRecording
from go2_wbc.reference import Anchor, LegTask, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy, rpy_from_rotation
from motions import CompiledPlan, Timeline, compile_timeline, deg
from motions.dynamics.phases import FOOTPRINT, PhaseProblem
from motions.postures import lie_down
from tests.go2_wbc.plant.helpers import empty_recording

SKID = 0.5  # m/s


def slip(plan: MotionPlan, start: float, end: float) -> float:
    """What counts as slip if the right front foot slides between two times [s]."""
    n = round(plan.duration / PERIOD) + 1
    velocity = np.zeros((n, 4, 3))
    velocity[round(start / PERIOD) : round(end / PERIOD), Leg.FR, 0] = SKID
    return _slip(empty_recording(n, velocity), plan, PERIOD)


def test_a_standing_foot_that_slides_counts_and_one_in_the_air_or_just_landed_not(
    raised: CompiledPlan,
) -> None:
    start = PERIOD * touchdown(raised) + SETTLED_CONTACT + 5 * PERIOD
    assert slip(raised, start, start + 0.02) == pytest.approx(SKID * 0.02)
    landed = PERIOD * touchdown(raised)
    assert slip(raised, landed - 0.1, landed + SETTLED_CONTACT - PERIOD) == 0.0


def test_a_played_motion_is_measured_from_its_begin_to_its_end(
    raised: CompiledPlan, model: RobotModel
) -> None:
    with closing(GroundTruth(MujocoPlant())) as truth, GO2Controller(plant=truth) as go2:
        assert go2.stand()
        found = measure_motion(go2, truth, raised, model)
    assert found.ok, found.reason
    assert 0.0 < found.slip < 0.005
    assert 0.0 < found.tracking < 0.02
    assert 0.0 < found.torque < 1.0
    assert found.touched == found.stopped == 0.0
    assert 0.0 < found.trunk_off < 0.02
    assert 0.0 < found.turned_off < 0.1
    assert 0.0 < found.paw_off < 0.03
    assert 0.0 < found.landed_off < 0.01
    assert found.as_dict() == {
        "ok": True,
        **{name: getattr(found, name) for name in found.__slots__},
    }
    assert [unit for _, _, unit in found.lines()] == ["mm", "mm", "%", "%", "rad"]


def test_a_robot_that_goes_limp_has_fallen_before_it_lies(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`play` returns as it lets go: tilted, but not yet on the ground."""
    head_down = Timeline(name="head down").body(pitch=deg(28.0), z=-0.1, over=1.0).hold(0.6)
    plan = compile_timeline(head_down.home(over=1.0), model)
    monkeypatch.setattr(GroundTruth, "fall", lambda _truth: None)
    with (
        closing(GroundTruth(MujocoPlant(friction=0.5))) as truth,
        GO2Controller(plant=truth) as go2,
    ):
        assert go2.stand()
        found = measure_motion(go2, truth, plan, model)
        assert go2.mode in (Mode.FALLEN, Mode.DAMPED)
    assert found.fall == found.reason
    assert "fell" in str(found.fall)
    assert FELL in failures_of(found, plan)


PERIOD = 0.002
SHIFT = 0.02  # m
WHERE = Anchor(np.array([0.3, -0.2, 0.0]), 0.7)
"""Where the robot stands in the world: a plan is in a frame of its own."""


def followed(plan: CompiledPlan) -> TruthRecording:
    """What MuJoCo would say of a robot that follows ``plan`` exactly."""
    n = round(plan.duration / PERIOD)
    references = [plan.at(PERIOD * tick).placed(WHERE) for tick in range(n)]
    return replace(
        empty_recording(n, np.zeros((n, 4, 3))),
        rpy=np.array([rpy_from_rotation(r.body.R_world_base) for r in references]),
        p_world_com=np.array([r.body.p_world for r in references]),
        p_world_feet=np.array([r.p_world_feet for r in references]),
    )


def touchdown(plan: CompiledPlan) -> int:
    """The tick in which the right front foot comes down."""
    n = round(plan.duration / PERIOD)
    in_air = [k for k in range(n) if not plan.at(PERIOD * k).stance[Leg.FR]]
    return in_air[-1] + 1


def test_what_is_done_as_written_is_nowhere_off_and_a_trunk_beside_its_place_is_seen(
    raised: CompiledPlan, model: RobotModel
) -> None:
    assert off_written(followed(raised), raised, model).max() < 1e-6
    truth = followed(raised)
    p, rpy = truth.p_world_com.copy(), truth.rpy.copy()
    p[300:310, 1] += SHIFT
    rpy[400:410, 2] += 0.1
    found = off_written(replace(truth, p_world_com=p, rpy=rpy), raised, model)
    assert found == pytest.approx([SHIFT, 0.1, 0.0, 0.0], abs=1e-6)


def test_a_foot_counts_as_a_paw_in_the_air_and_as_landed_once_it_has_settled(
    raised: CompiledPlan, model: RobotModel
) -> None:
    truth, down = followed(raised), touchdown(raised)
    in_air, landed = truth.p_world_feet.copy(), truth.p_world_feet.copy()
    in_air[: down - 1, Leg.FR, 2] += SHIFT
    landed[down + 10 :, Leg.FR, 0] += SHIFT
    in_air[0], landed[0] = truth.p_world_feet[0], truth.p_world_feet[0]
    found = off_written(replace(truth, p_world_feet=in_air), raised, model)
    assert found == pytest.approx([0.0, 0.0, SHIFT, 0.0], abs=1e-6)
    found = off_written(replace(truth, p_world_feet=landed), raised, model)
    assert found == pytest.approx([0.0, 0.0, 0.0, SHIFT], abs=1e-6)
    late = truth.p_world_feet.copy()
    late[down : down + round(0.5 * LANDED / PERIOD), Leg.FR, 2] += SHIFT
    found = off_written(replace(truth, p_world_feet=late), raised, model)
    assert found == pytest.approx([0.0, 0.0, 0.0, 0.0], abs=1e-6)


def test_a_foot_that_has_stood_all_along_has_not_landed() -> None:
    times, stance, off = np.arange(300) * PERIOD, np.ones((300, 4), dtype=bool), np.zeros((300, 4))
    stance[0, Leg.FL], off[:, Leg.FL], off[:, Leg.FR] = False, 0.01, 0.02
    assert _landed_off(times, stance, off) == 0.01


def test_a_jump_is_compared_with_where_it_was_to_land(model: RobotModel) -> None:
    plan = compile_timeline(Timeline().jump(height=0.15), model)  # ships solved
    (span,) = plan.dynamic
    states, n = span.trajectory, round(plan.duration / PERIOD)
    rows = np.minimum(np.searchsorted(states.times, PERIOD * np.arange(n)), len(states.times) - 1)
    feet = np.zeros((n, 4, 3))
    feet[:, :, :2], feet[:, :, 2] = FOOTPRINT, model.foot_radius
    truth = replace(empty_recording(n, np.zeros((n, 4, 3))), q=states.q[rows], p_world_feet=feet)
    assert isinstance(span.asked, PhaseProblem)
    lands = float(np.cumsum([phase.duration for phase in span.asked.phases])[3])
    (trunk, _, paw, landed), beside = off_written(truth, plan, model), feet.copy()
    assert landed < 1e-6
    assert trunk < span.tolerance.position
    assert paw == pytest.approx(0.15, abs=1e-6)  # these feet have not left the ground
    beside[round(lands / PERIOD) - 20 :, Leg.RL, 0] += SHIFT
    *_, landed = off_written(replace(truth, p_world_feet=beside), plan, model)
    assert landed == pytest.approx(SHIFT, abs=1e-3)


def plans() -> list[MotionPlan]:
    """Of the CoM with a paw that is raised, and of the base with four feet on the ground."""
    line = Timeline(name="raise").body(pitch=deg(8), over=0.4).foot("FR", z=0.06, over=0.5)
    start = np.array([0.02, 0.01, 0.28, 0.1, -0.2, 0.3])
    return [compile_timeline(line.home(over=0.5), RobotModel()), lie_down(start)]


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
def test_targets_are_what_the_plan_asks_for_at_each_instant(plan: MotionPlan) -> None:
    times = np.linspace(-0.1, plan.duration + 0.1, 60)
    truth, asked = recording(times), placed(plan, times, WHERE)
    trunk, turned = trunk_off(asked, truth), turned_off(asked, truth)
    for k, t in enumerate(times.tolist()):
        reference = plan.at(t).placed(WHERE)
        body, legs = reference.body, [LegTask(int(task)) for task in asked["legs"][k]]
        assert legs == [reference.legs[leg] for leg in LEGS]
        np.testing.assert_allclose(asked["p_world_feet"][k], reference.p_world_feet, atol=1e-12)
        np.testing.assert_array_equal(asked["q_joints"][k], reference.q_joints)
        point = truth.p_world_com[k] if body.point is TrackedPoint.COM else truth.q[k, :3]
        turn = body.R_world_base @ rotation_from_rpy(*truth.rpy[k].tolist()).T
        assert trunk[k] == pytest.approx(np.linalg.norm(point - body.p_world), abs=1e-12)
        assert turned[k] == pytest.approx(np.linalg.norm(log_rotation(turn)), abs=1e-9)
    assert (asked["legs"] == LegTask.JOINTS).any() or plan.name != "raise"
