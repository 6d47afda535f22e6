"""The authoring language: cursor, tracks, joining, mirror images, and what it refuses."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.errors import TimelineError
from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_angles
from motions import Timeline, compile_timeline, deg
from motions.language.keys import BalanceShift, BodyKey, LegKey
from motions.language.timeline_data import SHIFT_TIME
from motions.plan.quasi_static import FootContacts
from motions.postures import home_poses
from tests.motions.plans import MODEL, curves_at, plan_of
from tests.script_server import python

HOME = home_poses(MODEL)[Posture.STAND]
EXACT = 1e-9
NEAR = 1e-6  # m, rad; of a spline through samples, at a sample


def test_calls_follow_each_other_and_at_puts_the_cursor_anywhere() -> None:
    line = Timeline().body(z=-0.05, over=0.8).hold(0.4).home(over=1.0)
    assert [(key.start, key.end) for key in line.keys] == [(0.0, 0.8), (0.8 + 0.4, 2.2)]
    assert line.end == pytest.approx(2.2)
    line = Timeline().body(z=-0.05, over=1.0).at(0.25).body(pitch=0.1, over=0.5)
    assert line.keys[1].start == 0.25
    beside = Timeline().body(z=-0.05, over=1.0).also().body(pitch=0.1, over=0.3)
    assert beside.keys[1].start == 0.0
    assert beside.cursor == 1.0  # not before the longer of the two has ended


def test_beats_are_seconds_by_the_tempo_also_for_the_shift_before_a_raise() -> None:
    line = Timeline().bpm(120.0).body(z=-0.05, over=2.0).hold(1.0).at(4.0).home(over=1.0)
    assert [(key.start, key.end) for key in line.keys] == [(0.0, 1.0), (2.0, 2.5)]
    line = Timeline(shift_time=0.5).foot("FR", z=0.05, over=0.5).home(over=0.5)
    slow = line.bpm(120.0, shift_time=3.0).foot("FL", z=0.05, over=1.0)
    first, _, second = slow.in_order(BalanceShift)
    assert first.end - first.start == 0.5
    assert second.end - second.start == pytest.approx(1.5)
    again = slow.home(over=1.0).bpm(100.0).foot("FR", z=0.05, over=1.0).in_order(BalanceShift)[-1]
    assert again.end - again.start == pytest.approx(0.6)  # a beat: the first that is 0.5 s or more


@pytest.mark.parametrize(
    ("tempo", "beats"), [(60.0, 1.0), (120.0, 2.0), (200.0, 3.0), (240.0, 4.0), (40.0, 1.0)]
)
def test_with_a_tempo_the_shift_before_a_raise_ends_on_a_beat(tempo: float, beats: float) -> None:
    line = Timeline().bpm(tempo).hold(1.0).foot("FR", z=0.05, over=1.0)
    (shift,), (up,) = line.in_order(BalanceShift), line.in_order(LegKey)
    beat = 60.0 / tempo
    assert shift.end - shift.start == pytest.approx(beats * beat)
    assert beats * beat + EXACT >= SHIFT_TIME > (beats - 1.0) * beat
    assert up.start == pytest.approx((1.0 + beats) * beat)


def test_then_repeats_and_together_move_keys_in_time() -> None:
    nod = Timeline().body(pitch=0.1, over=0.5).home(over=0.5)
    assert nod.repeat(3).end == pytest.approx(3.0)
    assert nod.then(nod).keys[2].start == pytest.approx(1.0)
    dip = Timeline().body(z=-0.03, over=0.8).home(over=0.8)
    both = Timeline().hold(1.0).together(nod, dip)
    assert both.end == pytest.approx(2.6)
    assert {key.start for key in both.keys} == {1.0, 1.5, 1.8}


def test_a_mirror_image_of_a_mirror_image_is_the_motion_itself() -> None:
    line = (
        Timeline()
        .body(y=0.02, roll=0.1, yaw=-0.1, pitch=0.05, over=0.5)
        .leg("FR", hip=-0.2, thigh=0.5, calf=-1.9, over=0.5)
        .foot("FR", x=0.1, y=0.05, z=0.1, over=0.5)
        .home(over=0.5)
    )
    assert line.mirror().mirror() == line
    assert line.mirror() != line
    a, b = plan_of(line), plan_of(line.mirror())
    for t in np.linspace(0.0, a.duration, 15):
        com, mirrored = a.at(float(t)).body.p_world, b.at(float(t)).body.p_world
        assert mirrored == pytest.approx(com * [1.0, -1.0, 1.0], abs=2e-3)
        assert b.at(float(t)).stance.tolist() == a.at(float(t)).stance[[1, 0, 3, 2]].tolist()


def test_a_raised_foot_is_a_swing_leg_and_the_trunk_moves_first() -> None:
    line = Timeline().foot("FL", z=0.1, over=0.6).hold(0.5).home(over=0.7)
    (shift, back), (up, down) = line.in_order(BalanceShift), line.in_order(LegKey)
    assert (shift.start, shift.end) == (0.0, SHIFT_TIME)
    assert shift.raised == {Leg.FL}
    assert up.start == SHIFT_TIME
    assert back.raised == frozenset()
    assert back.start == down.end
    schedule = FootContacts(line).schedule()
    assert schedule.at(up.start - 0.01).stance.all()
    assert schedule.at(up.start).stance.tolist() == [False, True, True, True]
    assert schedule.at(down.end).stance.all()


def test_the_com_is_inside_the_support_triangle_while_a_foot_is_up_and_only_with_balance() -> None:
    for balance in (True, False):
        line = Timeline(balance=balance).foot("FR", z=0.08, over=0.6).hold(0.4).home(over=0.6)
        plan, lifted = plan_of(line), line.in_order(LegKey)[0].start
        reference = plan.at(lifted + 0.6)
        feet = MODEL.p_base_feet_nominal[reference.stance, :2]
        assert len(feet) == 3
        margin = support_margin(feet, reference.body.p_world[:2])
        assert (margin > 0.06) if balance else (margin < 0.01)


def test_a_foot_passes_its_key_points() -> None:
    line = Timeline().foot("FR", x=0.05, y=-0.02, z=0.12, over=0.6).hold(0.5, name="up")
    plan = plan_of(line)
    start, end = plan.spans["up"]
    value, _, _ = curves_at(plan, (start + end) / 2)
    geometry = LegGeometry.of(MODEL, Leg.FR)
    p_base = foot_places(geometry, value[6:][Leg.FR.joints][None])[0]
    wanted = MODEL.p_base_feet_nominal[Leg.FR].copy() + [0.05, -0.02, 0.12]
    wanted[2] = MODEL.foot_radius + 0.12
    joints = value[6:18]
    base = value[:3] - MODEL.center_of_mass(np.concatenate([np.zeros(6), [1.0], joints]))
    assert p_base + base == pytest.approx(wanted, abs=1e-4)


def test_a_foot_is_put_down_with_speed_where_its_ease_says_so() -> None:
    """At rest it is nearly down long before: then a trunk that is 3 mm too low has it touch."""
    heights = []
    for ease in ("minimum_jerk", "in"):
        line = Timeline().foot("FR", z=0.08, over=0.6).down("FR", over=0.6, ease=ease)
        plan = plan_of(line)
        before, after = (plan.at(t).p_world_feet[Leg.FR, 2] for t in (line.end - 0.06, line.end))
        heights.append(before - after)
    at_rest, with_speed = heights
    assert at_rest < 0.001 < 0.01 < with_speed


def test_in_the_frame_of_the_body_a_raised_foot_goes_with_the_trunk() -> None:
    def paw(frame: str) -> np.ndarray:
        line = Timeline().foot("FR", z=0.1, over=0.6, frame=frame).body(z=-0.05, over=0.6)
        value, _, _ = curves_at(plan_of(line), line.end)
        return foot_places(LegGeometry.of(MODEL, Leg.FR), value[6:][Leg.FR.joints][None])[0]

    assert paw("ground")[2] - paw("body")[2] == pytest.approx(0.05, abs=1e-4)


def test_a_place_out_of_reach_is_a_problem_of_the_plan_and_no_near_miss() -> None:
    problems = plan_of(Timeline().foot("FR", x=0.9, z=0.1, over=1.0)).problems
    (problem,) = [item for item in problems if item.check == "way of a foot"]
    assert problem.subject == "FR"
    assert problem.miss > 0.3


def test_postures_join_stand_and_sit() -> None:
    line = Timeline(exit=Posture.SIT).posture("sit", over=1.5)
    up = Timeline(entry=Posture.SIT).posture("stand", over=1.5)
    value, _, _ = curves_at(plan_of(line.then(up)), 1.5)
    assert value[4] == pytest.approx(deg(-38.0), abs=NEAR)
    value, _, _ = curves_at(plan_of(line.then(up)), 3.0)
    assert value[3:6] == pytest.approx(np.zeros(3), abs=NEAR)


NOD = Timeline().body(pitch=0.1, over=0.5)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda: Timeline().body(pitch=15.0, over=1.0), r"looks like degrees: write deg\(15\)"),
        (lambda: Timeline().body(roll=3, over=1.0), r"write deg\(3\); 3 rad is 172 deg.* 90 at"),
        (lambda: Timeline().body(yaw=-2, over=1.0), r"yaw of -2 rad .*: write deg\(-2\)"),
        (lambda: Timeline().leg("FR", hip=2, thigh=1, calf=-2, over=1.0), r"hip of 2 .*deg\(2\)"),
        (lambda: Timeline().leg("FR", hip=0, thigh=60, calf=-2, over=1.0), r"write deg\(60\)"),
        (lambda: Timeline().leg("FR", hip=0, thigh=1, calf=-95, over=1.0), r"write deg\(-95\)"),
        (lambda: Timeline().body(z=80.0, over=1.0), "in millimetres"),
        (lambda: Timeline().body(z=-5.0, over=1.0), "in millimetres or centimetres.* or -0.05"),
        (lambda: Timeline().foot("FR", z=1.6, over=1.0), "z is 1.6 m, more than 1.5 m"),
        (lambda: Timeline().bpm(60.0, shift_time=0.0), "shift_time must be a number above 0"),
        (lambda: Timeline().body(over=1.0), "body.. needs one of x, y, z, roll, pitch, yaw"),
        (lambda: Timeline().body(z=0.1, over=0.0), "over must be a number above 0, got 0.0"),
        (lambda: Timeline().body(z=0.1, over=-1.0), "over must be a number above 0, got -1.0"),
        (lambda: Timeline().at(-1.0), "at.. needs a time of 0 s or later, got -1.0"),
        (lambda: Timeline().bpm(0.0), "bpm must be a number above 0"),
        (
            lambda: Timeline().foot("XX", z=0.1, over=1.0),
            "unknown foot 'XX'; valid: FL, FR, RL, RR",
        ),
        (lambda: Timeline().foot("FL", z=-0.1, over=1.0), "below the ground"),
        (lambda: Timeline().foot("FL", x=0.0, over=1.0), "on the ground already"),
        (lambda: Timeline().down("FL", over=1.0), "foot FL is not raised"),
        (lambda: Timeline().foot("FL", z=0.1, over=1.0, frame="moon"), "unknown frame 'moon'"),
        (lambda: NOD.body(z=0.1, over=1.0, ease="bouncy"), "unknown ease 'bouncy'; valid: "),
        (lambda: NOD.pose("yoga", over=1.0), "unknown pose 'yoga'; valid: bow, "),
        (lambda: NOD.posture("float", over=1.0), "unknown posture 'float'; valid: lie, sit, stand"),
        (lambda: NOD.at(0.2).body(pitch=0.2, over=1.0), "body pitch moves twice at once"),
        (lambda: NOD.then(NOD), "needs motions that end at home.*away: body pitch"),
        (lambda: NOD.repeat(0), "whole number of 1 or more, got 0"),
        (lambda: NOD.repeat(2), "needs motions that end at home"),
        (lambda: NOD.home(over=1.0).then(Timeline(entry=Posture.SIT)), "this ends in stand"),
        (lambda: compile_timeline(Timeline(), MODEL), "motion 'motion' is empty"),
    ],
)
def test_what_is_written_wrongly_is_refused_with_what_would_be_right(
    write: Callable[[], object], message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        write()


def test_what_moves_twice_at_once_is_refused_also_in_a_copy() -> None:
    line = replace(Timeline().body(z=-0.02, over=0.3).body(pitch=0.1, over=1.0))
    with pytest.raises(TimelineError, match="body pitch moves twice at once"):
        line.at(0.6).body(pitch=0.2, over=0.5)
    assert line.at(1.3).body(pitch=0.2, over=0.5).end == pytest.approx(1.8)


WRONG_TYPES = """
from motions import Timeline
for write in ('Timeline().then("bow")', "Timeline().together(7)", 'Timeline(entry="sit")'):
    try:
        eval(write)
    except Exception as error:
        print(type(error).__name__, error)
