"""Memory: an edited motion, checked with what is known of it, is judged as if nothing were."""

from collections.abc import Callable

import numpy as np
import pytest

from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import CheckedMotion, FeasibilityChecker, Timeline, deg
from motions.memory import MOST_ROWS, Memory
from motions.plan import balance
from motions.plan.parts import rests
from motions.plan.timeline_compiler import compile_timeline
from motions.plan.trajectory import LEAST_SHARE, trajectory_of

SAME = 1e-3  #: Share of a margin, or of the chance, by which two verdicts may differ
SMALL = 0.01  #: Share of the limit from which on a margin is judged by its own size
EDITS = 12
MOVED = Timeline().body(z=-0.03, over=0.5)
Calls = list[tuple[str, dict[str, float | str]]]


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def drawn(rng: np.random.Generator) -> Calls:
    """Calls of a motion that comes home now and then, and steps."""
    leg = str(rng.choice(["FL", "FR", "RL", "RR"]))
    calls: Calls = [
        ("body", {"pitch": deg(5.0), "z": -0.02, "over": 0.5}), ("home", {"over": 0.6}),
        ("foot", {"leg": leg, "z": 0.06, "over": 0.45}), ("hold", {"seconds": 0.2}),
        ("down", {"leg": leg, "over": 0.5}), ("home", {"over": 0.6}),
        ("walk", {"x": 0.15}), ("hold", {"seconds": 0.3}),
        ("step", {"leg": leg, "x": 0.03, "over": 0.5}), ("hold", {"seconds": 0.3}),
        ("body", {"pitch": deg(5.0), "z": -0.02, "over": 0.5}),
        ("body", {"roll": deg(4.0), "over": 0.4}), ("home", {"over": 0.5}),
    ]  # fmt: skip
    return calls


def edited(calls: Calls, rng: np.random.Generator) -> Calls:
    new = [(name, dict(arguments)) for name, arguments in calls]
    _, arguments = new[rng.integers(len(new))]
    numbers = [name for name, value in arguments.items() if not isinstance(value, str)]
    name = str(rng.choice(numbers))
    change = 0.05 if name in ("over", "seconds") else 0.1 * float(arguments[name])
    arguments[name] = float(arguments[name]) + change
    return new


def line_of(calls: Calls) -> Timeline:
    line = Timeline()
    for name, arguments in calls:
        line = getattr(line, name)(**arguments)
    return line


def assert_alike(one: CheckedMotion, other: CheckedMotion) -> None:
    for found, wanted in (
        (one.report.failures, other.report.failures),
        (one.report.warnings, other.report.warnings),
    ):
        assert [(f.check, f.subject) for f in found] == [(f.check, f.subject) for f in wanted]
    assert list(one.report.margins) == list(other.report.margins)
    for check, finding in one.report.margins.items():
        allowed = SAME * max(abs(finding.margin), SMALL * abs(finding.limit))
        assert finding.margin == pytest.approx(other.report.margins[check].margin, abs=allowed)
    assert one.report.probability == pytest.approx(other.report.probability, rel=SAME)


def test_an_edited_motion_is_judged_by_its_parts_as_it_is_as_a_whole(model: RobotModel) -> None:
    rng = np.random.default_rng(3)
    whole, by_parts = FeasibilityChecker(model), FeasibilityChecker(model, memory=Memory())
    calls = drawn(rng)
    assert len(rests(line_of(calls))) >= 3
    for _ in range(EDITS):
        calls = edited(calls, rng)
        line = line_of(calls)
        assert_alike(by_parts.evaluate(line), whole.evaluate(line))


def test_only_what_an_edit_has_changed_is_worked_out_again(model: RobotModel) -> None:
    memory, calls = Memory(), drawn(np.random.default_rng(4))

    def kept() -> np.ndarray:
        return np.array([kind.count for kind in memory._kinds.values()])

    checker = FeasibilityChecker(model, memory=memory)
    checker.evaluate(line_of(calls))
    first = kept()
    checker.evaluate(line_of(calls))
    assert (kept() < 1.02 * first).all()  # of rows that are equal but for rounding, one counts
    calls[-1][1]["over"] = 0.55  # only the last move
    checker.evaluate(line_of(calls))
    assert (kept() > first).all()
    assert (kept() < 1.3 * first).all()


def turning(over: float) -> Timeline:
    """More than a whole turn, before and after what changes."""
    line = Timeline().body(z=-0.02, over=0.5).home(over=0.5)
    for turn in (deg(200.0), deg(200.0)):
        line = line.walk(turn=turn, gait="trot").body(pitch=0.1, over=over).home(over=0.6)
    return line.body(roll=0.1, over=0.6).home(over=0.6)


def jumping(over: float) -> Timeline:
    """With a part that is solved."""
    line = Timeline().body(pitch=0.1, over=over).home(over=0.8).hold(1.0)
    return line.jump(x=0.05).hold(1.0).foot("FL", z=0.06, over=0.5).down("FL", over=0.5)


