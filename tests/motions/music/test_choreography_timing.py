"""When accents happened: turning points of the trunk and touchdowns, in a run made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.legs import Leg
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from motions import Timeline
from motions.music import Accent, Dance, danced
from motions.music.choreography import PlacedMove
from motions.music.dance_moves import MOVES
from tests.go2_wbc.plant.helpers import empty_recording

PERIOD = 0.002
PULSES = np.array([0.5, 1.5, 2.5])


def dance(*accents: Accent) -> Dance:
    return Dance(Timeline(), (PlacedMove(MOVES["nod"], 1),), accents, PULSES)


def run(turn: float, landing: float, yaw: float = 0.0) -> TruthRecording:
    """The trunk goes farthest to its left at ``turn``, and FR is down from ``landing`` on."""
    recorded = empty_recording(1500, np.zeros((1500, 4, 3)))
    time = 10.0 + PERIOD * np.arange(1500)
    q, forces = recorded.q.copy(), np.full((1500, 4), 30.0)
    left = 0.03 * np.exp(-(((time - 10.0 - turn) / 0.2) ** 2))
    q[:, 0], q[:, 1] = -np.sin(yaw) * left, np.cos(yaw) * left
    is_up = (time - 10.0 > landing - 0.3) & (time - 10.0 < landing)
    forces[is_up, Leg.FR] = 0.0
    rpy = np.zeros((1500, 3))
    rpy[:, 2] = yaw
    return replace(recorded, time=time, q=q, foot_forces=forces, rpy=rpy)


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_accents_are_found_where_they_happened(yaw: float) -> None:
    result = danced(run(1.53, 2.48, yaw), dance(Accent(1, "y", 1), Accent(2, "FR", 0)))
    assert result.wanted == pytest.approx([1.5, 2.5])
    assert result.happened == pytest.approx([1.53, 2.48], abs=2 * PERIOD)
    assert result.errors(PULSES) == pytest.approx([0.03, -0.02], abs=2 * PERIOD)
    assert result.share_on(PULSES) == 1.0


def test_an_accent_that_came_late_or_not_at_all_is_not_on_the_beat() -> None:
    accents = dance(Accent(1, "y", 1), Accent(2, "FR", 0), Accent(1, "FL", 0), Accent(2, "y", 1))
    result = danced(run(1.56, 2.5), accents)
    assert np.isnan(result.happened[2])  # FL never left the ground
    assert np.isnan(result.happened[3])  # the trunk only comes back: no turning point
    assert result.share_on(PULSES) == 0.25
