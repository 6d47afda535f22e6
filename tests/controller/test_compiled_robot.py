"""Compiled code against its own Python, call by call, while a robot is driven."""

import pytest

from controller import GO2Controller
from controller.demo.steps import run_demo
from go2_wbc.algebra import active_set
from tests.compiled import NEAR, difference, every_call_compared


def test_a_few_ticks_of_a_trot_are_what_their_python_makes() -> None:
    with GO2Controller() as go2:
        go2.stand()
        go2.walk()
        go2.move(0.3)
        go2.wait(0.1)
        with every_call_compared() as tallies:
            go2.wait(0.1)
    assert tallies["plan"].calls == tallies["solve_tick"].calls == 50
    assert all(tally.worst <= NEAR for tally in tallies.values())


def test_a_difference_is_told_and_the_kernels_are_as_before() -> None:
    before = type(active_set.solve_qp).__call__
    with every_call_compared():
        assert type(active_set.solve_qp).__call__ is not before
    assert type(active_set.solve_qp).__call__ is before or "first_call" in before.__name__
    assert difference([1.0, float("nan")], [1.0 + 1e-6, float("nan")]) > NEAR


@pytest.mark.slow
def test_every_call_of_the_demo_is_what_its_python_makes() -> None:
    with every_call_compared() as tallies, GO2Controller() as go2:
        assert run_demo(go2).ok
    assert {name: tally.worst for name, tally in tallies.items() if tally.worst > NEAR} == {}
