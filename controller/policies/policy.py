"""A learned policy: a network in an ONNX file, its sidecar, and its memory while it runs.

In each period: the measured state -> one row of the observation, with the rows before it -> network
-> action -> joint targets, which the plant's servos follow (``sidecar`` has the equations). Phases
are 0 where the front left foot touches down.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from controller.observation import sensed
from controller.policies.sidecar import Sidecar
from go2_wbc.arguments import typed
from go2_wbc.errors import PolicyError, needing
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.records import Array12
from go2_wbc.robot.state import JointCommand, RobotState

Network = Callable[[Float[np.ndarray, " n"]], Float[np.ndarray, " m"]]
"""From an observation to an action."""
NOWHERE = np.zeros(12)
NOWHERE.flags.writeable = False


class Policy:
    """A network and what its numbers mean.

    Attributes:
        name: of its file.
        sidecar: what its numbers mean.
        network: from an observation to an action.
    """

    @typed(error=PolicyError)
    def __init__(self, name: str, sidecar: Sidecar, network: Network) -> None:
        """A policy of any network; ``load`` makes one of a file."""
        self.name, self.sidecar, self.network = name, sidecar, network

    def __repr__(self) -> str:
        """Its file, rate and size."""
        side = self.sidecar
        return f"<Policy {self.name}: {side.rate:g} Hz, {side.observation_size} numbers in>"

    @staticmethod
    @typed(error=PolicyError)
    def load(path: Path | str, sidecar: Sidecar | Path | str | None = None) -> Policy:
        """The policy of an ONNX file.

        Args:
            path: of the network.
            sidecar: what its numbers mean; by default of the file beside it with the suffix
                ``.toml``.

        Raises:
            PolicyError: if the files cannot be used, or do not fit each other.
            MissingDependency: without the extra ``policies``; names the install line.
        """
        path = Path(path)
        if not path.is_file():
            raise PolicyError(f"there is no policy {path}")
        if not isinstance(sidecar, Sidecar):
            sidecar = Sidecar.load(path.with_suffix(".toml") if sidecar is None else sidecar)
        return Policy(path.name, sidecar, _network(path, sidecar.observation_size))

    def act(self, observation: Float[np.ndarray, " n"]) -> Array12:
        """The action, clipped.

        Raises:
            PolicyError: if it is not finite.
        """
        action = np.asarray(self.network(observation), dtype=float)
        if not np.isfinite(action).all():
            raise PolicyError(f"policy {self.name} gave {action.tolist()}")
        return np.clip(action, -self.sidecar.action_clip, self.sidecar.action_clip)

    def targets(self, action: Array12) -> Array12:
        """Joint angles [rad] that an action asks for, in this project's order and signs."""
        side, targets = self.sidecar, np.empty(12)
        targets[side.order] = side.signs * (side.default + side.action_scale * action)
        return targets


class Player:
    """Plays a policy: asked every tick, it lets the policy see and act at its own rate.

    Attributes:
        policy: what is played.
        observation: the last one.
        action: of the last period; the network's own numbers.
        phase: of a stride, of each term that is one, 0 to 1.
    """

    def __init__(self, policy: Policy, lower: Array12, upper: Array12) -> None:
        """Play ``policy``; its targets are kept within these joint angles [rad]."""
        self.policy, self._lower, self._upper = policy, lower, upper
        self._sidecar = policy.sidecar
        order = np.argsort(policy.sidecar.order)
        self._gains = policy.sidecar.kp[order], policy.sidecar.kd[order]
        self.restart(0.0)

    def restart(self, phase: float) -> None:
        """Forget all, and begin anew at ``phase`` of the stride."""
        self.action = np.zeros(12)
        self.phase = np.full(len(self._sidecar.terms), phase)
        self._rows: Float[np.ndarray, "h n"] | None = None
        self._next, self._targets, self.observation = -np.inf, NOWHERE, NOWHERE

    def command(self, state: RobotState, command: VelocityCommand = ZERO_COMMAND) -> JointCommand:
        """What the servos are told now.

        Raises:
            PolicyError: if the network gives what is not finite.
        """
        period = 1.0 / self.policy.sidecar.rate
        if state.time >= self._next - 1e-6:
            is_late = state.time - self._next > 0.5 * period
            self._next = period + (state.time if is_late else self._next)
            self.observation = self.observe(state, command)
            self.action = self.policy.act(self.observation)
            self._targets = np.clip(self.policy.targets(self.action), self._lower, self._upper)
        return JointCommand(NOWHERE, self._targets, NOWHERE, *self._gains)

    def observe(self, state: RobotState, command: VelocityCommand) -> Float[np.ndarray, " n"]:
        """The observation of this period; at first its history is the same row again and again."""
        row = self._row(state, command)
        before = self._rows
        repeated = np.tile(row, (self._sidecar.history, 1))
        self._rows = repeated if before is None else np.vstack([before[1:], row])
        rows = self._rows if self._sidecar.oldest_first else self._rows[::-1]
        if not self._sidecar.by_terms:
            return rows.ravel()
        ends = np.cumsum([len(term.scale) for term in self._sidecar.terms])[:-1]
        return np.concatenate([part.ravel() for part in np.split(rows, ends, axis=1)])

    def _row(self, state: RobotState, command: VelocityCommand) -> Float[np.ndarray, " n"]:
        side, parts = self._sidecar, []
        seen = sensed(state)
        values = {
            **seen,
            "command": np.array([command.linear_x, command.linear_y, command.angular_z]),
            "joint_positions": side.signs * seen["joint_positions"][side.order] - side.default,
            "joint_velocities": side.signs * seen["joint_velocities"][side.order],
            "last_action": self.action,
        }
        for i, term in enumerate(side.terms):
            if term.frequency:
                angles = 2.0 * np.pi * (self.phase[i] + np.array(term.offsets))
                value = np.column_stack([np.sin(angles), np.cos(angles)]).ravel()
                self.phase[i] = (self.phase[i] + term.frequency / side.rate) % 1.0
            else:
                value = values[term.name]
            parts.append(term.scale * value)
        return np.clip(np.concatenate(parts), -side.observation_clip, side.observation_clip)


def _network(path: Path, size: int) -> Network:
    """The network of an ONNX file, which must take ``size`` numbers and give 12."""
    with needing("policies", "a learned policy needs onnxruntime"):
        import onnxruntime
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    try:
        session = onnxruntime.InferenceSession(str(path), options, ["CPUExecutionProvider"])
    except Exception as error:  # it has a class for each kind of failure
        raise PolicyError(f"{path} is no network that onnxruntime can run: {error}") from error
    inputs, outputs = session.get_inputs(), session.get_outputs()
    if len(inputs) != 1:
        names = ", ".join(each.name for each in inputs)
        raise PolicyError(f"{path} takes {len(inputs)} inputs ({names}); one is supported")
    taken, shape = inputs[0].name, inputs[0].shape
    if shape and isinstance(shape[-1], int) and shape[-1] != size:
        raise PolicyError(f"{path} takes {shape[-1]} numbers, its sidecar describes {size}")
    name = outputs[0].name
    is_flat = len(shape) == 1

    def network(observation: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
        given = observation.astype(np.float32)
        (action,) = session.run([name], {taken: given if is_flat else given[None]})
        return np.asarray(action).ravel()

    try:
        found = network(np.zeros(size)).shape
    except Exception as error:
        raise PolicyError(f"{path} does not run on {size} numbers: {error}") from error
    if found != (12,):
        raise PolicyError(f"{path} gives {found[0]} actions, a robot has 12 joints")
    return network
