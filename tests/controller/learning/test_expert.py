"""An episode of the expert: targets that mean its torques, a reference that fits what it did."""

import math
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from controller.learning import expert
from controller.learning.expert import Expert, stride_phase
from controller.learning.tasks import TASKS, Shoves
from controller.observation import OBSERVATION, RATE, TARGETS, Actuation
from controller.sweeps.trials import TrialFailed, TrialRobot
from go2_wbc.motion_plan import Posture
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.recording import Recording

TICKS = 10  #: Of the control loop in a row
EDGE = 0.03
"""Share of rows in which a foot changes between the row's beginning and the schedule's edge."""


@pytest.fixture(scope="module")
def walked() -> dict[str, np.ndarray]:
    """Two seconds of a trot; the command changes every half."""
    task = TASKS["velocity"]
    commands = replace(task.commands, linear_x=(0.4, 0.6), every=0.5, standing=0.0)
    return dict(Expert(replace(task, commands=commands), duration=2.0).episode(3))


def test_targets_are_those_whose_servo_gives_the_torques() -> None:
    rng, count = np.random.default_rng(0), 6
    n = TICKS * count + 1
    q, v = rng.uniform(-1.0, 1.0, (n, 19)), rng.uniform(-3.0, 3.0, (n, 18))
    q[:, 3:7] = 0.0, 0.0, 0.0, 1.0
    targets, expert = rng.uniform(-1.0, 1.0, (count, 12)), Expert(TASKS["velocity"])
    held = np.repeat(targets, TICKS, axis=0)
    tau = np.zeros((n, 12))
    tau[1:] = expert.kp * (held - q[:-1, 7:]) - expert.kd * v[:-1, 6:]
    time, rest = 0.002 * np.arange(n), (np.zeros((n, k)) for k in (3, 12, 4, 3))
    rpy, acted, forces, com = rest
    points = np.zeros((n, 4, 3))
    flat = np.zeros(n)
    truth = TruthRecording(
        *(time, q, v, rpy, acted, tau, forces, com, points, points, points, flat, flat, flat > 0.0)
    )
    stance = np.ones((n, 4), dtype=bool)
    recording = Recording(time, q, v, acted, forces, stance, com, flat, ("walk",) * n)
    rows = expert.rows(truth, recording, np.array([[-math.inf, 0.0, 0.0, 0.0]]), 0.5)
    assert rows["joint_targets"] == pytest.approx(targets, abs=1e-5)
    means = tau[1:].reshape(count, TICKS, 12).mean(axis=1)
    assert rows["joint_torques"] == pytest.approx(means, abs=1e-4)
    terms = OBSERVATION.split(rows["observation"])
    assert terms["joint_positions"] == pytest.approx(q[:-1:TICKS, 7:], abs=1e-6)
    assert not rows["phase"].any()


def test_an_observation_tells_the_command_and_what_was_done_before(
    walked: dict[str, np.ndarray],
) -> None:
    terms = OBSERVATION.split(walked["observation"])
    assert len(walked["time"]) == round(2.0 * RATE)
    assert walked["time"] == pytest.approx(np.arange(len(walked["time"])) / RATE)
    assert np.array_equal(terms["command"], walked["command"])
    assert len(np.unique(walked["command"], axis=0)) == 4
    assert (np.flatnonzero(np.diff(walked["command"][:, 0])) == [24, 49, 74]).all()
    acted = Actuation(TARGETS, np.ones(12)).action(walked["joint_targets"])
    assert terms["last_action"][1:] == pytest.approx(acted[:-1], abs=1e-6)
    assert not terms["last_action"][0].any()
    assert walked["seed"].tolist() == [3] * len(walked["seed"])
    assert not walked["fell"].any()


def test_it_walks_as_commanded_in_a_world_of_the_task(walked: dict[str, np.ndarray]) -> None:
    ahead = OBSERVATION.split(walked["observation"])["linear_velocity"][-25:, 0]
    assert ahead.mean() == pytest.approx(walked["command"][-25:, 0].mean(), abs=0.1)
    for name, low, high in (("friction", 0.5, 1.0), ("mass_scale", 0.9, 1.1)):
        assert low <= walked[name][0] <= high
        assert (walked[name] == walked[name][0]).all()
    assert not walked["terrain"].any()  # there is none


