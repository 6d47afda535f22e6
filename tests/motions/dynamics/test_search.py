"""A search leaves nothing behind."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace

import pytest

from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions.dynamics import Tolerance, solve
from tests.motions.dynamics.conftest import PROBLEMS
from tests.solver import needs_solver

pytestmark = needs_solver
LIFT = PROBLEMS["lift"]


@pytest.fixture
def without_collector() -> Iterator[None]:
    """The garbage collector sleeps: what goes, goes because nothing holds it."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("tolerance", [Tolerance(), Tolerance(position=1e-6)])
def test_solving_leaves_nothing_behind_whether_or_not_there_is_a_plan(
    monkeypatch: pytest.MonkeyPatch,
    without_collector: None,
    model: RobotModel,
    tolerance: Tolerance,
) -> None:
    """The solver held its callback, and that the search with its solvers: 114 MB a question."""
    from motions.dynamics import program, search

    made: list[weakref.ref[object]] = []
    for module, name in ((program, "Program"), (search, "Search")):

        class Noted(getattr(module, name)):
            def __init__(self, *args: object, **kwargs: object) -> None:
                super().__init__(*args, **kwargs)
                made.append(weakref.ref(self))

        monkeypatch.setattr(module, name, Noted)
    try:
        solve(replace(LIFT, tolerance=tolerance), model)
    except PlanNotFound:
        assert tolerance != Tolerance()
    assert len(made) == 3
    assert not any(ref() for ref in made)
