"""A foot that is held in the air is named, unless it touches something or all is upset."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from go2_wbc.robot.foot_watch import EXCUSED, IMPULSE, LASTS, PULLED, SUNK, UNFELT, FootWatch
from go2_wbc.robot.state import PartFault, RobotState

DT = 0.002


def watched(
    held: float,
    force: float = 0.0,
    roll: float = 0.0,
    time: float = 0.1,
    gap: float = np.inf,
    others: float = 50.0,
    sag: float = 0.0,
) -> FootWatch:
    """After its second foot has been held with a force [N] for a time, but for some ticks."""
    watch, q = FootWatch(150.0), np.zeros(19)
    q[3], q[6] = np.sin(0.5 * roll), np.cos(0.5 * roll)
    for k in (k for k in range(round(time / DT)) if k % gap != gap - 1):
        forces = np.array([others, force, others, others])
        state = RobotState(DT * k, q, np.zeros(18), np.full(12, 5.0), forces, forces > UNFELT)
        watch.update(np.array([0.0, held, 0.0, 0.0]), state, sag, DT)
    return watch


def test_a_held_foot_is_named_once() -> None:
    (fault,) = watched(3.0 * PULLED, sag=0.9 * SUNK).faults
    assert str(fault).startswith("FR_foot was held")
    assert fault.is_survived


@pytest.mark.parametrize(
    "changes",
    [
        {"held": 0.9 * PULLED},
        {"held": 0.9 * IMPULSE / 0.03, "time": 0.03},
        {"force": 2.0 * UNFELT},
        {"roll": 0.5},
        {"time": 0.9 * LASTS},
        {"gap": 8},
        {"others": 15.0},
        {"sag": 1.1 * SUNK},
        {"held": 2.5 * PULLED, "force": 0.8 * UNFELT},
    ],
)
def test_a_foot_that_follows_stumbles_is_struck_or_tumbles_is_not_held(
    changes: dict[str, Any],
) -> None:
    assert watched(**{"held": 3.0 * PULLED, **changes}).faults == ()


def test_the_sensor_of_a_foot_that_was_held_has_time_to_show_that_it_lives() -> None:
    watch = watched(3.0 * PULLED, time=0.1)
    fault = PartFault("FR_foot", "feels nothing", True, 0.3)
    assert watch.excuses(fault, 0.1 + 0.9 * EXCUSED)
    assert not watch.excuses(fault, 0.1 + 1.1 * EXCUSED)
    for other in ({"part": "FL_foot"}, {"part": "FR_calf_joint"}, {"since": 0.05}):
        assert not watch.excuses(replace(fault, **other), 0.3)
    assert not watched(0.9 * PULLED).excuses(fault, 0.3)
    assert watched(3.0 * PULLED, time=0.7 * LASTS).excuses(fault, 0.3)
    assert not watched(3.0 * PULLED, time=0.3 * LASTS).excuses(fault, 0.3)
