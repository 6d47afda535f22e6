"""A plan that breaks a limit is refused, with the limit, the part, the time and the amount."""

import inspect

import numpy as np
import pytest

from go2_wbc.errors import CommandError, ConfigError, MotionInfeasible
from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import CheckedMotion, CompiledPlan, Timeline, check, compile_timeline, deg, load_motion
from motions import FeasibilityChecker as Checker
from motions.feasibility import FeasibilityReport
from motions.feasibility.forces import CREEP, DRY, VISCOUS, forces_of, resisted, state_at
from motions.plan.trajectory import trajectory_of
from tests.motions.doctored import (
    STRETCHED,
    DoctoredPlan,
    middle,
    with_body_aside,
    with_joint_beyond_its_limit,
    with_joint_too_fast,
)

STAND_HEIGHT = find_profile().stand_height

EXACT = 1e-6  # m, N, N m; of quantities that two ways of calculating give, one of them by a spline


@pytest.fixture(scope="module")
def good(model: RobotModel) -> CompiledPlan:
    return compile_timeline(load_motion("high_five", hold=1.0), model)


def failed(report: FeasibilityReport) -> set[str]:
    return {finding.check for finding in report.failures}


def test_a_good_plan_passes_and_one_that_is_not_a_number_does_not(
    good: CompiledPlan, checker: Checker
) -> None:
    report = checker.check(good)
    assert report.ok, report.table()
    report.raise_if_infeasible()
    assert all(finding.margin >= 0.0 for finding in report.margins.values())
    report = checker.check(DoctoredPlan(good, aside=float("nan")))
    assert not report.ok


def test_a_joint_beyond_its_limit_is_found_at_its_worst_instant(
    good: CompiledPlan, checker: Checker, model: RobotModel
) -> None:
    report = checker.check(with_joint_beyond_its_limit(good))
    (finding,) = [f for f in report.failures if f.check == "joint position"]
    limit = model.q_upper[Leg.FR.joints.stop - 1]
    assert finding.subject == "FR_calf"
    assert finding.unit == "rad"
    assert finding.limit == pytest.approx(limit)
    assert finding.value == pytest.approx(STRETCHED, abs=0.03)
    assert finding.margin <= limit - STRETCHED + 0.03
    assert finding.time == pytest.approx(middle(good), abs=0.02)
    with pytest.raises(MotionInfeasible, match="'high_five' is infeasible") as caught:
        report.raise_if_infeasible()
    assert str(finding) in str(caught.value)
    assert caught.value.findings == report.failures


def test_a_joint_that_is_too_fast_is_found(good: CompiledPlan, checker: Checker) -> None:
    report = checker.check(with_joint_too_fast(good))
    (finding,) = [f for f in report.failures if f.check == "joint speed"]
    assert finding.subject == "FR_thigh"
    assert finding.unit == "rad/s"
    assert finding.value > finding.limit == pytest.approx(30.1)
    assert "continuity" in failed(report)


@pytest.mark.parametrize("aside", [0.3, -0.3])
def test_a_com_outside_the_support_is_found(
    good: CompiledPlan, checker: Checker, aside: float
) -> None:
    report = checker.check(with_body_aside(good, aside))
    (finding,) = [f for f in report.failures if f.check == "support"]
    assert finding.subject == "CoM"
    assert finding.margin < -0.05
    assert finding.value < finding.limit


def test_a_com_off_the_triangle_is_found_only_while_a_paw_is_up(
    good: CompiledPlan, checker: Checker
) -> None:
    report = checker.check(with_body_aside(good, -0.095))
    (finding,) = [f for f in report.failures if f.check == "support"]
    assert not good.at(finding.time).stance.all()
    assert "foot load" in failed(report) or "contact wrench" in failed(report)