def restless(over: float) -> Timeline:
    """Never at rest where it is cut: what is before it matters for a while."""
    line = Timeline().body(x=0.01, over=0.5)
    for k in range(12):
        line = line.body(x=0.01 * (-1) ** k, over=over if k == 6 else 0.5, ease="linear")
    return line.home(over=0.5)


@pytest.mark.parametrize("line", [turning, jumping, restless])
def test_what_turns_leaps_or_bears_a_load_is_judged_as_a_whole_too(
    model: RobotModel, line: Callable[[float], Timeline]
) -> None:
    world = World(payload=1.0)
    whole = FeasibilityChecker(model, world=world)
    by_parts = FeasibilityChecker(model, world=world, memory=Memory())
    for over in (0.6, 0.65, 0.5, 0.6):
        assert_alike(by_parts.evaluate(line(over)), whole.evaluate(line(over)))


def test_a_motion_of_an_odd_length_keeps_what_an_edit_leaves(model: RobotModel) -> None:
    memory, asked = Memory(), list[int]()
    checker = FeasibilityChecker(model, memory=memory)
    calls = drawn(np.random.default_rng(5))
    calls[0][1]["over"] = 0.5037
    for over in (0.5, 0.55):
        calls[-1][1]["over"] = over
        before = sum(kind.count for kind in memory._kinds.values())
        checked = checker.evaluate(line_of(calls))
        asked.append(sum(kind.count for kind in memory._kinds.values()) - before)
        assert_alike(checked, FeasibilityChecker(model).evaluate(line_of(calls)))
    assert asked[1] < 0.3 * asked[0]


def test_a_motion_that_never_comes_home_has_no_parts() -> None:
    line = Timeline().body(z=-0.03, over=0.5).body(z=-0.02, over=0.5).body(z=-0.04, over=0.5)
    assert rests(line) == []


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (MOVED.home(over=0.5).body(yaw=0.1, over=0.5), [1.0]),
        # Without coming to rest, or with a foot in the air, nothing ends there.
        (MOVED.body(z=0.0, over=0.5, ease="linear").body(yaw=0.1, over=0.5), []),
        (MOVED.home(over=0.5).hold(1.0).foot("FR", z=0.05, over=0.5).hold(1.0), [1.0]),
    ],
)
def test_a_motion_falls_into_parts_where_it_rests_at_home(
    line: Timeline, expected: list[float]
) -> None:
    assert rests(line) == pytest.approx(expected)


def test_what_is_too_much_is_let_go_and_asked_for_again() -> None:
    memory, asked = Memory(), list[int]()

    def doubled(given: np.ndarray) -> np.ndarray:
        def work(rows: np.ndarray) -> np.ndarray:
            asked.append(len(rows))
            return 2.0 * given[rows]

        return memory.rows("double", given, work)

    first = np.arange(MOST_ROWS - 10.0)[:, None]
    for given in (first, first[:100] + 0.5, first[:100]):
        assert np.array_equal(doubled(given), 2.0 * given)
    assert asked == [len(first), 100, 100]


def test_rows_that_differ_by_rounding_are_the_same_and_others_are_not() -> None:
    memory, given = Memory(), np.array([[0.1, 0.2], [0.1 + 1e-12, 0.2], [0.1, 0.2 + 1e-6]])
    asked = list[int]()

    def work(rows: np.ndarray) -> np.ndarray:
        asked.extend(rows.tolist())
        return given[rows].sum(axis=1)[:, None]

    memory.rows("sum", given[:1], work)
    memory.rows("sum", given, work)
    assert asked == [0, 2]


def test_a_foot_bears_nothing_at_its_touchdown(model: RobotModel) -> None:
    """Or the others share the load as over four feet, if rounding says so: seen in 15 of 400."""
    for over in np.arange(0.4, 0.9, 0.02).tolist():
        line = Timeline().foot("FR", z=0.06, over=over).down("FR", over=over).home(over=0.6)
        share = trajectory_of(compile_timeline(line, model), model).load_share
        assert ((share == 0.0) | (share > LEAST_SHARE)).all()
        assert (share == 0.0).any()


def test_a_pose_that_balances_is_found_once(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a part that is made longer the poses stay: each cost 1 ms of 50 of a drag's step."""
    solved, solve = list[object](), balance.solve_pose

    def counted(*given: object) -> object:
        solved.append(given)
        return solve(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(balance, "solve_pose", counted)
    checker, counts = FeasibilityChecker(model, memory=Memory()), list[int]()
    for over in (0.5, 0.6):
        line = Timeline().foot("FR", z=0.06, over=over).down("FR", over=0.5).home(over=0.6)
        checker.evaluate(line)
        counts.append(len(solved))
    assert counts[0] == counts[1] > 0
