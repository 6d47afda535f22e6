"""The run-time checks of array shapes are really on under pytest, in the workers of xdist too."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError

import controller
import go2_wbc
import motions
import viz
from go2_wbc.errors import unknown_name
from go2_wbc.reference import JointReference
from tests import conftest, typechecker

checking = pytest.mark.skipif(
    not conftest.IS_CHECKING, reason="GO2_WBC_TYPECHECK=0 switches the checks off"
)


@checking
def test_an_array_or_argument_of_the_wrong_kind_is_refused_also_late_in_a_loop() -> None:
    assert JointReference(np.zeros(12), np.zeros(12), 1.0, 1.0).kp == 1.0
    with pytest.raises(TypeCheckError, match="v_joints"):
        JointReference(np.zeros(12), np.zeros(11), 1.0, 1.0)
    with pytest.raises(TypeCheckError):
        unknown_name("side", 3, ("left", "right"))  # pyright: ignore[reportArgumentType]
    assert refusals(typechecker.CHECKED_CALLS) == typechecker.CHECKED_CALLS
    assert refusals(10 * typechecker.STRIDE) == 10


def refusals(calls: int) -> int:
    """How many of so many wrong calls from one place are refused."""
    refused = 0
    for _ in range(calls):
        try:
            unknown_name("side", 3, ("left", "right"))  # pyright: ignore[reportArgumentType]
        except TypeCheckError:
            refused += 1
    return refused


@checking
def test_a_place_that_is_reached_late_in_a_long_run_is_checked_from_its_first_call() -> None:
    for _ in range(10 * typechecker.STRIDE):
        unknown_name("side", "middle", ("left", "right"))
    with pytest.raises(TypeCheckError):
        unknown_name("side", 3, ("left", "right"))  # pyright: ignore[reportArgumentType]


@pytest.fixture(params=range(2))
def spent() -> int:
    """Refusals while a test is set up."""
    return refusals(typechecker.STRIDE - 1)


@checking
def test_every_phase_of_a_test_begins_with_its_first_calls(spent: int) -> None:
    assert spent == refusals(typechecker.STRIDE - 1) == typechecker.CHECKED_CALLS


Way = Float[np.ndarray, " n"]


def _private(way: Way, name: str) -> None: ...


def _plain(name: str) -> None: ...


def public(name: str) -> None: ...


@pytest.mark.parametrize(("function", "is_wrapped"), [(_private, 1), (_plain, 0), (public, 1)])
def test_a_private_function_is_checked_where_it_takes_arrays(
    function: FunctionType, is_wrapped: bool
) -> None:
    assert typechecker._may_be_called_wrongly(function) == is_wrapped


@checking
def test_every_module_that_is_loaded_went_through_the_hook() -> None:
    """A module imported before ``conftest.py``, say by a pytest plugin, would go unchecked."""
    loaded = [name for name in conftest.checked_modules() if name in sys.modules]
    loaders = {name: type(sys.modules[name].__loader__).__module__ for name in loaded}
    assert "go2_wbc.reference" in loaded
    assert {name: found for name, found in loaders.items() if "jaxtyping" not in found} == {}


def test_every_exempted_module_exists() -> None:
    assert set(conftest.our_modules()) >= conftest.UNCHECKED


def test_the_script_that_type_checkers_read_uses_every_public_name() -> None:
    script = (Path(__file__).parent / "user_script.py").read_text(encoding="utf-8")
    names = {name for package in (controller, go2_wbc, motions, viz) for name in package.__all__}
    used = set(re.findall(r"\w+", script.partition("@motion")[2]))
    assert names <= used
