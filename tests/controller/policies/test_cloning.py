"""What the teacher does becomes joint targets, and a network that learns them round by round."""

import numpy as np
import pytest

from controller.policies import TROT, Course, Policy, Sidecar, clone
from controller.policies.cloning import SHARES, Lesson, Teacher
from controller.policies.network import Network
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.state import JointCommand, RobotState

SIDE = Sidecar.load(TROT.with_suffix(".toml"))
IDLE = Policy("idle", SIDE, lambda _: np.zeros(12))


def test_a_label_is_the_target_whose_servo_comes_nearest_to_the_torques_of_its_period(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng, states, torques = np.random.default_rng(1), list[RobotState](), list[np.ndarray]()

    def ask(_: Teacher, state: RobotState, __: VelocityCommand) -> JointCommand:
        states.append(state)
        torques.append(rng.normal(scale=5.0, size=12))
        return JointCommand.torque(torques[-1])

    monkeypatch.setattr(Teacher, "ask", ask)
    lesson = Lesson(IDLE, rng, 1.0)
    lesson.give(0.02)
    (action,), ticks = lesson.done, len(states)
    assert ticks == 10
    label = IDLE.targets(action)

    def error(target: np.ndarray) -> np.ndarray:
        servo = JointCommand(np.zeros(12), target, np.zeros(12), SIDE.kp, SIDE.kd)
        asked = [servo.asked(s.joint_positions, s.joint_velocities) for s in states]
        return ((np.array(asked) - torques) ** 2).sum(axis=0)

    for way in (-1e-3, 1e-3):
        assert (error(label + way) > error(label)).all()


def test_the_teacher_trots_through_commands_and_pushes() -> None:
    lesson = Lesson(IDLE, np.random.default_rng(2), 1.0)
    assert lesson.give(4.0) == pytest.approx(4.0)
    assert len(lesson.seen) == len(lesson.done) == 200
    assert np.isfinite(lesson.done).all()


def test_a_robot_that_nobody_balances_ends_its_lesson() -> None:
    folded = Policy("folded", SIDE, lambda _: np.tile([0.0, 4.0, -4.0], 4))
    assert Lesson(folded, np.random.default_rng(2), 0.0).give(4.0) < 1.0


def test_a_course_goes_through_its_rounds_and_is_the_same_again() -> None:
    course = Course(rounds=2, seconds=2.0, units=16)
    first, again = (list(clone(SIDE, course)) for _ in range(2))
    assert [(r.number, r.share) for r in first] == [(1, SHARES[0]), (2, SHARES[1])]
    assert first[1].samples > first[0].samples == 100
    assert first[1].stayed_up <= 2.0
    for part, same in zip(first[-1].network.parts, again[-1].network.parts, strict=True):
        np.testing.assert_array_equal(part, same)


def test_the_error_that_is_told_is_an_angle_of_the_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Network, "fit", lambda *_: 0.09)  # mean square, of actions
    (only,) = clone(SIDE, Course(rounds=1, seconds=0.1, units=4))
    assert only.error == pytest.approx(0.3 * np.abs(SIDE.action_scale).mean())
