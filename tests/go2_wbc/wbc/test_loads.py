"""The expected load of standing feet, and what it does to the forces along the ground."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.reference import Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.trajectory_loads import LEAST_LOAD, MOST_LOAD, plan_loads, share_load
from tests.engine_helpers import JO, ST, holding_reference, standing_q, state_of

MODEL = RobotModel()
WEIGHT = MODEL.mass * MODEL.gravity
FEET = np.array([[0.19, 0.14], [0.19, -0.14], [-0.19, 0.14], [-0.19, -0.14]])
OPEN = np.full(4, 10.0)
ROUNDING = 1e-3  # of loads: what ``SPREAD`` takes from the slope; measured 2e-5
EVEN_USE = 1.4  # most over least use of friction; measured 1.3, and 5.2 where feet push alike
AHEAD, ASIDE = 0.03, -0.04  # [m] by which the CoM is off the middle of the feet, about
PUSH = 1.5  # [m/s^2]
HEIGHT = 0.27  # [m] of the hips over the feet


def relative_loads(places: np.ndarray, point: np.ndarray, most: np.ndarray) -> np.ndarray:
    loads = np.empty(len(places))
    share_load(places, point[0], point[1], most, loads)
    return loads


@given(st.integers(2, 4), st.lists(st.floats(-0.05, 0.05), min_size=10, max_size=10).map(np.array))
def test_of_all_loads_that_act_at_that_point_the_most_even_are_taken(
    feet: int, off: np.ndarray
) -> None:
    """Least squares of least length: off the line of two feet, the nearest point on it counts."""
    places, point = FEET[4 - feet :] + 0.2 * off[:8].reshape(4, 2)[4 - feet :], off[8:] / 4
    middle = places.mean(axis=0)
    point = point + middle
    A = np.vstack([np.ones(feet), (places - middle).T / feet])
    more = np.linalg.lstsq(A, np.array([0.0, *(point - middle)]), rcond=1e-9)[0]
    np.testing.assert_allclose(relative_loads(places, point, OPEN[:feet]), 1 + more, atol=ROUNDING)


def test_loads_are_near_the_mean_and_the_planned_ones_are_the_controllers() -> None:
    loads = relative_loads(FEET, np.array([0.5, 0.0]), np.array([10.0, 0.7, 10.0, 10.0]))
    np.testing.assert_allclose(loads, [MOST_LOAD, 0.7, LEAST_LOAD, LEAST_LOAD])
    snapshot, reference = leaning((ST, ST, ST, ST))
    normal = WholeBodyController(MODEL).solve(snapshot, reference).forces[:, 2]
    loads = np.empty(4)
    plan_loads(snapshot, Target.of(reference.row), WEIGHT, loads)
    np.testing.assert_allclose(loads, normal / normal.mean(), atol=0.1)


def leaning(legs: tuple) -> tuple[Snapshot, Reference]:
    """A stand whose CoM is off the middle of the feet, to be pushed ahead."""
    q = standing_q()
    q[7::3] += ASIDE / HEIGHT
    q[8::3] += AHEAD / HEIGHT
    snapshot = MODEL.snapshot(state_of(q))
    reference = replace(holding_reference(snapshot), legs=legs)
    body = replace(reference.body, a_world=np.array([PUSH, 0.0, 0.0]))
    return snapshot, replace(reference, body=body)


@pytest.mark.parametrize("backend", ["condensed", "full", "placo"])
@pytest.mark.parametrize("legs", [(ST, ST, ST, ST), (ST, ST, ST, JO)])
def test_all_feet_use_much_the_same_part_of_their_friction(backend: str, legs: tuple) -> None:
    snapshot, reference = leaning(legs)
    stands = np.array([task is ST for task in legs])
    forces = WholeBodyController(MODEL, backend).solve(snapshot, reference).forces[stands]
    assert forces[:, 2].max() > 1.5 * forces[:, 2].min()
    uses = np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2]
    assert uses.max() < EVEN_USE * uses.min()
