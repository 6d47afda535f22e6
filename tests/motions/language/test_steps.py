"""Steps: where feet land, what counts from there, and that the robot does it."""

from collections.abc import Callable

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Anchor
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from motions import CompiledPlan, FeasibilityChecker, Timeline, deg
from motions.language.keys import StepKey
from motions.plan.trajectory import trajectory_of
from motions.postures import standing_feet
from tests.motions.plans import MODEL, plan_of

CHECKER = FeasibilityChecker(MODEL)
NOMINAL = standing_feet(MODEL)
EXACT = 1e-6  # m, rad; of a spline through samples
PLACED = 0.015  # m; how near its place a foot lands in simulation
ENDED, HEADED = 0.05, deg(4)  # m, rad; how near a walk ends to where it was to end


def last_feet(line: Timeline) -> np.ndarray:
    return trajectory_of(plan_of(line), MODEL).p_feet[-1]


def feasible(line: Timeline) -> CompiledPlan:
    """The plan of a motion that the check lets pass."""
    plan = plan_of(line)
    CHECKER.check(plan).raise_if_infeasible()
    return plan


def failures(line: Timeline) -> set[str]:
    return {finding.check for finding in CHECKER.check(line).failures}


def played(plan: CompiledPlan) -> tuple[Anchor, np.ndarray]:
    """The frame of the feet before, and where they are in it afterwards."""
    with GO2Controller() as go2:
        go2.stand()
        anchor = Anchor.of_feet(MODEL.snapshot(go2.state).p_world_feet, MODEL.foot_radius)
        assert go2.play(plan), go2.last_outcome
        feet = MODEL.snapshot(go2.state).p_world_feet
    return anchor, (feet - anchor.p_world) @ yaw_rotation(anchor.yaw)


def test_a_foot_lands_where_its_step_says_and_is_put_down_where_it_stands_by_then() -> None:
    feet = last_feet(Timeline().step("FL", 0.06, 0.03, over=0.6).home(over=0.8))
    moved = np.array([[0.06, 0.03, 0.0], *np.zeros((3, 3))])
    assert feet - NOMINAL == pytest.approx(moved, abs=EXACT)
    line = Timeline().step("FR", 0.05, -0.02, over=0.5)
    line = line.foot("FR", x=0.03, z=0.08, over=0.5).down("FR", over=0.5).home(over=0.8)
    assert last_feet(line)[Leg.FR] - NOMINAL[Leg.FR] == pytest.approx([0.05, -0.02, 0], abs=EXACT)


def test_a_robot_that_steps_lands_the_foot_where_the_step_says() -> None:
    plan = feasible(Timeline().step("FL", 0.06, 0.03, over=0.6).home(over=0.8))
    _, feet = played(plan)
    planned = plan.at(plan.duration).p_world_feet[Leg.FL]
    assert np.linalg.norm((feet[Leg.FL] - planned)[:2]) < PLACED


def test_home_and_offsets_count_from_the_feet_as_they_stand_by_then() -> None:
    line = Timeline()
    for leg in LEGS:
        line = line.step(leg, 0.05, over=0.4)
    plan = plan_of(line.home(over=0.8))
    start, end = plan.at(0.0).body.p_world, plan.at(plan.duration).body.p_world
    assert plan.end_pose == pytest.approx((0.05, 0.0, 0.0), abs=EXACT)
    assert end - start == pytest.approx([0.05, 0.0, 0.0], abs=EXACT)
    line = Timeline().turn(deg(90), gait="trot").body(x=0.03, over=0.5)
    line = line.foot("FR", x=0.05, z=0.08, over=0.5)
    plan, turned = plan_of(line), yaw_rotation(deg(90)) @ np.array([0.05, 0.0, 0.08])
    place = yaw_rotation(deg(90)) @ NOMINAL[Leg.FR]
    raised = trajectory_of(plan, MODEL).p_feet[-1][Leg.FR]
    assert raised - place == pytest.approx(turned, abs=EXACT)


def test_a_step_may_go_round_the_feet_but_not_out_of_reach() -> None:
    line = Timeline().step("RR", yaw=deg(10), over=0.5).home(over=0.8)
    p, turned = NOMINAL[Leg.RR], last_feet(line)[Leg.RR]
    assert np.arctan2(turned[1], turned[0]) - np.arctan2(p[1], p[0]) == pytest.approx(deg(10))
    assert "way of a foot" in failures(Timeline().step("FL", 0.5, over=1.0).home(over=0.8))