"""


def test_what_has_the_wrong_type_is_refused_with_what_would_be_right() -> None:
    """In a process of its own: here types are checked before that."""
    then, together, entry = python("-c", WRONG_TYPES).stdout.splitlines()
    assert then.startswith("TimelineError then() takes timelines, got 'bow'")
    assert then.endswith("load_motion('bow')")
    assert together == "TimelineError together() takes timelines, got 7"
    assert entry.startswith("TimelineError entry must be one of Posture.LIE, ")
    assert "from motions import Posture" in entry


@given(st.sampled_from(list(Leg)), st.lists(st.floats(0.05, 0.95), min_size=3, max_size=3))
def test_closed_form_angles_bring_the_foot_to_its_place(leg: Leg, share: list[float]) -> None:
    span = (MODEL.q_upper - MODEL.q_lower)[leg.joints]
    q = (MODEL.q_lower[leg.joints] + np.array(share) * span)[None]
    geometry = LegGeometry.of(MODEL, leg)
    place = foot_places(geometry, q)
    found = leg_angles(geometry, place)
    assert found.miss[0] < EXACT
    assert foot_places(geometry, found.q) == pytest.approx(place, abs=EXACT)
    whole = np.zeros(19)
    whole[6] = 1.0
    whole[7:][leg.joints] = q[0]
    assert MODEL.forward_kinematics(whole)[1][leg] == pytest.approx(place[0], abs=EXACT)


def test_a_robot_stands_with_its_angles_and_is_there_when_a_key_ends() -> None:
    value, _, _ = curves_at(plan_of(Timeline().body(z=-0.01, over=1.0).home(over=1.0)), 0.0)
    q = np.concatenate([HOME[:3], [0.0, 0.0, 0.0, 1.0], value[6:18]])
    _, feet = MODEL.forward_kinematics(q)
    assert feet[:, 2] == pytest.approx(np.full(4, MODEL.foot_radius), abs=NEAR)
    assert feet[:, :2] == pytest.approx(MODEL.p_base_feet_nominal[:, :2], abs=NEAR)
    line = Timeline().body(x=0.02, y=-0.01, z=-0.06, roll=0.1, pitch=-0.1, yaw=0.2, over=1.0)
    assert all(isinstance(key, BodyKey) for key in line.keys)
    value, rate, _ = curves_at(plan_of(line), 1.0)
    assert value[3:6] == pytest.approx([0.1, -0.1, 0.2], abs=NEAR)
    assert np.abs(rate).max() < NEAR
