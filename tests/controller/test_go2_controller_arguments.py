"""Bad input is refused at once, by an error that says what was wrong and what is valid."""

from collections.abc import Callable, Iterator
from math import inf, nan
from pathlib import Path

import pytest

from controller import GO2Controller, Mode
from go2_wbc.errors import CommandError, ConfigError
from tests.controller.plants import StillPlant
from tests.pages import run_python

Call = Callable[[GO2Controller], object]


@pytest.fixture(scope="module")
def lying() -> Iterator[GO2Controller]:
    """A lying robot; no time may pass in these tests."""
    with GO2Controller() as go2:
        yield go2
        assert go2.state.time == 0.0
        assert go2.mode is Mode.LYING


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("linear_x", lambda go2, bad: go2.move(bad)),
        ("angular_z", lambda go2, bad: go2.move(0.1, bad)),
        ("linear_y", lambda go2, bad: go2.move(linear_y=bad)),
        ("angle", lambda go2, bad: go2.turn_left(bad)),
        ("angle", lambda go2, bad: go2.turn_right(bad)),
        ("distance", lambda go2, bad: go2.move_forward(bad)),
        ("seconds", lambda go2, bad: go2.wait(bad)),
    ],
)
def test_a_number_that_is_not_finite_is_refused_by_name(
    lying: GO2Controller, name: str, call: Callable[[GO2Controller, float], object], bad: float
) -> None:
    with pytest.raises(CommandError, match=f"{name} must be finite, got {bad}"):
        call(lying, bad)
    assert lying.command.is_zero


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda go2: go2.high_five(hold=0.4), "hold must be 0.5 to 30 s, got 0.4"),
        (lambda go2: go2.high_five(hold=31.0), "hold must be 0.5 to 30 s, got 31.0"),
        (lambda go2: go2.high_five(hold=nan), "hold must be 0.5 to 30 s, got nan"),
        (lambda go2: go2.high_five(hold=inf), "hold must be 0.5 to 30 s, got inf"),
        (lambda go2: go2.high_five(hold=-inf), "hold must be 0.5 to 30 s, got -inf"),
        (lambda go2: go2.wait(-0.1), r"seconds must be from 0 to 1e\+06 s, got -0.1"),
        (lambda go2: go2.turn_left(30.0), "30 rad looks like degrees: write deg"),
        (lambda go2: go2.turn_right(6.3), "-6.3 rad looks like degrees: write deg"),
        (lambda go2: go2.move_forward(1e9), r"distance must be within \+-100 m, got 1"),
        (lambda go2: go2.high_five("up"), "unknown side 'up'; valid: left, right"),
        (lambda go2: go2.walk("canter"), "unknown gait 'canter'; valid: .*trot"),
        (lambda go2: go2.play("nod", times=0), "times must be a whole number of 1 or more, got 0"),
        (lambda go2: go2.play("levitate"), "unknown motion 'levitate'; valid: .*high_five"),
        (lambda go2: go2.recording(rate=0.0), "rate must be positive, got 0.0"),
        (
            lambda go2: go2.recording(rate=nan),
            "rate must be positive, got nan",
        ),
    ],
)
def test_a_value_out_of_range_or_an_unknown_name_is_refused_with_what_is_valid(
    lying: GO2Controller, call: Call, message: str
) -> None:
    with pytest.raises(CommandError, match=message):
        call(lying)


@pytest.mark.parametrize("name", ["", " ", "2nd", "robot 1", "robot1\n", "a/b", "roböt", "a-b"])
def test_a_namespace_that_is_not_a_name_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="letters, digits and underscores, a letter first"):
        GO2Controller(namespace=name, plant=StillPlant())


def test_a_plant_whose_time_does_not_wait_is_refused_without_realtime(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant = StillPlant()
    with GO2Controller(plant=plant):
        pass
    monkeypatch.setattr(StillPlant, "is_live", True)
    with pytest.raises(ConfigError, match=r"StillPlant must get commands.*realtime=True"):
        GO2Controller(plant=plant)
    with GO2Controller(plant=plant, realtime=True) as go2:
        assert go2.mode is Mode.LYING


def test_a_refused_call_is_the_last_outcome() -> None:
    with GO2Controller(plant=StillPlant()) as go2:
        with pytest.raises(CommandError):
            go2.walk("canter")
        assert not go2.last_outcome
        assert "canter" in go2.last_outcome.reason


WRONG_TYPES = """
from controller import GO2Controller
from go2_wbc import Task
from go2_wbc.errors import CommandError, ConfigError

go2 = GO2Controller()
calls = {
    CommandError: [
        lambda: go2.move("fast"), lambda: go2.move(True), lambda: go2.move(None),
        lambda: go2.turn_left("90"), lambda: go2.move_forward(None), lambda: go2.wait(1 + 1j),
        lambda: go2.high_five(hold="long"), lambda: go2.high_five(3), lambda: go2.high_five([]),
        lambda: go2.play(42), lambda: go2.play(print), lambda: go2.play(None),
        lambda: go2.walk(None), lambda: go2.walk({}),
    ],
    ConfigError: [
        lambda: GO2Controller(7), lambda: GO2Controller(None), lambda: GO2Controller(config=3),
        lambda: GO2Controller(config={"wbc": {}}), lambda: GO2Controller(plant="robot"),
        lambda: GO2Controller(urdf=3), lambda: GO2Controller(realtime="yes"),
        lambda: GO2Controller(viewer=1), lambda: GO2Controller(urdf=b"go2.urdf"),
        lambda: GO2Controller(extra_tasks=Task), lambda: GO2Controller(extra_tasks=[Task]),
        lambda: GO2Controller(extra_tasks=None), lambda: GO2Controller(extra_tasks="tasks"),
    ],
}
for kind, refused in calls.items():
    for number, call in enumerate(refused):
        try:
            call()
        except kind as error:
            assert "got" in str(error) or "valid" in str(error), error
        else:
            raise SystemExit(f"{kind.__name__} {number} was accepted")
go2.wait(1)
"""


def test_values_of_a_wrong_type_are_refused_by_errors_of_our_own(tmp_path: Path) -> None:
    # In a process of its own: under pytest the run-time type checks would refuse them first.
    done = run_python(WRONG_TYPES, tmp_path)
    assert done.returncode == 0, done.stderr