CAUSES = (
    ("numbers", "way of a foot", "reach"),
    (
        "joint position",
        "self-collision",
        "clearance",
        "dragging",
        "landing place",
        "flat landing",
        "entry and exit",
    ),
    ("balance", "support"),
    ("joint speed", "landing speed", "continuity"),
    ("support of ZMP", "contact wrench", "foot load", "lag", "tipping", "tracking", "friction")
    + ("slip", "torque", "torque at speed"),
)
"""Out of reach; postures the robot cannot take; places; balance; speed; forces."""


def rank(check: str) -> int:
    return next(place for place, checks in enumerate(CAUSES) if check in checks)


def test_causes_come_before_what_follows_from_them(good: CompiledPlan, checker: Checker) -> None:
    late = Timeline().body(z=-0.02, over=0.1, ease="hold").home(over=1.0).hold(1.0)
    late = late.body(z=0.18, over=1.0).home(over=1.0)
    for motion in (with_body_aside(good, 0.3), with_joint_too_fast(good), late):
        report = checker.check(motion)
        ranks = [rank(finding.check) for finding in report.failures]
        assert len(set(ranks)) >= 2
        assert ranks == sorted(ranks)
        assert [rank(name) for name in report.margins] == sorted(map(rank, report.margins))
        broken = [line[:16].strip() for line in report.table().splitlines() if line[70:72] == " x"]
        assert broken == list(dict.fromkeys(finding.check for finding in report.failures))
        with pytest.raises(MotionInfeasible) as caught:
            report.raise_if_infeasible()
        assert str(report.failures[0]) == str(caught.value).splitlines()[1].strip()
        for name in set(broken):
            times = [f.time for f in report.failures if f.check == name]
            assert times == sorted(times)
    # The jump of the trunk comes first, what is out of reach is the cause that is named first.
    assert report.failures[0].check == "way of a foot"
    assert report.failures[0].time > 1.0 > min(finding.time for finding in report.failures)


AWAY = {
    "reach": Timeline().body(z=0.18, over=1.0).home(over=1.0),
    "joint position": Timeline().body(z=-0.24, over=1.0).home(over=1.0),
    "continuity": Timeline().body(pitch=deg(18), over=0.03).home(over=0.03),
    "friction": Timeline().body(y=0.07, over=0.15).body(y=-0.07, over=0.15).home(over=0.2),
    "slip": Timeline().body(yaw=0.25, over=0.2).body(yaw=-0.25, over=0.2).home(over=0.3),
    "lag": Timeline().body(z=-0.1, over=0.6).body(z=0.02, over=0.11).home(over=0.6),
    "tracking": Timeline()
    .body(roll=deg(35), over=0.5)
    .body(roll=-deg(35), over=0.5)
    .home(over=0.5),
    "tipping": Timeline()
    .foot("RL", z=0.09, over=0.7)
    .body(z=-0.097, over=0.56)
    .body(z=0.097, over=0.56)
    .foot("RL", z=0.0, over=0.8)
    .home(over=0.9),
    "support": Timeline(balance=False).foot("FR", z=0.1, over=0.8).home(over=0.8),
    "landing speed": Timeline().foot("FR", z=0.15, over=0.6).foot("FR", over=0.1, ease="linear"),
    "flat landing": Timeline().foot("RR", x=-0.12, z=0.02, over=0.4).home(over=0.3),
    "dragging": Timeline()
    .foot("FR", x=0.1, z=0.0, over=0.6)
    .foot("FR", x=-0.1, z=0.0, over=0.6)
    .home(over=0.6),
    "clearance": Timeline().body(pitch=deg(35), z=-0.2, over=1.0).home(over=1.0),
    "entry and exit": Timeline().body(z=-0.08, over=1.0),
    "balance": Timeline().foot("FR", z=0.1, over=0.8).foot("RL", z=0.1, over=0.8),
}


@pytest.mark.parametrize("check", AWAY)
def test_what_the_robot_cannot_do_is_found_under_its_name(checker: Checker, check: str) -> None:
    report = checker.check(AWAY[check])
    assert check in failed(report), report.table()


