"""The compiled motor law is held to ``MotorModel``, at any speed and in any order of the joints."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.kernels.motor import available, drive, note_peaks
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import LEAST_SHARE, MOTORS
from go2_wbc.robot.state import JointCommand

COUNT = 1000
EXACT = 1e-12  # N m; sums in another order


@pytest.mark.parametrize("name", MOTORS)
def test_torques_are_those_of_the_readable_model(name: str) -> None:
    motor, rng = RobotModel(motor=name).motor, np.random.default_rng(31)
    numbers = np.array([motor.peak, motor.knee_speed, motor.no_load_speed])
    cut = 0
    for _ in range(COUNT):
        places = np.array([rng.permutation(20)[:12] for _ in range(3)])
        qpos, qvel, ctrl = rng.normal(size=20), 15.0 * rng.normal(size=20), np.zeros(20)
        rows = rng.normal(size=(5, 12)) * np.array([[30.0], [1.0], [5.0], [20.0], [2.0]])
        total = rng.normal(size=12)
        before = total.copy()
        drive(rows, numbers, places, qpos, qvel, ctrl, total)
        q, v = qpos[places[0]], qvel[places[1]]
        expected = motor.torque(JointCommand(*rows), q, v)
        np.testing.assert_allclose(ctrl[places[2]], expected, atol=EXACT, rtol=0)
        np.testing.assert_allclose(total, before + expected, atol=EXACT, rtol=0)
        assert np.count_nonzero(ctrl) == np.count_nonzero(expected)
        lower, upper = motor.limits(v)
        cut += bool((((expected == upper) | (expected == lower)) & (upper - lower > 0.0)).any())
    assert cut > COUNT / 10


@pytest.mark.parametrize("name", MOTORS)
def test_peaks_are_those_of_all_ticks_so_far(name: str) -> None:
    motor, rng = RobotModel(motor=name).motor, np.random.default_rng(32)
    numbers = [motor.peak, motor.knee_speed, motor.no_load_speed, LEAST_SHARE * motor.peak]
    tau, v, before = (size * rng.normal(size=(COUNT, 12)) for size in (15.0, 12.0, 12.0))
    peaks = np.zeros((3, 12))
    for rows in zip(tau, v, before, strict=True):
        note_peaks(*rows, np.array(numbers), peaks)
    expected = [np.abs(tau), np.abs(v), motor.share(tau, before)]
    np.testing.assert_allclose(peaks, [rows.max(axis=0) for rows in expected], rtol=EXACT)


@pytest.mark.parametrize("name", MOTORS)
def test_limits_are_those_of_the_readable_model(name: str) -> None:
    motor = RobotModel(motor=name).motor
    speeds = np.concatenate([np.linspace(-40.0, 40.0, 401), motor.knee_speed, motor.no_load_speed])
    for speed in speeds[np.isfinite(speeds)]:
        lower, upper = motor.limits(np.full(12, speed))
        for n in range(12):
            numbers = motor.peak[n], motor.knee_speed[n], motor.no_load_speed[n]
            assert available(speed, *numbers) == pytest.approx(upper[n], abs=EXACT)
            assert -available(-speed, *numbers) == pytest.approx(lower[n], abs=EXACT)