@pytest.mark.parametrize("gait", ["walk", "trot"])
@pytest.mark.parametrize(
    ("write", "end"),
    [
        (lambda line, gait: line.walk(0.3, -0.05, deg(20), gait=gait), (0.3, -0.05, deg(20))),
        (lambda line, gait: line.turn(deg(-50), gait=gait), (0.0, 0.0, deg(-50))),
        (lambda line, gait: line.side_step(0.12, gait=gait), (0.0, 0.12, 0.0)),
        (lambda line, gait: line.path([(0.2, 0.0), (0.3, 0.1)], gait=gait), (0.3, 0.1, None)),
        (lambda line, gait: line.path([(0.2, 0.1, deg(15))], gait=gait), (0.2, 0.1, deg(15))),
        (lambda line, gait: line.walk(over=4.0, gait=gait), (0.0, 0.0, 0.0)),
    ],
    ids=["walk", "turn", "side_step", "path", "path with headings", "on the spot"],
)
def test_a_way_ends_where_it_says_on_feet_below_their_hips_and_is_feasible(
    gait: str, write: Callable[[Timeline, str], Timeline], end: tuple[float, float, float | None]
) -> None:
    line = write(Timeline(), gait)
    x, y, yaw = line.end_pose
    assert (x, y) == pytest.approx(end[:2], abs=EXACT)
    assert end[2] is None or yaw == pytest.approx(end[2], abs=EXACT)
    report = CHECKER.check(line)
    assert report.ok, report.table()
    plan = plan_of(line)
    assert plan.end_pose == pytest.approx(line.end_pose, abs=EXACT)
    square = np.array([x, y, 0.0]) + NOMINAL @ yaw_rotation(yaw).T
    assert plan.at(plan.duration).p_world_feet == pytest.approx(square, abs=EXACT)


def test_paths_head_where_they_go_and_the_next_motion_goes_on_from_there() -> None:
    line = Timeline().path([(0.3, 0.0), (0.5, 0.2), (0.5, 0.5)], gait="trot")
    plan = plan_of(line)
    yaw = plan.end_pose[2]
    rate = trajectory_of(plan, MODEL).q[:, :2]
    way = rate[-60] - rate[-100]
    assert yaw == pytest.approx(np.arctan2(way[1], way[0]), abs=0.3)
    first = Timeline().walk(0.2, 0.1, deg(60), gait="trot")
    line = first.then(first, Timeline().body(z=-0.03, over=0.5).home(over=0.5))
    p, yaw = np.array([0.2, 0.1, 0.0]), deg(60)
    p = p + yaw_rotation(yaw) @ p
    assert line.end_pose == pytest.approx((p[0], p[1], 2 * yaw), abs=EXACT)
    assert CHECKER.check(line).ok


def test_a_walk_is_mirrored_and_scaled_in_time_and_size() -> None:
    line = Timeline().walk(0.2, 0.1, deg(30)).step("FL", 0.03, 0.02, over=0.5).home(over=1.0)
    x, y, yaw = line.end_pose
    assert line.mirror().end_pose == pytest.approx((x, -y, -yaw), abs=EXACT)
    assert line.mirror().mirror() == line
    line = Timeline().hold(0.5).walk(0.2, gait="trot")
    assert line.scale_time(2.0).end == pytest.approx(2.0 * line.end)
    assert line.scale_time(2.0).end_pose == pytest.approx(line.end_pose, abs=EXACT)
    assert line.scale(0.5).end_pose == pytest.approx((0.1, 0.0, 0.0), abs=EXACT)


@pytest.mark.parametrize(("gait", "tempo"), [("walk", 120.0), ("trot", 120.0), ("trot", 100.0)])
def test_with_a_tempo_feet_land_on_beats_or_halves_of_them(gait: str, tempo: float) -> None:
    line = Timeline().bpm(tempo).walk(0.24, gait=gait)
    landings = np.array([key.end for key in line.in_order(StepKey)]) * tempo / 60.0
    assert 2.0 * landings == pytest.approx(np.round(2.0 * landings), abs=EXACT)
    beats = line.end * tempo / 60.0
    assert beats == pytest.approx(round(beats))


def test_a_walk_takes_its_time_while_the_trunk_sways_and_leans() -> None:
    line = Timeline().hold(0.5).walk(0.24, over=8.0)
    assert line.end == pytest.approx(8.5)
    assert CHECKER.check(line).ok
    walk = Timeline().walk(0.24)
    lean = Timeline().body(roll=deg(6), z=-0.03, over=walk.end / 2).home(over=walk.end / 2)
    line = Timeline().together(walk, lean)
    assert CHECKER.check(line).ok
    assert plan_of(line).end_pose == pytest.approx((0.24, 0.0, 0.0), abs=EXACT)