def test_the_phase_tells_which_feet_the_gait_wants_down(walked: dict[str, np.ndarray]) -> None:
    phase, stance = walked["phase"][25:], walked["stance"][25:]
    first = (phase >= 0.5) & (phase < 1.0)  # the trot's duty is a half, FL and RR begin at 0.5
    for leg in (0, 3):
        assert (stance[:, leg] != first).mean() <= EDGE + 0.5 / (0.36 * RATE) * 2.0
        assert (stance[:, leg] == first).mean() > 0.8


def test_a_stride_turns_once_from_touchdown_to_touchdown_and_stands_at_0() -> None:
    time = np.arange(0.0, 4.0, 0.002)
    stance = ((time - 0.1) % 0.4 < 0.2) | (time > 2.1)
    phase = stride_phase(time, stance, 0.5)
    expected = ((time - 0.1) / 0.4 + 0.5) % 1.0
    walks = (time > 0.15) & (time < 1.8)
    apart = np.abs((phase - expected + 0.5) % 1.0 - 0.5)
    assert apart[walks].max() < 0.01
    assert not phase[time > 2.6].any()
    assert not stride_phase(time, np.ones(len(time), dtype=bool), 0.5).any()


@pytest.mark.parametrize("fall", [None, "on its back"])
@pytest.mark.parametrize("archive", [b"", b"plan"])
def test_what_is_commanded_is_told_from_none_on_and_whether_it_fell(
    monkeypatch: pytest.MonkeyPatch, archive: bytes, fall: str | None
) -> None:
    """Of a walk of half a second, with a command each quarter, or of a motion, which has none."""
    monkeypatch.setattr(expert, "plan_of", lambda _: SimpleNamespace(entry=Posture.SIT))
    asked = list[object]()

    def wait(seconds: float) -> None:
        robot.plant.time += seconds
        if fall:
            raise TrialFailed(fall)

    robot = Mock(
        spec=TrialRobot,
        plant=SimpleNamespace(time=2.0),
        go2=SimpleNamespace(
            walk=lambda gait: asked.append(gait) or True,
            play=lambda *_, **more: asked.append(more),
            move=lambda x, turn, linear_y: asked.append((x, linear_y, turn)),
            command=VelocityCommand(0.1, 0.2, 0.3),
        ),
        truth=SimpleNamespace(clear=lambda: asked.append("clear"), fall=lambda: fall),
        require=lambda ok: None,
        get_ready=asked.append,
        wait=wait,
    )
    commands = replace(TASKS["velocity"].commands, every=0.25)
    task = replace(TASKS["velocity"], commands=commands)
    rng = np.random.default_rng(0)
    told, phase, fell = Expert(task, archive=archive, duration=0.5)._done(robot, rng)
    assert fell is (fall is not None)
    assert told[0] == (-math.inf, 0.0, 0.0, 0.0)
    times = [] if archive else [2.0] if fall else [2.0, 2.25]
    assert told[1:] == [(time, 0.1, 0.2, 0.3) for time in times]
    assert phase == pytest.approx(math.nan if archive else 0.5, nan_ok=True)
    rng = np.random.default_rng(0)
    drawn = [tuple(commands.draw(rng).tolist()) for _ in times]
    played = [Posture.SIT, "clear", {"check": False, "allow_dynamic": True}]
    assert asked == (played if archive else ["trot", "clear", *drawn])


def test_rows_end_where_the_robot_falls() -> None:
    shoves = Shoves(every=(0.5, 0.6), impulse=(90.0, 100.0))
    rows = Expert(replace(TASKS["push"], shoves=shoves), duration=3.0).episode(1)
    assert rows["fell"].all()
    assert 0 < len(rows["time"]) < round(3.0 * RATE)
