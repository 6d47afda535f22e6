"""Observations and actions of a learner: names, units and order, described once.

The environment, data sets and policies hold the numbers of a ``Layout``, one term after the other.
``OBSERVATION`` and ``ACTIONS`` are the layouts; this module depends on no training framework.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Float32

from go2_wbc.brief import brief
from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.records import Array3, Array12
from go2_wbc.robot.state import JointCommand, RobotState

RATE = 50.0
"""Actions a second: what most published policies of the Go2 run at (legged_gym, Isaac Lab)."""
KP, KD = 40.0, 1.0
"""Of the joints' servo [N m/rad], [N m s/rad]; published policies have 20 to 40 and 0.5 to 1."""
STANCE = (0.0, 0.8, -1.6)
"""Angles [rad] of hip, thigh and calf from which targets count: feet below the hips."""
STANCE_HEIGHT = 0.32  #: of the base [m] in that stance, on soles that just touch


@dataclass(frozen=True, slots=True)
class Term:
    """Numbers that belong together."""

    name: str  #: of all of them
    parts: tuple[str, ...]  #: name of each, in order
    units: tuple[str, ...]  #: of each; "1" for a share or a direction
    limit: float  #: magnitude from which on each is cut
    about: str  #: what it is, in a line

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.parts)

    __repr__ = brief


def _term(name: str, parts: Iterable[str], unit: str, limit: float, about: str) -> Term:
    """A term; units are told apart by commas where they differ."""
    names, units = tuple(parts), unit.split(", ")
    return Term(name, names, tuple(units if len(units) > 1 else units * len(names)), limit, about)


@dataclass(frozen=True)
class Layout:
    """Terms, one after the other in one array."""

    terms: tuple[Term, ...]

    __repr__ = brief

    @property
    def names(self) -> tuple[str, ...]:
        """Of the terms."""
        return tuple(term.name for term in self.terms)

    @property
    def parts(self) -> tuple[str, ...]:
        """``term.part`` of each number."""
        return tuple(f"{term.name}.{part}" for term in self.terms for part in term.parts)

    @property
    def units(self) -> tuple[str, ...]:
        """Of each number."""
        return tuple(unit for term in self.terms for unit in term.units)

    @property
    def size(self) -> int:
        """How many numbers."""
        return len(self.units)

    @cached_property
    def limits(self) -> Float32[np.ndarray, " size"]:
        """Magnitude from which on each number is cut."""
        limits = [term.limit for term in self.terms for _ in term.parts]
        return np.array(limits, dtype=np.float32)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where each term is."""
        ends = np.cumsum([term.size for term in self.terms]).tolist()
        return {
            term.name: slice(end - term.size, end)
            for term, end in zip(self.terms, ends, strict=True)
        }

    def chosen(self, names: Iterable[str]) -> Layout:
        """Some of the terms, in the order of ``names``.

        Raises:
            CommandError: for a name that no term has, or that comes twice.
        """
        terms, wanted = {term.name: term for term in self.terms}, tuple(names)
        for name in wanted:
            if name not in terms:
                raise CommandError(unknown_name("term", str(name), terms))
        if not wanted or len(set(wanted)) != len(wanted):
            raise CommandError(f"terms must be named, each once, got {wanted}")
        return Layout(tuple(terms[name] for name in wanted))

    def joined(self, values: Mapping[str, Float[np.ndarray, " n"]]) -> Float32[np.ndarray, " size"]:
        """The terms' values in one array, cut to the limits."""
        row = np.concatenate([values[term.name] for term in self.terms])
        limits = self.limits
        return np.clip(row, -limits, limits).astype(np.float32)

    def split(self, row: Float[np.ndarray, "*n size"]) -> dict[str, Float[np.ndarray, "*n k"]]:
        """The terms of rows, by name."""
        return {name: row[..., where] for name, where in self.slices.items()}

    def table(self) -> str:
        """Place, name, unit and meaning, a line for each term."""
        lines = []
        for term in self.terms:
            where = self.slices[term.name]
            units = ", ".join(dict.fromkeys(term.units))
            lines.append(f"{where.start}:{where.stop}  {term.name} [{units}]: {term.about}")
        return "\n".join(lines)


