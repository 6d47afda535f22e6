"""What every plant must do; a plant's tests inherit the suite and provide the fixture ``plant``."""

from dataclasses import fields, replace

import numpy as np
import pytest

from go2_wbc.errors import ClosedError, CommandError
from go2_wbc.plant.base import Plant
from go2_wbc.robot.state import JointCommand, RobotState

DAMPED = JointCommand.damping(3.0)


def same(first: RobotState, second: RobotState) -> bool:
    """Whether two states are equal bit by bit."""
    names = [field.name for field in fields(RobotState)]
    return all(np.array_equal(getattr(first, n), getattr(second, n)) for n in names)


class PlantContract:
    """The suite."""

    def test_one_write_lets_exactly_one_control_period_pass(self, plant: Plant) -> None:
        start = plant.read().time
        for tick in range(1, 101):
            plant.write(DAMPED)
            assert plant.read().time == pytest.approx(start + tick * plant.control_period, abs=1e-9)

    def test_reading_lets_no_time_pass(self, plant: Plant) -> None:
        assert same(plant.read(), plant.read())

    def test_a_state_that_was_read_does_not_change_later(self, plant: Plant) -> None:
        before = plant.read()
        q, time = before.q.copy(), before.time
        for _ in range(10):
            plant.write(JointCommand.torque(np.full(12, 3.0)))
        assert np.array_equal(before.q, q)
        assert before.time == time
        assert not np.array_equal(plant.read().q, q)

    def test_the_orientation_is_a_unit_quaternion(self, plant: Plant) -> None:
        assert np.linalg.norm(plant.read().q[3:7]) == pytest.approx(1.0, abs=1e-9)

    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    @pytest.mark.parametrize("name", ["tau", "q_des", "v_des", "kp", "kd"])
    def test_a_command_that_is_not_finite_is_refused_and_nothing_happens(
        self, plant: Plant, name: str, bad: float
    ) -> None:
        before = plant.read()
        broken = np.zeros(12)
        broken[7] = bad
        with pytest.raises(CommandError, match=name):
            plant.write(replace(DAMPED, **{name: broken}))
        assert same(plant.read(), before)

    def test_closing_twice_is_fine_and_use_after_it_is_refused(self, plant: Plant) -> None:
        plant.close()
        plant.close()
        with pytest.raises(ClosedError):
            plant.read()
        with pytest.raises(ClosedError):
            plant.write(DAMPED)
