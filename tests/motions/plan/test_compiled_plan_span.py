"""Where a compiled plan has feedback gains of its own, and what they are for."""

import numpy as np
import pinocchio as pin
import pytest

from controller import GO2Controller
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, deg, load_motion
from tests.motions.plans import curves_at
from tests.solver import needs_solver

MODEL = RobotModel()
NEAR = 1e-3
"""How near [m, rad] the planned state is to the curves, which are cubics through its knots; where
accelerations jump, angles cut corners."""


@pytest.fixture(scope="module")
def rear() -> CompiledPlan:
    return compile_timeline(load_motion("rear_up"), MODEL)


def test_gains_are_there_while_two_feet_stand_and_only_then(rear: CompiledPlan) -> None:
    for t in np.arange(0.011, rear.duration, 0.02).tolist():
        stands = int(rear.at(t).stance.sum())
        assert (rear.feedback_at(t) is not None) == (1 <= stands <= 2), t
    jump = compile_timeline(load_motion("jump_up"), MODEL)
    flies = [t for t in np.arange(0.0, jump.duration, 0.01).tolist() if not jump.at(t).stance.any()]
    assert flies
    assert all(jump.feedback_at(t) is None for t in flies)


def test_the_planned_state_is_that_of_the_curves_that_are_played(rear: CompiledPlan) -> None:
    times = np.linspace(0.0, rear.duration, 200).tolist()
    states = [(t, found) for t in times if (found := rear.feedback_at(t)) is not None]
    assert len(states) > 20
    angles = list[np.ndarray]()
    for t, state in states:
        values = curves_at(rear, t)[0]
        assert MODEL.center_of_mass(state.q) == pytest.approx(values[:3], abs=NEAR)
        rpy = rpy_from_rotation(pin.Quaternion(state.q[3:7]).toRotationMatrix())
        angles.append(np.concatenate([rpy, state.q[7:]]) - values[3:18])
    assert np.median(np.abs(angles).max(axis=1)) < NEAR


@needs_solver
def test_a_robot_that_rears_for_long_stays_up_and_level() -> None:
    """With gains for place and attitude apart it fell over, as it came down, after 0.9 s."""
    checked = FeasibilityChecker(MODEL).evaluate(Timeline().rear(deg(-25), hold=0.9))
    assert checked.report.ok
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(checked), go2.last_outcome.reason