_XYZ = ("x", "y", "z")
_COMMAND = ("linear_x", "linear_y", "angular_z")

OBSERVATION = Layout(
    (
        _term("linear_velocity", _XYZ, "m/s", 20.0, "of the base, in its frame"),
        _term("angular_velocity", _XYZ, "rad/s", 50.0, "of the base, in its frame"),
        _term("gravity", _XYZ, "1", 1.0, "its direction in the base frame; level 0, 0, -1"),
        _term("command", _COMMAND, "m/s, m/s, rad/s", 10.0, "ahead, to the left, turning left"),
        _term("clock", ("sin", "cos"), "1", 1.0, "of the gait's phase, a turn a stride"),
        _term("joint_positions", JOINT_NAMES, "rad", 2.0 * math.pi, "angles of the joints"),
        _term("joint_velocities", JOINT_NAMES, "rad/s", 100.0, "of the joints"),
        _term("last_action", JOINT_NAMES, "1", 1.0, "what was done in the last period; 0 at first"),
    )
)
"""What the environment shows, and the rows of a data set hold."""

TARGETS, TORQUES = "targets", "torques"
ACTIONS = {
    TARGETS: Layout(
        (_term(TARGETS, JOINT_NAMES, "rad", 1.0, "targets of the joints, from the stance"),)
    ),
    TORQUES: Layout(
        (_term(TORQUES, JOINT_NAMES, "1", 1.0, "torques, as shares of the joints' limits"),)
    ),
}
"""What may be done, by the name of its kind: twelve numbers within 1."""


@dataclass(frozen=True, slots=True)
class Actuation:
    """What actions mean: turns them into commands, and back."""

    kind: str
    """"targets" of the joints' servo, which the plant evaluates in every physics step, or
    "torques"."""
    torque_limits: Array12  #: of the joints [N m], which torques are shares of
    kp: float = KP  #: of the servo [N m/rad]
    kd: float = KD  #: of the servo [N m s/rad]
    stance: tuple[float, ...] = STANCE * 4  #: angles of the joints [rad] from which targets count
    reach: float = 1.0  #: way [rad] that an action of 1 means

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise CommandError for an unknown kind."""
        if self.kind not in ACTIONS:
            raise CommandError(unknown_name("action", str(self.kind), ACTIONS))

    def command(self, action: Float[np.ndarray, "12"]) -> JointCommand:
        """What the motors are told for an action; what is beyond 1 is cut."""
        action, zeros = np.clip(action.astype(float), -1.0, 1.0), np.zeros(12)
        if self.kind == TORQUES:
            return JointCommand.torque(action * self.torque_limits)
        targets = np.array(self.stance) + self.reach * action
        gains = np.full(12, self.kp), np.full(12, self.kd)
        return JointCommand(zeros, targets, zeros, *gains)

    def action(self, meant: Float[np.ndarray, "*n 12"]) -> Float32[np.ndarray, "*n 12"]:
        """The action that comes nearest to joint targets [rad], or torques [N m]."""
        if self.kind == TORQUES:
            shares = meant / self.torque_limits
        else:
            shares = (meant - np.array(self.stance)) / self.reach
        return np.clip(shares, -1.0, 1.0).astype(np.float32)


def sensed(state: RobotState) -> dict[str, Float[np.ndarray, " n"]]:
    """The terms of ``OBSERVATION`` that a state tells."""
    return {
        "linear_velocity": state.v[:3],
        "angular_velocity": state.v[3:6],
        "gravity": -state.R_world_base[2],
        "joint_positions": state.joint_positions,
        "joint_velocities": state.joint_velocities,
    }


def observed(
    layout: Layout,
    state: RobotState,
    command: Array3,
    phase: float,
    last_action: Float[np.ndarray, "12"],
) -> Float32[np.ndarray, " size"]:
    """The observation.

    Args:
        layout: which terms.
        state: as the plant tells it.
        command: ahead, left [m/s], turning left [rad/s].
        phase: of the gait, 0 to 1.
        last_action: within 1.
    """
    turn = 2.0 * math.pi * phase
    clock = np.array([math.sin(turn), math.cos(turn)])
    values = {"command": command, "clock": clock, "last_action": last_action}
    return layout.joined({**sensed(state), **values})