def test_a_foot_that_moves_along_the_ground_is_found_and_one_that_rises_on_its_way_is_not(
    checker: Checker,
) -> None:
    line = Timeline().foot("FR", x=0.05, z=0.0, over=0.6).home(over=0.6)
    (finding,) = checker.check(line).warnings
    assert (finding.check, finding.subject, finding.unit) == ("dragging", "FR", "m")
    assert finding.value == pytest.approx(0.1, abs=1e-3)  # there, and back with home()
    for line in (
        Timeline().foot("FR", z=0.03, over=0.3).foot("FR", x=0.05, z=0.0, over=0.6),
        Timeline().foot("FR", x=0.1, z=0.03, over=0.6).foot("FR", x=0.1, z=0.05, over=0.6),
    ):
        report = checker.check(line)
        assert "dragging" not in failed(report) | {f.check for f in report.warnings}
    back = Timeline().foot("FR", z=0.03, over=0.3).foot("FR", x=0.05, over=0.6).home(over=0.6)
    (finding,) = checker.check(back).warnings
    assert finding.check == "dragging"
    assert finding.value == pytest.approx(0.05, abs=3e-3)  # and the last bit of the way down


def test_legs_that_cross_or_end_elsewhere_are_found_and_no_balance_has_no_number(
    checker: Checker,
) -> None:
    crossing = (
        Timeline().foot("FR", z=0.10, over=0.8).foot("FR", y=0.26, z=0.04, over=0.8).home(over=1.0)
    )
    (finding,) = [f for f in checker.check(crossing).failures if f.check == "self-collision"]
    assert "FL" in finding.subject
    assert "FR" in finding.subject
    report = checker.check(AWAY["balance"])
    (finding,) = [f for f in report.failures if f.check == "balance"]
    assert "nan" not in str(finding)
    assert "two feet cannot balance the trunk" in str(finding)
    assert "nan" not in report.table()
    for line in (
        Timeline(entry=Posture.LIE).body(z=0.0, roll=0.01, over=1.0),
        Timeline(exit=Posture.SIT).body(z=-0.05, over=1.0).home(over=1.0),
    ):
        assert "entry and exit" in failed(checker.check(line))


def test_a_name_of_the_library_may_be_checked_and_nothing_else(checker: Checker) -> None:
    assert checker.check("bow").motion == "bow"
    with pytest.raises(CommandError, match="unknown motion 'bows'; valid: beckon, bow"):
        checker.check("bows")
    for ask in (Checker.check, Checker.evaluate, Checker.plan):
        with pytest.raises(CommandError, match=r"motion must be a name of the library.* got 3"):
            inspect.unwrap(ask)(checker, 3)  # past the checks of types


@pytest.mark.parametrize(("exit", "way"), [(Posture.STAND, "home()"), (Posture.SIT, "'sit')")])
def test_a_motion_that_ends_elsewhere_is_told_what_ends_it(
    checker: Checker, exit: Posture, way: str
) -> None:
    (finding,) = checker.check(Timeline(exit=exit).body(z=-0.03, over=0.5)).failures[:1]
    assert str(finding).endswith(f"{way})")
    home = checker.check(Timeline().body(z=-0.03, over=0.5).home(over=0.5))
    assert "home()" not in home.table()


def test_the_feet_of_a_resting_robot_carry_its_weight_with_the_torques_of_statics(
    model: RobotModel,
) -> None:
    plan = compile_timeline(Timeline().body(z=-0.001, over=5.0).home(over=5.0), model)
    path = trajectory_of(plan, model)
    forces = forces_of(path, model)
    weight = model.mass * model.gravity
    assert forces.contact[0, :, 2].sum() == pytest.approx(weight, abs=1e-2)
    assert forces.missing.max() < 1e-2
    assert forces.zmp[0] == pytest.approx(path.p_com[0, :2], abs=1e-4)
    assert path.p_com[0, 2] == pytest.approx(STAND_HEIGHT, abs=EXACT)


