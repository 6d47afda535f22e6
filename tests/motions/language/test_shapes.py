"""Paths through points, gaze, single joints, own easing, and whole motions changed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import TypeCheckError

from go2_wbc.errors import TimelineError
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.rotations import yaw_rotation
from motions import FeasibilityChecker, Timeline, deg, load_motion
from motions.language.footing import Footing
from motions.language.keys import BalanceShift, BodyKey, JointKey, PhaseKey
from motions.plan.trajectory import trajectory_of
from motions.postures import standing_feet
from tests.motions.plans import MODEL, curves_at, plan_of

NEAR = 1e-3
BALANCE = 0.02  # m, rad; where the trunk balances depends on where it comes from
NOD = Timeline().body(pitch=deg(8), over=0.6).home(over=0.9)
WAVE = Timeline().foot("FR", x=0.03, z=0.1, over=0.6).hold(0.3, name="up").home(over=1.0)


def written(line: Timeline) -> list[str]:
    """Its keys, whatever their order and rounding."""
    keys = [replace(key, start=round(key.start, 9), end=round(key.end, 9)) for key in line.keys]
    return sorted(map(str, keys))


def test_a_path_passes_its_points_evenly_without_a_stop() -> None:
    points = [{"x": 0.02, "z": -0.02}, {"x": 0.03, "z": 0.0}, {"x": 0.0, "z": 0.0}]
    plan = plan_of(Timeline().body_path(points, over=2.4, times=[0.6, 1.2, 2.4]))
    start = plan.at(0.0).body.p_world
    for t, point in zip([0.6, 1.2, 2.4], points, strict=True):
        body = plan.at(t).body
        # the CoM follows the trunk but for what the legs add
        assert body.p_world[0] - start[0] == pytest.approx(point["x"], abs=0.005)
    assert np.linalg.norm(plan.at(0.6).body.v_world) > 0.01
    assert np.linalg.norm(plan.at(2.4).body.v_world) < NEAR
    points = [{"pitch": deg(6)}, {"pitch": deg(-6)}, {"pitch": 0.0}]
    even = Timeline().body_path(points, over=3.0)
    assert even.keys == Timeline().body_path(points, over=3.0, times=[1.0, 2.0, 3.0]).keys


@pytest.mark.parametrize("place", [(1.0, 0.3, 0.1), (2.0, -1.0, 0.8), (0.8, 0.0, 0.31)])
def test_the_trunk_points_at_what_it_looks_at(place: tuple[float, float, float]) -> None:
    line = Timeline().look_at(*place, over=1.5)
    path = trajectory_of(plan_of(line), MODEL)
    p_base, (_, pitch, yaw) = path.q[-1, :3], path.rpy[-1]
    axis = [math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch)]
    to_place = np.array(place) - p_base
    cosine = float(np.dot(axis, to_place / np.linalg.norm(to_place)))
    assert math.degrees(math.acos(min(cosine, 1.0))) < 2.0


def test_one_joint_moves_and_the_others_keep_their_angles() -> None:
    raised = Timeline().foot("FR", z=0.1, over=0.6, frame="body")
    plan = plan_of(raised.joint("FR", "calf", -1.8, over=0.5))
    before, after = (plan.at(t).q_joints[3:6] for t in (raised.end, raised.end + 0.5))
    assert after[2] == pytest.approx(-1.8, abs=NEAR)
    assert after[:2] == pytest.approx(before[:2], abs=NEAR)
    assert abs(before[2] - after[2]) > 0.1


def test_a_joint_is_that_of_the_other_leg_when_mirrored() -> None:
    line = (
        Timeline()
        .foot("FR", z=0.1, over=0.6, frame="body")
        .joint("FR", "hip", 0.2, over=0.5)
        .mirror()
    )
    (key,) = line.in_order(JointKey)
    assert key.leg.name == "FL"
    assert key.target.values[0] == -0.2


def test_an_own_easing_says_how_far_the_trunk_has_come() -> None:
    line = Timeline().body(pitch=0.1, over=1.0, ease=lambda s: s * s * (3 - 2 * s))
    same = Timeline().body(pitch=0.1, over=1.0, ease="cubic")
    for t in (0.2, 0.5, 0.9):
        own, named = (curves_at(plan_of(one), t)[0] for one in (line, same))
        assert own == pytest.approx(named, abs=1e-9)


@pytest.mark.parametrize("name", ["nod", "wave", "dance", "high_five"])
def test_a_slower_motion_passes_the_same_places_later(name: str) -> None:
    line = load_motion(name)
    fast, slow = plan_of(line), plan_of(line.scale_time(2.0))
    assert slow.duration == pytest.approx(2.0 * fast.duration)
    for t in np.linspace(0.0, fast.duration, 9).tolist():
        assert curves_at(slow, 2 * t)[0] == pytest.approx(curves_at(fast, t)[0], abs=2e-3)


@pytest.mark.parametrize("name", ["scale_time", "scale_shifts"])
def test_the_trunk_moves_as_much_slower_over_the_feet_that_are_yet_to_stay(name: str) -> None:
    line = getattr(Timeline(shift_time=0.4).body(z=-0.02, over=0.5), name)(3.0)
    (shift, *_) = line.foot("FR", z=0.05, over=0.5).in_order(BalanceShift)
    assert shift.end - shift.start == pytest.approx(1.2)


def test_slower_beats_last_longer_and_half_the_amplitude_is_half_the_way() -> None:
    line = Timeline().bpm(120).body(z=-0.02, over=1).scale_time(2.0).hold(1)
    assert line.end == pytest.approx(2.0)
    whole, half = (curves_at(plan_of(line), 0.6)[0] for line in (NOD, NOD.scale(0.5)))
    assert half[4] == pytest.approx(0.5 * whole[4], abs=NEAR)
    assert WAVE.scale(0.5).keys != WAVE.keys
    points = [{"x": 0.02}, {"x": 0.04}]
    half_path = Timeline().body_path(points, over=1.0).scale(0.5)
    assert half_path.keys == Timeline().body_path([{"x": 0.01}, {"x": 0.02}], over=1.0).keys


def test_a_trunk_that_is_shifted_in_height_keeps_its_own_moves_of_height() -> None:
    low, middle, high = 1 / 128, 2 / 128, 3 / 128  # exact in binary
    line = Timeline().body(z=high, over=1.0).body(pitch=0.1, over=1.0).home(over=1.0)
    lower = Timeline().body(z=low, over=1.0).body(pitch=0.1, over=1.0).home(over=1.0)
    assert written(line.shift_height(-middle)) == written(lower)
    path = Timeline().body_path([{"z": low}, {"z": middle}], over=1.0).home(over=1.0)
    moved = Timeline().body_path([{"z": middle}, {"z": high}], over=1.0).home(over=1.0)
    assert written(path.shift_height(low)) == written(moved)
    both = Timeline().body(yaw=0.1, over=0.5).also().body(pitch=0.1, over=1.0).home(over=1.0)
    heights = [key for key in both.shift_height(low).in_order(BodyKey) if key.channel == "z"]
    assert [(key.start, key.end) for key in heights] == [(0.0, 1.0), (1.0, 2.0)]


def test_longer_shifts_delay_what_follows_and_stretch_what_goes_on_meanwhile() -> None:
    line = Timeline(shift_time=0.5).body(pitch=0.1, over=0.5).also()
    short = Timeline(shift_time=0.5).foot("FR", z=0.05, over=0.7).hold(0.2).home(over=0.7)
    long = Timeline(shift_time=1.0).foot("FR", z=0.05, over=0.7).hold(0.2).home(over=0.7)
    twice = short.scale_shifts(2.0)
    assert twice.keys[:3] == long.keys[:3]
    assert twice.end == pytest.approx(long.end + 0.7)  # the way back takes longer too
    assert line.foot("FR", z=0.05, over=0.7).scale_shifts(1.0).keys == (
        line.foot("FR", z=0.05, over=0.7).keys
    )
    walked = Timeline().walk(x=0.1).foot("FR", z=0.05, over=0.7).home(over=0.7)
    assert walked.scale_shifts(2.0).end_pose == pytest.approx(walked.end_pose)


def test_smaller_jumps_are_lower_and_shorter_and_what_follows_comes_sooner() -> None:
    big = Timeline().jump(x=0.4, yaw=0.5, height=0.32).body(z=-0.03, over=0.5).home(over=0.5)
    small = Timeline().jump(x=0.2, yaw=0.5, height=0.16).body(z=-0.03, over=0.5).home(over=0.5)
    halved = big.scale_jumps(0.5)
    assert halved.end == pytest.approx(small.end)
    assert halved.end < big.end
    (jumped,), (asked,) = halved.in_order(PhaseKey), small.in_order(PhaseKey)
    assert jumped.shift == pytest.approx(asked.shift)
    for phase, wanted in zip(jumped.phases[2:4], asked.phases[2:4], strict=True):
        assert phase.duration == pytest.approx(wanted.duration)
        assert [place[2] for place in phase.feet.values()] == pytest.approx(
            [place[2] for place in wanted.feet.values()]
        )
    others = (
        [repr(key) for key in line.keys if key not in (jumped, asked)] for line in (halved, small)
    )
    assert next(others) == next(others)
    with pytest.raises(TimelineError, match="needs a dynamic block"):
        NOD.scale_jumps(0.5)


def test_backwards_a_motion_passes_the_same_places_and_twice_is_itself() -> None:
    path = Timeline().body_path([{"x": 0.02}, {"x": -0.02}, {"x": 0.0}], over=2.0)
    for line in (NOD, WAVE, path):
        there, back = plan_of(line), plan_of(line.reverse())
        for t in np.linspace(0.0, there.duration, 9).tolist():
            mirrored = curves_at(back, there.duration - t)[0]
            assert mirrored == pytest.approx(curves_at(there, t)[0], abs=BALANCE)
        assert FeasibilityChecker(MODEL).check(line.reverse()).ok
    down = Timeline(exit=Posture.SIT).posture("sit", over=1.5)
    up = down.reverse()
    assert (up.entry, up.exit) == (Posture.SIT, Posture.STAND)
    assert down.then(up).end == pytest.approx(3.0)
    for line in (NOD, WAVE):
        twice = line.reverse().reverse()
        assert written(twice) == written(line)


@pytest.mark.parametrize(
    "line",
    [
        Timeline().walk(0.2, turn=0.5, gait="trot"),
        Timeline().walk(0.1, 0.05).foot("FR", z=0.1, over=0.7).home(over=0.7).turn(0.4),
        Timeline().step("FL", 0.05, 0.02, yaw=0.1, over=0.5).walk(0.1, gait="trot"),
    ],
)
def test_backwards_every_foot_steps_to_where_it_came_from(line: Timeline) -> None:
    there, back = Footing(line, standing_feet(MODEL)), Footing(line.reverse(), standing_feet(MODEL))
    times = np.linspace(0.0, line.end, 200)
    x, y, yaw = line.end_pose
    R, p_end = yaw_rotation(yaw), np.array([x, y, 0.0])
    seen = p_end + back.at(times).p_feet @ R.T
    before = (line.end - times)[::-1]  # increasing
    assert seen[::-1] == pytest.approx(there.at(before).p_feet, abs=1e-9)
    frames = back.frames(times)
    assert (p_end[:2] + frames[:, :2] @ R[:2, :2].T)[::-1] == pytest.approx(
        there.frames(before)[:, :2], abs=1e-9
    )
    assert line.reverse().reverse().end_pose == pytest.approx(line.end_pose, abs=1e-9)
    assert FeasibilityChecker(MODEL).check(line.reverse()).ok


def test_a_loop_is_as_many_whole_rounds_as_fit() -> None:
    assert NOD.loop(until=5.0).end == pytest.approx(3 * 1.5)
    assert NOD.loop(until=3.0).end == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("write", "why"),
    [
        (lambda: NOD.body_path([{"x": 0.1}], over=1.0), "two points"),
        (lambda: NOD.body_path([{"x": 0.1}, {"y": 0.1}], over=1.0), "same channels"),
        (lambda: NOD.body_path([{"pich": 0.1}] * 2, over=1.0), "pitch"),
        (lambda: NOD.body_path([{"x": 0.1}] * 2, over=1.0, times=[0.5, 0.9]), "over=1"),
        (lambda: NOD.body_path([{"x": 0.1}] * 2, over=1.0, times=[1.0, 0.5]), "one after the"),
        (lambda: NOD.look_at(0.1, 0.0, 0.3, over=1.0), "farther"),
        (lambda: NOD.joint("FR", "calf", -2.0, over=1.0), "raise it first"),
        (lambda: WAVE.joint("FR", "calf", -2.0, over=1.0), "raise it first"),
        (lambda: WAVE.joint("FR", "claf", -2.0, over=1.0), "calf"),
        (lambda: NOD.body(x=0.01, over=1.0, ease=lambda s: 2 * s), "lead from 0 at 0"),
        (lambda: NOD.body(x=0.01, over=1.0, ease=lambda s: math.nan), "finite number"),
        (lambda: NOD.body(x=0.01, over=1.0, ease="minimum_jrek"), "minimum_jerk"),
        (lambda: NOD.scale_time(0.0), "above 0"),
        (lambda: NOD.scale_shifts(-1.0), "above 0"),
        (lambda: NOD.shift_height(3.0), "3"),
        (lambda: Timeline().body(z=0.01, over=1.0).shift_height(0.01), "two moves"),
        (lambda: Timeline().hold(1.0).shift_height(0.01), "two moves"),
        (lambda: NOD.jump(height=0.1).shift_height(0.01), "dynamic block"),
        (lambda: NOD.body(x=0.01, over=1.0).reverse(), "end at home"),
        (lambda: Timeline().step("FL", 0.05, over=0.5).home(over=1.0).reverse(), "FL ends 38 mm"),
        (lambda: Timeline().walk(0.1).jump(height=0.1).reverse(), "the whole robot.* no way back"),
        (lambda: NOD.loop(until=1.0), "less than the motion takes"),
        (lambda: Timeline().body(x=0.01, over=1.0, ease="hold").home(over=1.0).reverse(), "hold"),
    ],
)
def test_what_makes_no_sense_is_refused(write: object, why: str) -> None:
    assert callable(write)
    with pytest.raises(TimelineError, match=why):
        write()


def test_a_path_has_nothing_but_points() -> None:
    with pytest.raises((TimelineError, TypeCheckError), match="points"):
        NOD.body_path([{"x": 0.1}, 3], over=1.0)  # type: ignore[list-item]
