"""The measured envelopes of the gaits, and the choice of a gait by the speed."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, Gait
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import (
    DOWN,
    DWELL,
    FULL,
    LADDER,
    UP,
    GaitChoice,
    envelope_of,
    measured_envelopes,
    trot_of,
)

TICK = 0.02
RATE = 1.5 * TICK  # m/s in a tick
USUAL = VelocityEnvelope()


def test_every_named_gait_has_a_measured_envelope() -> None:
    assert measured_envelopes().keys() == GAITS.keys()


def test_the_default_envelope_of_the_trot_is_inside_what_was_measured() -> None:
    own, measured = astuple(trot_of()), astuple(measured_envelopes()["trot"])
    assert all(a <= b for a, b in zip(own, measured, strict=True))


@pytest.mark.parametrize("name", sorted(GAITS.keys() - {"trot"}))
def test_an_envelope_that_is_configured_scales_those_of_the_other_gaits(name: str) -> None:
    measured = measured_envelopes()
    for trot in (USUAL, VelocityEnvelope(0.5, 0.3, 0.2, 4.0)):
        expected = np.array(astuple(trot)) / astuple(FULL) * astuple(measured[name])
        assert astuple(envelope_of(GAITS[name], trot)) == pytest.approx(tuple(expected))


def test_where_nothing_is_configured_only_the_trot_is_taken_to_what_was_measured_of_it() -> None:
    # Of the others the edge was measured in one direction at a time, on the true state.
    own = Gait("mine", 0.4, 0.6, (0.0, 0.5, 0.5, 0.0), envelope_share=0.4)
    assert envelope_of(GAITS["trot"], None) == trot_of()
    for gait in (own, *(gait for gait in GAITS.values() if gait.name != "trot")):
        assert envelope_of(gait, None) == envelope_of(gait, USUAL)


def test_however_fast_the_trot_may_be_the_other_gaits_stay_inside_what_was_measured() -> None:
    # A trot that plans its forces has a far wider envelope; a walk was taken to 1.6 m/s with it.
    fast = VelocityEnvelope(4.0, 0.5, 1.5, 8.0)
    for name, measured in measured_envelopes().items():
        own = envelope_of(GAITS[name], fast)
        if name == "trot":
            assert own == fast
        else:
            assert own.forward == measured.forward
            assert own.backward < measured.backward
            assert own.turning == measured.turning


def test_a_gait_of_ones_own_has_its_share_even_under_a_known_name() -> None:
    own = Gait("mine", 0.4, 0.6, (0.0, 0.5, 0.5, 0.0), envelope_share=0.4)
    assert envelope_of(own, USUAL) == USUAL.scaled(0.4)
    changed = replace(GAITS["walk"], period=0.7, envelope_share=0.2)
    assert envelope_of(changed, USUAL) == USUAL.scaled(0.2)


def test_a_named_gait_that_is_not_measured_yet_can_be_walked_to_measure_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The benchmark that measures envelopes raised KeyError for a new gait.
    hop = replace(GAITS["pronk"], name="hop", envelope_share=0.3)
    monkeypatch.setitem(GAITS, "hop", hop)
    assert envelope_of(hop, USUAL) == USUAL.scaled(0.3)


class Follower:
    """Follows what the choice lets through, at the rate of a robot."""

    def __init__(self) -> None:
        self.choice, self.time, self.velocity = GaitChoice(USUAL), 0.0, np.zeros(3)
        self.names: list[str] = []
        self.times: list[float] = []

    def go(self, command: VelocityCommand, seconds: float) -> None:
        for _ in range(round(seconds / TICK)):
            gait, allowed = self.choice.update(self.time, self.velocity, command)
            if not self.names or gait.name != self.names[-1]:
                self.names.append(gait.name)
                self.times.append(self.time)
            envelope = envelope_of(gait, USUAL)
            assert envelope.load(allowed) <= 1.0 + 1e-9
            assert envelope.load(VelocityCommand(*self.velocity)) <= 1.0 + 1e-9
            wanted = np.array(astuple(allowed))
            self.velocity += np.clip(wanted - self.velocity, -RATE, RATE)
            self.time += TICK


def test_faster_and_slower_it_goes_up_and_down_the_gaits_within_their_envelopes() -> None:
    robot = Follower()
    fast = robot.choice.envelope.forward
    robot.go(ZERO_COMMAND, 1.0)
    robot.go(VelocityCommand(9.0), 6.0)
    assert robot.velocity[0] == pytest.approx(fast)
    assert robot.names == list(LADDER)
    robot.go(ZERO_COMMAND, 6.0)
    assert robot.velocity[0] == pytest.approx(0.0)
    assert robot.names == [*LADDER, *LADDER[-2::-1]]
    assert min(np.diff(robot.times)) >= DWELL - 1e-9


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_between_up_and_down_nothing_changes(start: float) -> None:
    slow = envelope_of(GAITS["walk"], USUAL).forward
    robot = Follower()
    robot.go(VelocityCommand(start), 3.0)
    before = len(robot.names)
    robot.go(VelocityCommand(0.5 * (UP + DOWN) * slow), 5.0)
    assert len(robot.names) == before
    assert robot.names[-1] == ("walk" if start == 0.0 else "trot")


def test_turning_and_going_aside_count_too() -> None:
    robot = Follower()
    robot.go(VelocityCommand(0.0, 0.0, USUAL.turning), 5.0)
    assert robot.names == ["walk", "trot"] or robot.names == list(LADDER)
    robot = Follower()
    robot.go(VelocityCommand(0.0, USUAL.lateral), 5.0)
    assert robot.names[-1] != "walk"


def test_a_robot_that_runs_already_begins_with_the_gait_for_that() -> None:
    robot = Follower()
    robot.velocity[0] = 0.6 * USUAL.forward
    robot.go(VelocityCommand(robot.velocity[0]), 2.0)
    assert robot.names == ["trot"]