def test_a_trajectory_is_where_the_plan_wants_it_and_obeys_the_equations_of_motion(
    good: CompiledPlan, model: RobotModel
) -> None:
    path = trajectory_of(good, model)
    for row in range(0, len(path.times), 25):
        reference = good.at(float(path.times[row]))
        com, feet = model.forward_kinematics(path.q[row])
        assert com == pytest.approx(reference.body.p_world, abs=EXACT)
        stands = reference.stance
        assert feet[stands] == pytest.approx(path.p_feet[0, stands], abs=EXACT)
        raised = ~np.repeat(stands, 3)
        assert path.q[row, 7:][raised] == pytest.approx(reference.q_joints[raised], abs=EXACT)
    forces, last = forces_of(path, model), len(path.times) - 1
    for row in range(0, len(path.times), 40):
        near = [min(max(k, 0), last) for k in (row - 1, row, row + 1)]
        needed = [model.inverse_dynamics(path.q[k], path.v[k], path.a[k]) for k in near]
        generalised = np.mean(needed, axis=0)  # what the ground gives over 30 ms
        snapshot = model.snapshot(state_at(path, row))
        applied = snapshot.J_contacts.reshape(12, 18).T @ forces.contact[row].ravel()
        residual = generalised - applied
        assert np.abs(residual[:6]).max() < 0.01  # N; the evenness of the load takes its share
        assert residual[6:] == pytest.approx(forces.tau[row], abs=EXACT)


def test_a_table_fits_80_columns_and_names_every_check(
    good: CompiledPlan, checker: Checker
) -> None:
    report = checker.check(good)
    lines = report.table().splitlines()
    assert max(map(len, lines)) <= 80
    assert all(any(line.startswith(check) for line in lines) for check in report.margins)
    for series in report.series:
        if (finding := report.margins.get(series.check)) is not None:
            assert np.nanmin(series.least_margins()) == pytest.approx(finding.margin)
    assert "can do it" in lines[-2]
    assert lines[-1].startswith("Chance that it is done so: ")


_WEIGHT_TOLERANCE = 1.0  #: [N] What the even share of the load takes away from the wrench, at rest
_UNLOADED = 1e-3  #: [N] Solver's tolerance at a bound


@pytest.fixture(scope="module")
def high_five(checker: Checker) -> CheckedMotion:
    return checker.evaluate(load_motion("high_five"))


def test_it_has_the_report_that_check_gives(checker: Checker, high_five: CheckedMotion) -> None:
    assert high_five.report.as_dict() == checker.check("high_five").as_dict()


