"""Motions are compiled and checked beside a loop that ticks; neither spoils the other's numbers."""

import sys
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import Go2WbcError
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import Payload
from go2_wbc.robot.state import RobotState, Snapshot
from motions import FeasibilityChecker
from motions.feasibility.report import FeasibilityReport
from tests.controller.plants import StillPlant

PERIOD = 2e-4  # s; between two ticks of a robot that keeps the processor busy
# s; the interpreter changes threads after nearly every instruction.
SWITCH_INTERVAL = 1e-6
MOTIONS = ("bow", "nod", "wave", "high_five")


@pytest.fixture
def frequent_switches() -> Iterator[None]:
    """The interpreter changes threads as often as it can."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)
    yield
    sys.setswitchinterval(usual)


@pytest.fixture(scope="module")
def at_rest() -> dict[str, FeasibilityReport]:
    """The report on each motion when nothing else runs."""
    checker = FeasibilityChecker()
    return {name: checker.check(name) for name in MOTIONS}


@pytest.fixture
def snapshots(monkeypatch: pytest.MonkeyPatch) -> list[Snapshot]:
    """Every snapshot that a control loop in the background takes."""
    taken: list[Snapshot] = []
    take = RobotModel.snapshot

    def noted(model: RobotModel, state: RobotState, *carried: Payload) -> Snapshot:
        snapshot = take(model, state, *carried)
        if threading.current_thread().name == "go2-loop":
            taken.append(snapshot)
        return snapshot

    monkeypatch.setattr(RobotModel, "snapshot", noted)
    return taken


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> list[FeasibilityReport]:
    """Every report that a feasibility check makes."""
    made: list[FeasibilityReport] = []
    make: Callable[..., FeasibilityReport] = FeasibilityReport.of

    def noted(*args: object, **named: object) -> FeasibilityReport:
        made.append(make(*args, **named))
        return made[-1]

    monkeypatch.setattr(FeasibilityReport, "of", noted)
    return made


@pytest.mark.usefixtures("frequent_switches")
def test_checks_beside_a_ticking_loop_find_what_they_find_at_rest(
    at_rest: dict[str, FeasibilityReport],
    snapshots: list[Snapshot],
    reports: list[FeasibilityReport],
) -> None:
    # They shared one pinocchio.Data: 8 of 18 motions got wrong margins, 4 were refused for them,
    # and a tick now and then was computed with the feet of another instant.
    with GO2Controller(plant=StillPlant(PERIOD), realtime=True) as go2:
        for name in MOTIONS:
            with pytest.raises(Go2WbcError, match="starts from stand, the robot is lying"):
                go2.play(name)
        state = go2.state
    assert {report.motion: report.margins for report in reports} == {
        name: report.margins for name, report in at_rest.items()
    }
    expected = RobotModel().snapshot(state)
    assert len(snapshots) > len(MOTIONS)
    for snapshot in snapshots:
        for name in ("mass_matrix", "bias", "p_world_com", "p_world_feet", "J_feet", "drift_feet"):
            np.testing.assert_array_equal(getattr(snapshot, name), getattr(expected, name))
