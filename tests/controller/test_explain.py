"""A robot says what was in its way, and does the same whether it is asked or not."""

from contextlib import closing

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import ModeError
from go2_wbc.plant import MujocoPlant
from go2_wbc.recording import Recording


def pushed_trot(*, explains: bool) -> tuple[np.ndarray, Recording, list[str]]:
    """Where it ends, the recording, and what was said to be in the way on it."""
    with closing(MujocoPlant()) as plant, GO2Controller(plant=plant) as go2:
        go2.telemetry.explains = explains
        assert go2.walk()
        go2.move(1.0)
        go2.wait(0.6)
        said = list[str]()
        for _ in range(2):
            plant.push(np.array([-100.0, 260.0, 0.0]), 0.1)
            for _ in range(20):
                go2.wait(0.02)
                said += [limit.name for limit in go2.explain().binding] if explains else []
        state = go2.state
        return np.concatenate([state.q, state.v]), go2.recording(rate=500.0), said


def test_being_asked_changes_nothing_and_what_is_said_is_what_is_recorded() -> None:
    silent, plain, _ = pushed_trot(explains=False)
    end, recording, said = pushed_trot(explains=True)
    np.testing.assert_array_equal(end, silent)
    np.testing.assert_array_equal(recording.tau, plain.tau)
    assert not plain.is_explained
    assert len(said) > 10
    heard = {span.label for span in recording.binding()}
    for name in said:
        what, subject = name.split(" along ")[0].split(" of ")
        ends = ("speed limit", "position limit", "braking")
        assert f"{'end or speed' if what in ends else what} of {subject.split()[0]}" in heard


def test_a_robot_that_does_not_balance_has_nothing_to_explain() -> None:
    with GO2Controller() as go2:
        with pytest.raises(ModeError, match="QP has no part in 'lying'"):
            go2.explain()
        go2.telemetry.explains = True
        assert go2.stand()
        assert str(go2.explain()) == "no limit binds"
        go2.damp()
        go2.wait(0.01)
        with pytest.raises(ModeError, match="no part in 'damped'"):
            go2.explain()
        recording = go2.recording(rate=500.0)
    is_limp = np.asarray(np.isnan(recording.multipliers).all(axis=1))
    assert is_limp[[0, -1]].all()
    assert not is_limp[-10]
    assert not recording.gave_way.any()
