"""Cloning the trot: a network learns from the whole-body controller what the joints should do.

DAgger (Ross, Gordon and Bagnell 2011): the network's actions decide which states are visited, and
the teacher labels each of them with its own action. The teacher's planner and QP get the measured
state in every tick, while the plant follows the network, at first for a part of the time only. The
label of a period is the joint target that comes nearest to the teacher's torques tau over its ticks
k, with the servo's gains:

    q* = mean_k (q_k + (tau_k + kd v_k) / kp)       min sum_k |kp (q* - q_k) - kd v_k - tau_k|^2
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from controller.observation import STANCE, STANCE_HEIGHT
from controller.policies.network import Network
from controller.policies.policy import Player, Policy
from controller.policies.sidecar import Sidecar
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.plant import MujocoPlant
from go2_wbc.records import Array12
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.wbc.controller import WholeBodyController

FRICTION, MASS = (0.5, 1.0), (0.9, 1.1)  #: Ranges of the floor's friction, of a factor on masses
FALLEN, LOW = 0.5, 0.2  #: Tilt [rad], or height [m] of the base, with which an episode ends
STEADY, PAUSE = (1.5, 3.0), (1.5, 4.0)  #: Time [s] of a command, and between two pushes
PUSH, PUSH_TIME = 12.0, 0.1  #: Greatest impulse [N s] of a push, and its time [s]
TURN = 0.2  #: Time [s] after which it is drawn anew who moves the robot
LEASHES = {"position_leash": 0.02, "yaw_leash": 0.05}
"""[m], [rad] The teacher follows velocities, not places that no policy knows: it is held on short
ones. Shorter still, the network walked 0.07 m/s too fast."""
SHARES = 1.0, 0.6, 0.3, 0.1
"""Of the time in which the teacher moves the robot, round by round; 0 from then on."""


@dataclass(frozen=True, slots=True)
class Course:
    """How long a network is taught."""

    rounds: int = 10  #: of trotting and fitting
    seconds: float = 120.0  #: robot time [s] in each
    steps: int = 2000
    """Of the fit after each, if there are twice as many samples, and fewer with fewer; three times
    as many after the last."""
    units: int = 128  #: in each of the two layers
    seed: int = 0  #: of all that is drawn


@dataclass(frozen=True, slots=True)
class Round:
    """What came of a round."""

    number: int  #: from 1 on
    share: float  #: of the time in which the teacher moved the robot
    stayed_up: float  #: mean time [s] for which the robot did, of ``EPISODE``
    samples: int  #: so far
    error: float  #: root mean square [rad] by which the network misses its labels
    network: Network  #: as it is now


EPISODE = 20.0  #: Longest time [s] that a robot trots before another one begins


def clone(sidecar: Sidecar, course: Course | None = None) -> Iterator[Round]:
    """Teach a network the trot, round by round; what it sees and does is what ``sidecar`` says."""
    c = course or Course()
    rng = np.random.default_rng(c.seed)
    network = Network((sidecar.observation_size, c.units, c.units, 12), rng)
    policy = Policy("student", sidecar, network)
    seen: list[Float[np.ndarray, " n"]] = []
    done: list[Array12] = []
    for number in range(1, c.rounds + 1):
        share = SHARES[number - 1] if number <= len(SHARES) else 0.0
        times: list[float] = []
        while sum(times) < c.seconds:
            lesson = Lesson(policy, rng, share)
            times.append(lesson.give(min(EPISODE, c.seconds)))
            seen += lesson.seen
            done += lesson.done
        steps = min(c.steps, len(seen) // 2) * (1 if number < c.rounds else 3)
        error = network.fit(np.array(seen), np.array(done), steps)
        missed = float(np.sqrt(error) * np.abs(sidecar.action_scale).mean())
        yield Round(number, share, float(np.mean(times)), len(seen), missed, network)


class Teacher:
    """The whole-body controller's trot, asked what it would do with a robot that trots.

    Its stride does not depend on the speed, and it follows velocities and no places: what it does
    follows from what a policy can observe.
    """

    def __init__(self, model: RobotModel, start: RobotState) -> None:
        """Begin with a robot that stands."""
        config, gait = Config(), replace(GAITS["trot"], stride=None)
        self._planner = LocomotionPlanner(model, gait, replace(config.locomotion, **LEASHES))
        self._wbc, self._model = WholeBodyController(model, config=config.wbc), model
        self._planner.start(model.snapshot(start))

    @property
    def phase(self) -> float:
        """Of its stride; see ``LocomotionPlanner.phase``."""
        return self._planner.phase

    def ask(self, state: RobotState, command: VelocityCommand) -> JointCommand:
        """What it would tell the motors."""
        now = self._model.snapshot(state)
        reference = self._planner.update(now, command)
        return self._wbc.solve(now, reference, relax=True).command


class Lesson:
    """A robot that trots by commands that change, pushed now and then, and what is learnt by it.

    Attributes:
        seen, done: observations, and the actions of the teacher.
    """

    def __init__(self, policy: Policy, rng: np.random.Generator, share: float) -> None:
        """Teach ``policy``; for a ``share`` of the time the teacher moves the robot itself."""
        self.seen: list[Float[np.ndarray, " n"]] = []
        self.done: list[Array12] = []
        self._side, self._rng, self._share = policy.sidecar, rng, share
        friction, mass = rng.uniform(*FRICTION), rng.uniform(*MASS)
        self._plant, model = MujocoPlant(friction=friction, mass_scale=mass), RobotModel()
        self._plant.place(np.array([0.0, 0.0, STANCE_HEIGHT, 0.0, 0.0, 0.0, 1.0, *STANCE * 4]))
        self._teacher = Teacher(model, self._plant.read())
        self._player = Player(policy, model.q_lower, model.q_upper)
        order = np.argsort(policy.sidecar.order)
        self._kp, self._kd = policy.sidecar.kp[order], policy.sidecar.kd[order]

    def give(self, seconds: float) -> float:
        """Let the robot trot, for ``seconds`` at most; returns how long it stayed up [s]."""
        plant, rng, side = self._plant, self._rng, self._side
        ticks = round(1.0 / (side.rate * plant.control_period))
        command, changes, pushed, turns = draw(side, rng), 0.0, rng.uniform(*PAUSE), 0.0
        start, teaches = plant.time, True
        while (now := plant.time - start) < seconds:
            if now >= changes:
                command, changes = draw(side, rng), now + rng.uniform(*STEADY)
            if now >= pushed:
                self._push()
                pushed = now + rng.uniform(*PAUSE)
            if now >= turns:
                teaches, turns = rng.random() < self._share, now + TURN
            self._period(command, ticks, is_first=now == 0.0, teaches=teaches)
            state = plant.read()
            if state.tilt > FALLEN or state.q[2] < LOW:
                break
        return now

    def _period(
        self, command: VelocityCommand, ticks: int, *, is_first: bool, teaches: bool
    ) -> None:
        """One period of the policy: what it sees, and what the teacher would do over its ticks."""
        plant, side, wished = self._plant, self._side, np.zeros(12)
        for tick in range(ticks):
            state = plant.read()
            told = self._teacher.ask(state, command)
            if is_first and tick == 0:
                self._player.restart(self._teacher.phase)
            asked = self._player.command(state, command)
            damped = told.tau + self._kd * state.joint_velocities
            wished += state.joint_positions + damped / self._kp
            plant.write(told if teaches else asked)
        self.seen.append(self._player.observation)
        wish = side.signs * (wished / ticks)[side.order]
        self.done.append((wish - side.default) / side.action_scale)

    def _push(self) -> None:
        angle, impulse = self._rng.uniform((0.0, 0.0), (2.0 * np.pi, PUSH))
        force = impulse / PUSH_TIME * np.array([np.cos(angle), np.sin(angle), 0.0])
        self._plant.push(force, PUSH_TIME)


def draw(side: Sidecar, rng: np.random.Generator) -> VelocityCommand:
    """A command that the policy shall follow; every other one is straight, or does not turn."""
    ranges = side.commands
    low, high = zip(ranges.forward, ranges.lateral, ranges.turning, strict=True)
    x, y, turn = rng.uniform(low, high).tolist()
    aside, turns = rng.random(2) < 0.5
    return VelocityCommand(x, y * aside, turn * turns)