def test_a_trot_long_on_two_feet_or_off_their_line_is_refused() -> None:
    line = Timeline().walk(0.2, gait="trot")
    assert not failures(line)
    assert "support" in failures(line.scale_time(2.0))
    beside = Timeline().body(y=0.05, over=0.5)
    line = beside.together(Timeline(balance=False).walk(0.2, gait="trot")).home(over=0.8)
    assert "support of ZMP" in failures(line)


def test_a_motion_that_goes_anywhere_says_where_it_ends_above_its_feet() -> None:
    line = Timeline().walk(0.2, gait="trot")
    report = CHECKER.check(line)
    assert report.table().endswith("It ends at x 0.200 m, y 0.000 m, turned by 0.0 deg.")
    assert report.as_dict()["end_pose"] == pytest.approx(line.end_pose, abs=EXACT)
    stays = Timeline().body(z=-0.01, over=0.5).home(over=0.5)
    assert "It ends" not in CHECKER.check(stays).table()
    assert "entry and exit" in failures(Timeline().walk(0.1, gait="trot").body(x=0.05, over=0.5))


def test_a_robot_ends_a_trot_with_turns_and_a_raised_paw_where_it_was_to_end() -> None:
    line = Timeline().walk(0.3, gait="trot").turn(deg(60), gait="trot")
    line = line.foot("FR", x=0.05, z=0.1, over=0.6).home(over=0.6).side_step(0.1, gait="trot")
    plan = feasible(line)
    _, feet = played(plan)
    ended, (x, y, yaw) = Anchor.of_feet(feet, MODEL.foot_radius), plan.end_pose
    assert np.hypot(ended.p_world[0] - x, ended.p_world[1] - y) < ENDED
    assert abs(wrap_angle(ended.yaw - yaw)) < HEADED


def test_a_robot_walks_with_one_foot_after_the_other() -> None:
    plan = feasible(Timeline().walk(0.12, turn=deg(10)))
    _, feet = played(plan)
    wanted = plan.at(plan.duration).p_world_feet
    assert np.linalg.norm((feet - wanted)[:, :2], axis=1).max() < PLACED


UP = Timeline().foot("FL", z=0.05, over=0.5)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda: UP.step("FL", 0.05, over=0.5), r"step\(\): foot FL is raised: put it down\(\)"),
        (lambda: UP.walk(0.5), r"walk\(\): foot FL is raised: put it down\(\) before"),
        (lambda: Timeline().step("XX", 0.05, over=0.5), "unknown foot 'XX'; valid: FL, FR, RL, RR"),
        (lambda: Timeline().step("FL", 60, over=0.5), "x is 60 m, more than 1.5 m"),
        (lambda: Timeline().step("FL", 0.05, over=0.0), "over must be a number above 0"),
        (lambda: Timeline().step("FL", 0.05, over=0.5, height=0.0), "height must be a number"),
        (lambda: Timeline().walk(500.0), "x is 500 m, more than 20 m"),
        (lambda: Timeline().turn(90), r"turn of 90 rad looks like degrees: write deg\(90\)"),
        (lambda: Timeline().walk(), r"walk\(\) needs x, y or turn: where to; or over"),
        (lambda: Timeline().side_step(0.0), r"side_step\(\) needs y"),
        (
            lambda: Timeline().turn(0.3, over=1.0),
            r"turn\(\): 1.00 s are too short: 1 round of gait 'walk' takes",
        ),
        (lambda: Timeline().walk(0.5, gait="trott"), "unknown gait 'trott'; valid: trot, walk"),
        (lambda: Timeline().walk(2.0, over=1.0), "1.00 s are too short: 17 rounds of gait 'walk'"),
        (lambda: Timeline().walk(2.0, over=-1.0), "over must be a number above 0, got -1.0"),
        (lambda: Timeline().path([]), r"path\(\) needs points \(x, y\), or all of them"),
        (lambda: Timeline().path([(0.0, 0.0)]), r"path\(\): point 0 is where the one before it is"),
        (lambda: Timeline().path([(0.5, 0.0), (1.0, 0.0, 0.1)]), r"path\(\) needs points"),
        (lambda: Timeline().path([(0.5, float("nan"))]), "y must be a finite number"),
    ],
)
def test_what_makes_no_sense_is_refused_while_it_is_written(
    write: Callable[[], Timeline], message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        write()


def test_a_foot_that_another_part_has_raised_does_not_step() -> None:
    line = UP.hold(1.0).at(1.5).together(Timeline(balance=False).step("FL", 0.05, over=0.4))
    with pytest.raises(TimelineError, match=r"foot FL is raised when it shall step at 1\.50 s"):
        plan_of(line)
