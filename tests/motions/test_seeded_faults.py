"""Seeded faults: of the library's motions with one thing broken, the check must catch them all."""

import pytest

from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, load_motion
from tests.motions.mutations import MUTATORS, STANDING, Fault, faults, limit_broken

COUNT, CAUGHT = 60, 58


@pytest.fixture(scope="module")
def broken(model: RobotModel) -> list[Fault]:
    return faults(model, COUNT)


def test_nearly_every_fault_is_caught(model: RobotModel, broken: list[Fault]) -> None:
    checker = FeasibilityChecker(model)
    missed = [fault for fault in broken if checker.check(fault.line).ok]
    told = "\n".join(f"{fault.mutator} of {fault.line.name}: {fault.broken}" for fault in missed)
    assert COUNT - len(missed) >= CAUGHT, told


def test_the_faults_are_of_every_kind_and_on_many_motions(broken: list[Fault]) -> None:
    assert {fault.mutator for fault in broken} == set(MUTATORS)
    assert len({fault.line.name for fault in broken}) >= 10
    assert len({fault.broken for fault in broken}) >= 6


@pytest.mark.parametrize("name", STANDING)
def test_the_oracle_finds_nothing_wrong_with_the_library(model: RobotModel, name: str) -> None:
    assert limit_broken(load_motion(name), model) == ""
