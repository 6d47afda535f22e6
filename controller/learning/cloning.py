"""Cloning the trot: a network learns from the whole-body controller what the joints shall do.

DAgger (Ross, Gordon and Bagnell 2011): what the network does decides which states are visited, and
the teacher says in each of them what it would do. It walks in the shadow: its planner and QP are
given the measured state in every tick, while the plant follows another. The label of a period is
the joint target that comes nearest to the teacher's torques tau over its ticks k, with the servo's
gains:

    q* = mean_k (q_k + (tau_k + kd v_k) / kp)       min sum_k |kp (q* - q_k) - kd v_k - tau_k|^2
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from controller.go2_controller import GO2Controller
from controller.learning.network import Network
from controller.policies.policy import Observer, Player, Policy
from controller.policies.sidecar import Sidecar
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.wbc.controller import WholeBodyController

FRICTION, MASS = (0.5, 1.0), (0.9, 1.1)  #: Ranges of the floor's friction and of a factor on masses
FALLEN = 0.8  #: Tilt [rad] at which an episode ends
LOW = 0.16  #: Height [m] of the base at which it does
STEADY = 1.5  #: Time [s] after which a command changes, at least; at most twice that
PUSH = 12.0  #: Greatest impulse [N s] of the pushes that show the network how to recover
PUSH_TIME = 0.1


class Teacher:
    """The whole-body controller's trot, asked what it would do in any state of a robot that trots.

    Its stride does not depend on the speed, and it follows velocities and no places: what it does
    follows from what a policy can observe.
    """

    def __init__(self, model: RobotModel) -> None:
        """Teach robots like ``model``."""
        config = Config()
        walk = replace(config.locomotion, position_leash=0.02, yaw_leash=0.05)
        gait = replace(GAITS["trot"], stride=None)
        self._planner = LocomotionPlanner(model, gait, walk)
        self._wbc, self._model = WholeBodyController(model, config=config.wbc), model
        self.frequency = 1.0 / gait.period

    def start(self, state: RobotState) -> None:
        """Begin with a robot that stands."""
        self._planner.start(self._model.snapshot(state))

    @property
    def phase(self) -> float:
        """Of its stride; see ``LocomotionPlanner.phase``."""
        return self._planner.phase

    def ask(self, state: RobotState, command: VelocityCommand) -> JointCommand:
        """What it would tell the motors."""
        now = self._model.snapshot(state)
        reference = self._planner.update(now, command)
        return self._wbc.solve(now, reference, relax=True).command


@dataclass(slots=True)
class Samples:
    """What was observed, and what the teacher would have done: rows of both."""

    observations: list[Float[np.ndarray, " n"]] = field(default_factory=list)
    actions: list[Float[np.ndarray, "12"]] = field(default_factory=list)


class Lesson:
    """A robot that trots by commands that change, pushed now and then, and is watched.

    Args:
        policy: what is taught.
        share: of the time in which the teacher moves the robot itself.
    """

    def __init__(self, policy: Policy, seed: int, share: float) -> None:
        self._rng = np.random.default_rng(seed)
        self._policy, self._share = policy, share
        rng = self._rng
        self._plant = MujocoPlant(
            friction=rng.uniform(*FRICTION), mass_scale=rng.uniform(*MASS), seed=seed
        )
        go2 = GO2Controller(plant=self._plant)
        go2.stand()
        go2.close()
        self._model = RobotModel()

    def give(self, samples: Samples, seconds: float) -> float:
        """Fill ``samples``; returns how long the robot stayed up [s]."""
        plant, rng, side = self._plant, self._rng, self._policy.sidecar
        lower, upper = self._model.q_lower, self._model.q_upper
        player, watch = Player(self._policy, lower, upper), Observer(side)
        teacher = Teacher(self._model)
        state = plant.read()
        teacher.start(state)
        start = state.time
        period = round(1.0 / (side.rate * plant.control_period))
        command, until = VelocityCommand(), start
        order = np.argsort(side.order)
        kp, kd = side.kp[order], side.kd[order]
        tick, teaches = 0, True
        pushes = start + rng.uniform(2.0, 5.0)
        wish = np.zeros(12)
        has_begun = False
        while state.time - start < seconds:
            if state.time >= until:
                command = draw(side, rng)
                until = state.time + rng.uniform(STEADY, 2.0 * STEADY)
            if state.time >= pushes:
                angle, impulse = rng.uniform(0, 2 * np.pi), rng.uniform(0.0, PUSH)
                f = impulse / PUSH_TIME * np.array([np.cos(angle), np.sin(angle), 0.0])
                plant.push(f, PUSH_TIME)
                pushes = state.time + rng.uniform(1.5, 4.0)
            if tick % (10 * period) == 0:
                teaches = rng.random() < self._share
            told = teacher.ask(state, command)
            if not has_begun:
                player.restart(teacher.phase)
                watch.restart(teacher.phase)
                has_begun = True
            if tick % period == 0:
                if tick:
                    samples.actions.append(
                        ((wish / period)[side.order] * side.signs - side.default) / side.action_scale
                    )
                wish = np.zeros(12)
                samples.observations.append(watch.observe(state, command))
                asked = player.command(state, command)
                watch.action = player.observer.action
            wish += state.joint_positions + (told.tau + kd * state.joint_velocities) / kp
            plant.write(told if teaches else asked)
            state = plant.read()
            tick += 1
            if state.tilt > FALLEN or state.q[2] < LOW:
                break
        del samples.observations[len(samples.actions):]
        return state.time - start


def draw(side: Sidecar, rng: np.random.Generator) -> VelocityCommand:
    """A command that the policy shall follow."""
    x = rng.uniform(*side.commands.forward)
    y, turn = (
        rng.uniform(*bounds) * (rng.random() < 0.5)
        for bounds in (side.commands.lateral, side.commands.turning)
    )
    return VelocityCommand(x, y, turn)
