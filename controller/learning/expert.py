"""An episode of the expert: ``GO2Controller`` walks, or plays a motion; what a learner needs of it.

A row is a period of 0.02 s: the observation at its beginning, as in ``OBSERVATION``, and the
expert's action until its end. In the ticks i of the period the expert asks for the torques tau_i.
The torque of the row is their mean; its joint targets are those whose servo comes nearest to them
(least squares of kp (u - q_i) - kd v_i - tau_i over u):

    u = mean(q_i + (tau_i + kd v_i) / kp)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from controller.learning.tasks import LearningTask
from controller.observation import KD, KP, OBSERVATION, RATE, TARGETS, Actuation, observed
from controller.sweeps.motion_study import plan_of
from controller.sweeps.trials import TrialFailed, TrialRobot
from go2_wbc.contacts import find_gait
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.recording import Recording
from go2_wbc.robot.state import RobotState

EPISODE = 20.0  #: Time [s] of a walk
LONGEST_STRIDE = 1.0  #: Time [s] between two touchdowns from which on the robot has rested
_TICKS = 500.0  # a second: the rate at which the recording has every tick

Arrays = Mapping[str, np.ndarray]
"""What the rows hold, by name; the first axis is that of the rows."""


@dataclass(frozen=True, slots=True)
class Expert:
    """What the expert does in an episode, and where."""

    task: LearningTask  #: commands, world, ground and pushes; actions are never delayed
    gait: str = "trot"  #: in which it walks
    archive: bytes = b""
    """Of a motion's plan (``sweeps.motion_study.archive_of``), which it plays instead."""
    duration: float = EPISODE  #: of a walk [s]
    kp: float = KP  #: of the servo for which joint targets are meant [N m/rad]
    kd: float = KD  #: of the same [N m s/rad]

    def episode(self, seed: int) -> Arrays:
        """The rows of an episode that is drawn from ``seed``; they end where the robot falls.

        Raises:
            TrialFailed: if the robot did not get as far as the walk or the motion.
        """
        rng, task = np.random.default_rng(seed), self.task
        world = replace(task.draw_world(rng), delay=0.0)
        number = int(rng.integers(len(task.terrains))) if task.terrains else 0
        plant = MujocoPlant(
            terrain=task.terrains[number] if task.terrains else None,
            seed=seed,
            initial_yaw=float(rng.uniform(*task.yaw)),
            initial_joint_noise=task.joint_noise,
        )
        plant.vary(world)
        with TrialRobot(plant) as robot:
            commands, phase, fell = self._done(robot, rng)
            truth, recording = robot.truth.recording(), robot.go2.recording(_TICKS)
        rows = self.rows(truth, recording, np.array(commands), phase)
        told = (
            ("friction", world.friction),
            ("mass_scale", world.mass_scale),
            ("joint_friction", world.joint_friction),
            ("terrain", number),
            ("fell", fell),
            ("seed", seed),
        )
        count = len(rows["time"])
        return {**rows, **{name: np.full(count, value) for name, value in told}}

    def _done(
        self, robot: TrialRobot, rng: np.random.Generator
    ) -> tuple[list[tuple[float, ...]], float, bool]:
        """Do it: commands with their times, the stride's phase where FL touches, whether it fell.

        Of a motion, which has no stride, that phase is nan.
        """
        go2, told = robot.go2, [(-math.inf, 0.0, 0.0, 0.0)]
        if self.archive:
            plan = plan_of(self.archive)
            robot.get_ready(plan.entry)
            robot.truth.clear()
            go2.play(plan, check=False, allow_dynamic=True)
            return told, math.nan, robot.truth.fall() is not None
        robot.require(go2.walk(self.gait))
        robot.truth.clear()
        try:
            self._walk(robot, rng, told)
        except TrialFailed:
            return told, find_gait(self.gait).offsets[0], True
        return told, find_gait(self.gait).offsets[0], False

    def _walk(
        self, robot: TrialRobot, rng: np.random.Generator, told: list[tuple[float, ...]]
    ) -> None:
        commands, shoves, start = self.task.commands, self.task.shoves, robot.plant.time
        command_due, shove_due = start, math.inf
        if shoves is not None:
            shove_due = start + rng.uniform(*shoves.every)
        end = start + self.duration
        while (now := robot.plant.time) < end - 0.5 / _TICKS:
            if now >= command_due:
                x, y, turn = commands.draw(rng).tolist()
                robot.go2.move(x, turn, linear_y=y)
                own = robot.go2.command
                told.append((now, own.linear_x, own.linear_y, own.angular_z))
                command_due += commands.every
            if shoves is not None and now >= shove_due:
                robot.plant.push(shoves.draw(rng), shoves.duration)
                shove_due += rng.uniform(*shoves.every)
            robot.wait(max(min(command_due, shove_due, end) - now, 1.0 / _TICKS))

    def rows(
        self,
        truth: TruthRecording,
        recording: Recording,
        commands: Float[np.ndarray, "k 4"],
        phase: float,
    ) -> dict[str, np.ndarray]:
        """The rows of a run.

        Args:
            truth, recording: every tick of it.
            commands: rows of time [s] and command, from when on it was followed.
            phase: of the stride where FL touches down; nan if there is none.
        """
        ticks = round(_TICKS / RATE)
        count = (len(truth.time) - 1) // ticks
        first = ticks * np.arange(count)
        every = first[:, None] + np.arange(ticks)
        tau = truth.tau_asked[every + 1]  # what led to the next state
        targets = truth.q[every, 7:] + (tau + self.kd * truth.v[every, 6:]) / self.kp
        targets, tau = targets.mean(axis=1), tau.mean(axis=1)
        time = truth.time[first]
        ticked = np.searchsorted(recording.time, time - 0.5 / _TICKS)
        ticked = np.minimum(ticked, len(recording.time) - 1)
        asked = commands[np.searchsorted(commands[:, 0], time + 0.5 / _TICKS) - 1, 1:]
        stance = recording.stance[ticked]
        if math.isnan(phase):
            share = np.linspace(0.0, 1.0, count, endpoint=False)
        else:
            share = stride_phase(recording.time, recording.stance[:, 0], phase)[ticked]
        actions = Actuation(TARGETS, np.ones(12), self.kp, self.kd).action(targets)
        last = np.vstack([np.zeros((min(count, 1), 12)), actions[:-1]])
        seen = [
            observed(OBSERVATION, _state(truth, row), *now)
            for row, *now in zip(first.tolist(), asked, share.tolist(), last, strict=True)
        ]
        return {
            "step": np.arange(count),
            "time": time - truth.time[0],
            "observation": np.array(seen, dtype=np.float32).reshape(count, OBSERVATION.size),
            "joint_targets": targets.astype(np.float32),
            "joint_torques": tau.astype(np.float32),
            "command": asked.astype(np.float32),
            "phase": share.astype(np.float32),
            "stance": stance,
        }


def stride_phase(
    time: Float[np.ndarray, " n"], stance: Bool[np.ndarray, " n"], at_touchdown: float
) -> Float[np.ndarray, " n"]:
    """Phase of the stride, 0 to 1, from where a foot is planned to stand; 0 while it only stands.

    Args:
        time: [s].
        stance: of the foot.
        at_touchdown: phase of the stride in which it touches down.
    """
    starts = time[1:][stance[1:] & ~stance[:-1]]
    strides = np.diff(starts)
    usual = strides[strides < LONGEST_STRIDE]
    if not len(usual):
        return np.zeros(len(time))
    last = np.searchsorted(starts, time, side="right") - 1  # -1 before the first
    period = np.append(strides, np.median(usual))[last]
    period = np.where(period < LONGEST_STRIDE, period, np.median(usual))
    turned = (time - starts[np.maximum(last, 0)]) / period
    return np.where(np.abs(turned) < 1.0, (turned + at_touchdown) % 1.0, 0.0)


def _state(truth: TruthRecording, row: int) -> RobotState:
    forces = truth.foot_forces[row]
    state = truth.q[row], truth.v[row], truth.tau[row]
    return RobotState(float(truth.time[row]), *state, forces, forces > 0.0)
