"""Friction that a motion needs, how far feet slide, and how far the trunk lags."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.trajectory_loads import lag, least_friction, slide
from motions import FeasibilityChecker, Timeline, deg
from motions.feasibility.forces import (
    CONTACT_RATE,
    HELD,
    cone,
    creep,
    numbers_of,
    scale_of_wrench,
    slip,
    state_at,
)
from tests.engine_helpers import standing_q, state_of
from tests.motions.feasibility.cases import case_of

BISECTION = 1.5 / 2**7  # what is left of the interval
INSIDE = 0.02  # of a cone whose pyramid of 16 facets lies inside of it
TOLERANCE = 0.05  # N; of the wrench


def least(model: RobotModel, forces: np.ndarray) -> float:
    """The least friction coefficient for the wrench of ``forces`` on a standing robot."""
    q = standing_q()
    J = model.snapshot(state_of(q, np.zeros(18))).J_contacts[:, :, :6]
    wrench = np.einsum("kij,ki->j", J, forces)
    found = np.zeros(1)
    given = (q[None, 7:].copy(), np.eye(3)[None], wrench[None], np.ones((1, 4)))
    tables = (leg_table(model), cone(), scale_of_wrench(), numbers_of(model))
    least_friction(*given, *tables, np.array([1.5]), TOLERANCE, found)
    return float(found[0])


@pytest.mark.parametrize("heading", [0.0, 0.4, np.pi / 4, 1.9, 4.0])
@pytest.mark.parametrize("friction", [0.2, 0.45])
def test_friction_is_a_cone_and_the_least_of_it_is_found(
    model: RobotModel, heading: float, friction: float
) -> None:
    # All feet pull the same way at the same ratio: no other share needs less, since the sums of
    # their forces have that ratio too.
    normal = np.array([30.0, 50.0, 45.0, 33.0])
    pull = friction * normal[:, None] * [np.cos(heading), np.sin(heading)]
    found = least(model, np.column_stack([pull, normal]))
    assert friction - BISECTION <= found <= (1.0 + INSIDE) * friction + BISECTION


def test_feet_that_pull_against_each_other_need_no_friction(model: RobotModel) -> None:
    forces = np.tile([0.0, 0.0, 40.0], (4, 1))
    forces[:2, 0], forces[2:, 0] = 15.0, -15.0
    assert least(model, forces) < 0.1


def test_a_foot_slides_as_a_block_does() -> None:
    mass, friction, dt, push, weight = 2.0, 0.5, 1e-4, 30.0, 40.0
    forces = np.zeros((4000, 4, 3))
    forces[:, :, 2] = weight
    forces[:1000, 0, 0] = push  # 0.1 s of 10 N more than friction holds
    forces[:1000, 1, 1] = 0.99 * friction * weight
    forces[:1000, 2, 1] = -push
    counts = np.ones((4000, 4), dtype=bool)
    counts[2000:, 2] = False
    ways = np.zeros((4000, 4))
    creeps = np.zeros((4000, 4, 2))
    creeps[:, 3] = 0.03, -0.04
    slide(forces, creeps, counts, friction, mass, dt, ways)
    speed = (push - friction * weight) / mass * 0.1
    expected = 0.5 * speed * 0.1 + speed**2 * mass / (2.0 * friction * weight)
    assert ways[-1, 0] == pytest.approx(expected, rel=1e-2)
    assert ways[-1, 1] == 0.0
    assert ways[-1, 3] == pytest.approx(0.05 * 4000 * dt)
    assert ways[1999, 2] == pytest.approx(expected, rel=1e-2)
    assert ways[2000:, 2].max() == 0.0


def test_joints_hold_a_foot_that_lacks_little(
    checker: FeasibilityChecker, model: RobotModel
) -> None:
    checked = checker.evaluate(Timeline().body(z=-0.001, over=1.0).home(over=1.0))
    for lacks, slides in ((0.9 * HELD, False), (2.0 * HELD, True)):
        forces = np.zeros_like(checked.forces.contact)
        forces[:, 0] = 2.5 + lacks, 0.0, 5.0
        given = replace(checked.forces, contact=forces)
        series = slip(case_of(checked.path, model, given))
        assert (series.values[:, 0].max() > 0.1) == slides


def test_a_lasting_push_is_held_by_the_gains_and_a_short_one_forgotten() -> None:
    pushes = np.zeros((4000, 2))
    pushes[:, 0], pushes[:10, 1] = 2.0, 2.0
    errors = np.zeros(pushes.shape)
    lag(pushes, np.array([100.0, 100.0]), np.array([20.0, 20.0]), 1e-3, errors)
    assert errors[-1, 0] == pytest.approx(0.02, rel=1e-3)
    assert 0.0 < errors[:, 1].max() < 0.02 * 0.05
    assert errors[-1, 1] == pytest.approx(0.0, abs=1e-6)


def moved(line: Timeline, values: Mapping[str, float], over: float) -> Timeline:
    return line.body(**values, over=over, ease="minimum_jerk")


def to_and_fro(channel: str, size: float, over: float, times: int = 2) -> Timeline:
    line = Timeline()
    for _ in range(times):
        line = moved(moved(line, {channel: size}, over), {channel: -size}, over)
    return line.home(over=over)


def test_a_twist_that_slips_is_refused(checker: FeasibilityChecker) -> None:
    # 69 mm on friction 0.5 in MuJoCo; the pyramid's diagonal gave 0.64.
    report = checker.check(to_and_fro("yaw", 0.268, 0.252))
    assert {finding.check for finding in report.failures} >= {"slip"}


@pytest.mark.parametrize(("size", "over"), [(0.016, 0.28), (0.022, 0.35)])
def test_a_sway_that_slips_by_less_than_a_millimetre_passes(
    checker: FeasibilityChecker, size: float, over: float
) -> None:
    # 0.3 and 0.5 mm; the controller's share of the load needs 0.56 and 0.48 for a moment.
    report = checker.check(to_and_fro("y", size, over))
    assert report.ok, report.table()
    assert report.margins["slip"].value < 0.005


@pytest.mark.parametrize(("size", "over"), [(0.25, 0.2), (0.286, 0.247)])
def test_a_quick_roll_that_is_done_passes(
    checker: FeasibilityChecker, size: float, over: float
) -> None:
    # Refused for the trunk's turning alone (continuity), though it slips 1.4 mm.
    report = checker.check(to_and_fro("roll", size, over))
    assert report.ok, report.table()


def test_feet_creep_by_what_contacts_leave_out(checker: FeasibilityChecker) -> None:
    path = checker.evaluate(to_and_fro("roll", 0.371, 0.130)).path
    found, model = creep(path, checker.model), checker.model
    for row in range(0, len(path.times), 7):
        J_a = model.snapshot(state_at(path, row)).J_contacts @ path.a[row]
        np.testing.assert_allclose(found[row], -J_a[:, :2] / CONTACT_RATE, atol=1e-12)
    assert np.abs(found).max() > 0.01


def test_a_fast_roll_that_creeps_is_refused_on_any_floor(checker: FeasibilityChecker) -> None:
    # 13.1 mm in MuJoCo, with friction 0.5 and with 2; it needs no more than 0.07.
    line = to_and_fro("roll", 0.371, 0.130, times=4)
    slip = checker.check(line).margins["slip"]
    assert slip.value == pytest.approx(0.0131, rel=0.15)


def test_an_unloading_for_a_moment_passes_and_a_flight_does_not(
    checker: FeasibilityChecker,
) -> None:
    def rise(over: float) -> Timeline:
        line = Timeline().body(z=-0.114, over=0.6).body(z=0.02, over=over)
        return line.body(z=-0.114, over=over).home(over=0.6)

    short, flight = checker.check(rise(0.265)), checker.check(rise(0.15))
    assert short.ok, short.table()
    assert short.margins["contact wrench"].value > 5.0  # but so briefly that it moves nothing
    assert "lag" in {finding.check for finding in flight.failures}


def test_a_joint_at_its_stop_is_refused_by_what_it_moves(checker: FeasibilityChecker) -> None:
    # The calves are asked for 0.1 rad too much in the first: it is done in MuJoCo, 12 mm off.
    def nose_up(angle: float, z: float) -> Timeline:
        return Timeline().body(pitch=-deg(angle), z=z, over=1.0).hold(0.3).home(over=1.0)

    little = checker.check(nose_up(22.0, 0.04)).margins["joint position"]
    assert little.value > little.limit
    assert little.margin == 0.0
    assert checker.check(nose_up(28.0, 0.04)).margins["joint position"].margin < 0.0


def test_a_knee_that_folds_no_farther_moves_less_than_one_too_short(
    checker: FeasibilityChecker,
) -> None:
    # In MuJoCo the first is done, 11 mm off; 22 mm are asked too much. The other is 26 mm off.
    sit = Timeline().posture("sit", over=1.5).body(z=-0.042, over=0.8).hold(0.3).home(over=0.6)
    report = checker.check(sit.posture("stand", over=1.5))
    folded = report.margins["joint position"]
    assert folded.subject.endswith("calf")
    assert folded.margin == 0.0
    stretched = checker.check(Timeline().body(pitch=-deg(26.0), z=0.04, over=1.0).home(over=1.0))
    assert stretched.margins["joint position"].margin < 0.0


@pytest.mark.parametrize(("angle", "is_refused"), [(38.0, False), (42.0, True), (44.0, True)])
def test_hips_of_a_pair_that_stands_keep_clear_of_their_stops(
    checker: FeasibilityChecker, angle: float, is_refused: bool
) -> None:
    # A trot that rolled by 52 deg, its hip 0.001 rad past its stop, passed and fell in MuJoCo.
    trot = Timeline().walk(-0.2, turn=deg(10.0), gait="trot")
    over = trot.end / 5.0
    lean = Timeline().body(roll=deg(angle), over=over).body(roll=-0.5 * deg(angle), over=over)
    line = Timeline().together(trot, lean.home(over=over))
    found = checker.check(line).margins["joint position"]
    assert (found.margin < 0.0) is is_refused
    standing = checker.check(lean.home(over=over)).margins["joint position"]
    assert standing.margin >= 0.0  # on four feet a hip may come to its stop


@pytest.mark.parametrize(
    ("aside", "over", "is_done"),
    [(0.0, 0.12, True), (0.01, 0.12, True), (0.0, 0.3, False), (0.03, 0.12, False)],
)
def test_a_foot_lifted_shortly_needs_no_shift(
    checker: FeasibilityChecker, aside: float, over: float, is_done: bool
) -> None:
    # Without the shift the CoM lies on the edge; in MuJoCo the last is 31 mm off, the first two 9.
    line = Timeline(balance=False).body(y=aside, over=0.6).foot("FL", z=0.03, over=over)
    report = checker.check(line.down("FL", over=over).home(over=0.6))
    assert report.ok is is_done
    assert (report.margins["support"].margin >= 0.0) is is_done
