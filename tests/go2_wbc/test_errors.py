"""The exceptions form the tree that their module draws, and their messages say what they must."""

import inspect
import re

import pytest

from go2_wbc import errors
from go2_wbc.errors import (
    CommandError,
    Go2WbcError,
    IkError,
    MotionInfeasible,
    QpInfeasible,
    ResidualRow,
    unknown_name,
)
from go2_wbc.legs import LEGS

LEG_NAMES = tuple(leg.name for leg in LEGS)
ROWS = (ResidualRow("torque limits", 3.25, "N m"), ResidualRow("stance feet", 0.5, "m/s^2"))


def exceptions() -> dict[str, type[Exception]]:
    return {
        name: value
        for name, value in vars(errors).items()
        if inspect.isclass(value)
        and issubclass(value, Exception)
        and value.__module__ == errors.__name__
    }


def drawn_tree() -> dict[str, str]:
    """Parent of each exception by the drawing in the module's docstring."""
    parents: dict[str, str] = {}
    path = [("Go2WbcError", -1)]
    for line in (errors.__doc__ or "").splitlines():
        found = re.match(r"^\s*([│ ]*[├└]── )(\w+)", line)
        if found:
            depth = len(line) - len(line.lstrip(" │├└─"))
            while path[-1][1] >= depth:
                path.pop()
            parents[found[2]] = path[-1][0]
            path.append((found[2], depth))
    return parents


def test_the_drawn_tree_is_the_real_tree() -> None:
    real = {
        name: value.__mro__[1].__name__
        for name, value in exceptions().items()
        if value is not Go2WbcError
    }
    assert drawn_tree() == real


def test_errors_say_what_they_hold() -> None:
    assert issubclass(CommandError, ValueError)
    error = QpInfeasible("daqp", "status -1", ROWS)
    head, *table = str(error).splitlines()
    assert head == "daqp found no solution of the whole-body QP (status -1)"
    assert [line.split()[-2:] for line in table] == [["N", "m"], ["0.5", "m/s^2"]]
    assert "torque limits" in table[0]
    assert "3.25" in table[0]
    assert (error.solver, error.status, error.residuals) == ("daqp", "status -1", ROWS)
    assert IkError("missed", list(ROWS)).residuals == ROWS
    error = MotionInfeasible("bow", ["calf beyond its limit", "margin -2 cm"])
    assert str(error).splitlines() == [
        "motion 'bow' is infeasible:",
        "  calf beyond its limit",
        "  margin -2 cm",
    ]
    assert error.findings == ("calf beyond its limit", "margin -2 cm")


def test_an_unknown_name_is_answered_with_the_valid_ones_and_advice_if_one_is_like_it() -> None:
    assert unknown_name("gait", "run", ("walk", "trot")) == "unknown gait 'run'; valid: trot, walk"
    nearly = unknown_name("gait", "tort", ("walk", "trot"))
    assert nearly == "unknown gait 'tort'; valid: trot, walk; did you mean 'trot'?"
    assert unknown_name("foot", "XX", LEG_NAMES) == "unknown foot 'XX'; valid: FL, FR, RL, RR"


@pytest.mark.parametrize(("foot", "meant"), [("LF", "FL"), ("rl", "RL"), ("RF", "FR")])
def test_letters_in_another_order_or_case_are_recognised(foot: str, meant: str) -> None:
    assert unknown_name("foot", foot, LEG_NAMES).endswith(f"; did you mean {meant!r}?")