def test_at_rest_forces_carry_the_weight_and_the_com_keeps_its_margin_over_the_feet(
    checker: Checker, high_five: CheckedMotion
) -> None:
    run = high_five.recording()
    weight = checker.model.mass * checker.model.gravity
    held = run.labels.index("held") + 30
    for row in (0, held, -1):
        assert run.foot_forces[row].sum() == pytest.approx(weight, abs=_WEIGHT_TOLERANCE)
    assert run.foot_forces.min() > -_UNLOADED
    np.testing.assert_allclose(run.foot_forces[~run.stance], 0.0, atol=_UNLOADED)
    assert not run.stance[held, Leg.FR]
    assert run.stance[held].sum() == 3
    for row in (0, len(run.time) // 2, -1):
        com, feet = checker.model.forward_kinematics(run.q[row])
        expected = support_margin(feet[run.stance[row], :2], com[:2])
        assert run.support_margin[row] == pytest.approx(expected, abs=1e-4)
        assert expected > 0.0


def test_labels_are_the_names_of_holds_or_the_feet_in_the_air(high_five: CheckedMotion) -> None:
    assert set(high_five.recording().labels) == {"on four feet", "FR up", "held"}


def test_two_raised_feet_have_no_margin(checker: Checker) -> None:
    line = Timeline(balance=False).foot("FR", z=0.05, over=0.4).foot("RL", z=0.05, over=0.4)
    run = checker.evaluate(line.home(over=0.5)).recording()
    both = np.array([label == "FR and RL up" for label in run.labels])
    assert both.any()
    assert np.isnan(run.support_margin[both]).all()
    assert np.isfinite(run.support_margin[~both]).all()


SWAY = Timeline().body(y=0.03, over=0.5).home(over=0.5)


def test_feet_carry_a_payload_too_that_moves_the_centre_of_mass_over_them(
    model: RobotModel,
) -> None:
    world = World(payload=3.0, mass_scale=1.05)
    checked = Checker(model, world=world).evaluate(SWAY)
    weight = (1.05 * model.mass + 3.0) * model.gravity
    assert checked.forces.contact[0, :, 2].sum() == pytest.approx(weight, abs=0.05)
    line = Timeline().foot("FR", z=0.06, over=0.6).hold(0.2).home(over=0.6)
    margins = [
        Checker(model, world=world).check(line).margins["support"].value
        for world in (World(), World(payload=4.0, payload_place=(0.2, 0.0, 0.0)))
    ]
    # The CoM comes forward by 4 / 20.1 of 0.2 m, less what it lies ahead of the payload's place.
    assert 0.01 < margins[0] - margins[1] < 0.05


def test_what_is_uncertain_of_mass_and_floor_counts_at_its_worst(model: RobotModel) -> None:
    worlds = (World(), World(mass_uncertainty=0.2), World(mass_scale=1.2))
    torques = [Checker(model, world=world).check(SWAY).margins["torque"].value for world in worlds]
    assert torques[0] < torques[1] == pytest.approx(torques[2], rel=1e-9)
    world = World(friction=0.5, friction_uncertainty=0.2)
    margin = Checker(model, world=world).check(SWAY).margins["friction"]
    assert margin.limit == pytest.approx(0.4)


def test_joint_friction_asks_more_of_the_motors(model: RobotModel) -> None:
    path = Checker(model).evaluate(SWAY).path
    forces = forces_of(path, model)
    more = resisted(forces, path, World(joint_friction=2.0)).tau - forces.tau
    v = path.v[:, 6:]
    quick = np.abs(v) > 0.3
    assert quick.any()
    assert more[quick] == pytest.approx(
        2.0 * (DRY * np.tanh(v / CREEP) + VISCOUS * v)[quick], abs=2e-3
    )
    assert np.abs(more[v == 0.0]).max(initial=0.0) == 0.0


def test_a_slippery_floor_is_refused_and_a_world_out_of_range_told() -> None:
    usual, slippery = check("wiggle"), check("wiggle", friction=0.05)
    assert usual.ok
    assert "holds for" not in usual.table()
    assert "slip" in {finding.check for finding in slippery.failures}
    assert "That holds for friction 0.05." in slippery.table()
    loaded = check(SWAY, payload=3.0, world=World(friction=0.6))
    assert loaded.world == World(friction=0.6, payload=3.0)
    assert loaded.as_dict()["world"]["payload"] == 3.0
    with pytest.raises(ConfigError, match=r"World\.friction must be between 0\.0001 and 2, got 9"):
        check(SWAY, friction=9.0)


def test_the_table_is_narrow_in_every_world_and_says_what_no_limit_counts_with() -> None:
    world = World(
        friction_uncertainty=0.1,
        payload=2.0,
        payload_place=(0.1, 0.0, 0.06),
        mass_uncertainty=0.05,
        joint_friction_uncertainty=0.5,
        sensors="imu",
    )
    text = check(SWAY, world=world).table()
    assert max(map(len, text.splitlines())) <= 80
    assert str(world) in text.replace("\n", " ")
    assert "simulated only" in text
    assert "simulated only" not in check(SWAY, payload=2.0).table()


def test_a_load_that_brings_the_com_inside_does_not_help_a_controller_that_feels_it() -> None:
    # The robot shifts the CoM back to where it is without the load, and fell (MuJoCo, 5 of 5).
    line = Timeline(balance=False).foot("FR", z=0.05, over=0.8).home(over=1.0)
    without = Checker().check(line).margins["support"]
    assert without.margin < 0.0
    world = World(payload=4.0, payload_place=(-0.08, 0.04, 0.05))
    assert Checker(world=world).check(line).margins["support"].value <= without.value
