"""A foot that stays elsewhere in the air is held, unless it touches something or all is upset."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.robot.foot_watch import ASTRAY, LASTS, UNFELT, FootWatch
from go2_wbc.robot.state import RobotState

DT = 0.002


def watched(
    off: float, force: float = 0.0, roll: float = 0.0, time: float = 0.1, asked: float = 5.0
) -> FootWatch:
    """After its second foot has been ``off`` [m] for a time."""
    watch, q = FootWatch(), np.zeros(19)
    q[3], q[6] = np.sin(0.5 * roll), np.cos(0.5 * roll)
    for k in range(round(time / DT)):
        forces = np.array([50.0, force, 50.0, 50.0])
        state = RobotState(DT * k, q, np.zeros(18), np.full(12, 5.0), forces, forces > UNFELT)
        watch.update(np.array([0.0, off, 0.0, 0.0]), np.full(12, asked), state, DT)
    return watch


def test_a_held_foot_is_named_once() -> None:
    (fault,) = watched(2.0 * ASTRAY).faults
    assert str(fault).startswith("FR_foot was held")
    assert fault.is_survived


@pytest.mark.parametrize(
    "changes",
    [
        {"off": 0.9 * ASTRAY},
        {"force": 2.0 * UNFELT},
        {"roll": 0.5},
        {"time": 0.9 * LASTS},
        {"asked": 20.0},
    ],
)
def test_a_foot_that_follows_stumbles_tumbles_or_has_a_weak_motor_is_not_held(
    changes: dict[str, float],
) -> None:
    assert watched(**{"off": 2.0 * ASTRAY, **changes}).faults == ()
