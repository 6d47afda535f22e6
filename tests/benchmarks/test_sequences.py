"""Random calls: a sample of them, and that the judge notices what is wrong."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np
import pytest

from benchmarks import sequences
from benchmarks.sequences import ROWS, WORLDS, Call, Judge, World, measure_sequence
from benchmarks.study import TrialResult
from controller import GO2Controller
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.plant.mujoco.ground_truth import GroundTruth

SAMPLE = (501, 503)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SAMPLE)
@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_every_answer_of_random_calls_holds(world: World, seed: int) -> None:
    found = TrialResult()
    measure_sequence(Trial(seed), found, world, 0)
    assert found.values == {name: 0.0 for name, *_ in ROWS}, found.failures


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., set[str]]]:
    """The rows of which a call to a standing robot gives something, if methods do what is given."""
    with TrialRobot(WORLDS[0].plant(0)) as robot:
        assert robot.go2.stand()

        def judge_call(
            call: str, *arguments: float, other: str = "", **instead: Callable[..., object]
        ) -> set[str]:
            for name, does in instead.items():
                monkeypatch.setattr(GO2Controller, name, does)
            judge = Judge(robot, 0.05)
            with suppress(sequences._Hangs):
                judge.make(Call(call, arguments, False, True, other, 0.2, 0.0))
            return {name for name, what in judge.found.items() if what}

        yield judge_call


def turn_too_far(go2: GO2Controller, angle: float) -> bool:
    return go2.turn_right(-angle - 0.04)


def deny(go2: GO2Controller) -> bool:
    go2.wait(0.5)
    return False


def crash(_go2: GO2Controller) -> bool:
    raise KeyError("a bug")


def agree(_go2: GO2Controller) -> bool:
    return True


def trip(go2: GO2Controller) -> None:
    assert isinstance(go2.plant, GroundTruth)
    go2.plant._plant.push(np.array([0.0, 900.0, 300.0]), 0.15)
    go2.wait(1.0)


@pytest.mark.parametrize(
    ("call", "arguments", "does", "row"),
    [
        ("turn_left", (0.5,), turn_too_far, "untrue-true"),
        ("walk", (), agree, "untrue-true"),
        ("stand", (), deny, "untrue-false"),
        ("stand", (), crash, "errors"),
        ("move", (), agree, "errors"),
        ("stop", (), trip, "falls"),
    ],
)
def test_what_does_not_hold_is_noticed(
    judged: Callable[..., set[str]],
    call: str,
    arguments: tuple[float, ...],
    does: Callable[..., object],
    row: str,
) -> None:
    assert judged(call, *arguments, **{call: does}) == {row}


def test_a_second_thread_must_be_refused_and_what_does_not_end_is_noticed(
    judged: Callable[..., set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert judged("wait", 0.5, other="stand") == set()
    assert judged("wait", 0.5, other="stand", stand=agree) == {"errors"}
    monkeypatch.setattr(sequences, "HANGS", 0.3)
    assert judged("wait", 1.0) == {"hangs"}


def test_sinking_as_it_was_told_to_is_no_fall() -> None:
    # It sank on in the call after damp(), in which nobody had told it to: that counted as a fall.
    with TrialRobot(WORLDS[0].plant(0)) as robot:
        judge = Judge(robot, 0.05)
        for name in ("stand", "damp", "sit"):
            judge.make(Call(name, (), False, False, "", 0.0, 0.0))
    assert not any(judge.found.values())
