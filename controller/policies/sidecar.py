"""The sidecar of a policy: what the inputs and outputs of its network mean.

A TOML file beside the network, ``trot.toml`` for ``trot.onnx``. With s the ``signs`` and P the
``order`` of the joints, scale, default pose and gains in that order:

    q_policy = s * q[P]             joints as the policy counts them
    q_des[P] = s * (default + scale * action)
    tau = kp (q_des - q) - kd v     evaluated by the plant, as by the joint boards of the robot

The observation is one row: its terms one after the other, each ``scale * value``, clipped. With a
history of n it has n rows, as ``frames`` (row after row) or by ``terms`` (of each term n values).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import PolicyError, unknown_name
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.records import Array12
from go2_wbc.robot.description import GO2
from go2_wbc.validation import is_finite_number

SIZES = {
    "linear_velocity": 3,
    "angular_velocity": 3,
    "gravity": 3,
    "command": 3,
    "joint_positions": 12,
    "joint_velocities": 12,
    "last_action": 12,
    "clock": 2,
}
"""What an observation may hold, and how many numbers; of a clock for each of its offsets."""
LAYOUTS = ("frames", "terms")
RANGES = ("forward", "lateral", "turning")
RATES = 10.0, 500.0  #: Least and greatest rate [Hz] of a policy
MOST_HISTORY = 100


@dataclass(frozen=True, slots=True)
class Term:
    """A part of the observation."""

    name: str  #: a key of ``SIZES``
    scale: Float[np.ndarray, " n"]  #: of each of its numbers
    frequency: float = 0.0  #: of a clock [Hz]
    offsets: tuple[float, ...] = ()
    """Of a clock: for each one sine and cosine of its phase plus it."""

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class CommandRanges:
    """Commands that a policy has been trained on: of each speed the least and the greatest."""

    forward: tuple[float, float]  #: speed ahead [m/s]
    lateral: tuple[float, float]  #: speed to the left [m/s]
    turning: tuple[float, float]  #: turning rate to the left [rad/s]

    def clip(self, command: VelocityCommand) -> VelocityCommand:
        """``command``, each speed within its range; no command stays none."""
        if command.is_zero:
            return command
        asked = command.linear_x, command.linear_y, command.angular_z
        ranges = self.forward, self.lateral, self.turning
        clipped = (min(max(x, low), high) for x, (low, high) in zip(asked, ranges, strict=True))
        return VelocityCommand(*clipped)

    def excess(self, command: VelocityCommand) -> str:
        """What there is to say of a command that lies outside, or nothing."""
        if (followed := self.clip(command)) == command:
            return ""
        return f"velocity command clipped from {command} to {followed}"

    def is_far(self, command: VelocityCommand) -> bool:
        """Whether ``command`` is so far outside that other units may be meant."""
        asked = command.linear_x, command.linear_y, command.angular_z
        widest = [max(map(abs, bounds)) for bounds in (self.forward, self.lateral, self.turning)]
        return any(abs(x) > 2.0 * max(most, 0.5) for x, most in zip(asked, widest, strict=True))

    def __str__(self) -> str:
        """The ranges with their units."""
        (a, b), (c, d), (e, f) = self.forward, self.lateral, self.turning
        return f"{a:g} to {b:g} m/s ahead, {c:g} to {d:g} aside, {e:g} to {f:g} rad/s"


@dataclass(frozen=True, slots=True)
class Sidecar:
    """What the numbers of a policy mean; see the module."""

    robot: str  #: name of the profile of the robot that it drives
    rate: float  #: of the policy [Hz]
    order: Int[np.ndarray, "12"]  #: for each of its joints the number of ours, FL hip to RR calf
    signs: Array12  #: 1, or -1 where its joint turns the other way
    default: Array12  #: joint angles [rad] where its actions are 0, and its joint positions
    action_scale: Array12  #: [rad] per action
    action_clip: float  #: actions are clipped to plus or minus this
    kp: Array12  #: stiffness of the joints [N m/rad]
    kd: Array12  #: damping of the joints [N m s/rad]
    commands: CommandRanges  #: on which it was trained
    terms: tuple[Term, ...]  #: of the observation
    history: int  #: how many rows an observation holds, this one included
    by_terms: bool  #: whether of each term all rows stand together
    oldest_first: bool  #: whether the oldest row, or value, comes first
    observation_clip: float  #: terms are clipped to plus or minus this

    __repr__ = brief

    @property
    def row_size(self) -> int:
        """Numbers in one row of the observation."""
        return sum(len(term.scale) for term in self.terms)

    @property
    def observation_size(self) -> int:
        """Numbers that go into the network."""
        return self.history * self.row_size

    @staticmethod
    @typed(error=PolicyError)
    def load(path: Path | str) -> Sidecar:
        """Read the sidecar ``path``.

        Raises:
            PolicyError: if it cannot be read, lacks something, or holds what is not valid; names
                the key, and what is.
        """
        try:
            with Path(path).open("rb") as file:
                return parse(tomllib.load(file))
        except OSError as error:
            raise PolicyError(f"{path}: {error.strerror}; see the page on sidecars") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise PolicyError(f"{path} is no TOML: {error}") from error
        except PolicyError as error:
            raise PolicyError(f"{path}: {error}") from None


def parse(content: Mapping[str, Any]) -> Sidecar:
    """The sidecar of a TOML file's content.

    Raises:
        PolicyError: see ``Sidecar.load``.
    """
    top = _Table(content, "")
    top.only("format", "robot", "rate", "joints", "action", "commands", "observation")
    if top.value("format") != 1:
        raise PolicyError(f"format must be 1, got {top.value('format')!r}")
    joints, action = top.table("joints"), top.table("action")
    joints.only("order", "signs", "default")
    action.only("scale", "clip", "kp", "kd")
    commands, observation = top.table("commands"), top.table("observation")
    commands.only(*RANGES)
    observation.only("terms", "history", "layout", "oldest_first", "clip")
    signs = joints.numbers("signs", 12, 1.0)
    if not (np.abs(signs) == 1.0).all():
        raise PolicyError(f"joints.signs must be 1 or -1, got {signs.tolist()}")
    action_scale = action.numbers("scale", 12)
    if not action_scale.all():
        raise PolicyError("action.scale must not be 0")
    history = observation.number("history", 1, MOST_HISTORY, 1)
    oldest_first = observation.value("oldest_first", True)
    if history % 1.0:
        raise PolicyError(f"observation.history must be a whole number, got {history:g}")
    if not isinstance(oldest_first, bool):
        raise PolicyError(
            f"observation.oldest_first must be true or false, got {oldest_first!r:.80}"
        )
    layout = observation.value("layout", "frames")
    if layout not in LAYOUTS:
        raise PolicyError(unknown_name("observation.layout", layout, LAYOUTS))
    terms = observation.value("terms")
    if not isinstance(terms, list) or not terms:
        raise PolicyError("observation.terms must be tables [[observation.terms]]")
    robot = top.value("robot", GO2)
    return Sidecar(
        robot=str(robot),
        rate=top.number("rate", *RATES),
        order=_order(joints.value("order")),
        signs=signs,
        default=joints.numbers("default", 12),
        action_scale=action_scale,
        action_clip=action.number("clip", 0.0, np.inf, 100.0),
        kp=action.gains("kp"),
        kd=action.gains("kd"),
        commands=CommandRanges(*(commands.range(name) for name in RANGES)),
        terms=tuple(_term(term, f"observation.terms[{i}]") for i, term in enumerate(terms)),
        history=int(history),
        by_terms=layout == "terms",
        oldest_first=oldest_first,
        observation_clip=observation.number("clip", 0.0, np.inf, 100.0),
    )


def _order(names: object) -> Int[np.ndarray, "12"]:
    """The joints' numbers by their names, with or without ``_joint``."""
    if not isinstance(names, list):
        raise PolicyError(f"joints.order must be a list of 12 names, got {names!r:.80}")
    known = [f"{str(name).removesuffix('_joint')}_joint" for name in names]
    for name in known:
        if name not in JOINT_NAMES:
            raise PolicyError(unknown_name("name in joints.order", name, JOINT_NAMES))
    if sorted(known) != sorted(JOINT_NAMES):
        missing = [name for name in JOINT_NAMES if name not in known]
        raise PolicyError(
            f"joints.order must name each of 12 joints once, got {len(known)}"
            + (f" without {', '.join(missing)}" if missing else "")
        )
    return np.array([JOINT_NAMES.index(name) for name in known])


def _term(content: object, where: str) -> Term:
    if not isinstance(content, dict):
        raise PolicyError(f'{where} must be a table with a "name"')
    table = _Table(content, f"{where}.")
    name = table.value("name")
    if name not in SIZES:
        raise PolicyError(unknown_name(f"{where}.name", str(name), SIZES))
    if name != "clock":
        table.only("name", "scale")
        return Term(name, table.numbers("scale", SIZES[name], 1.0))
    table.only("name", "scale", "frequency", "offsets")
    offsets = table.value("offsets", [0.0])
    if not isinstance(offsets, list) or not offsets or not all(map(is_finite_number, offsets)):
        raise PolicyError(f"{where}.offsets must be a list of numbers, got {offsets!r:.80}")
    frequency = table.number("frequency", 0.1, 20.0)
    scale = table.numbers("scale", 2 * len(offsets), 1.0)
    return Term(name, scale, frequency, tuple(map(float, offsets)))


class _Table:
    """A table of the file, that says where it is if something is wrong with it."""

    def __init__(self, content: Mapping[str, Any], where: str) -> None:
        self._content, self._where = content, where

    def only(self, *keys: str) -> None:
        for key in self._content:
            if key not in keys:
                raise PolicyError(unknown_name("key", f"{self._where}{key}", keys))

    def value(self, key: str, default: object = None) -> Any:  # noqa: ANN401
        value = self._content.get(key, default)
        if value is None:
            raise PolicyError(f"{self._where}{key} is missing")
        return value

    def table(self, key: str) -> _Table:
        value = self.value(key)
        if not isinstance(value, dict):
            raise PolicyError(f"{self._where}{key} must be a table, got {value!r:.80}")
        return _Table(value, f"{self._where}{key}.")

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        value = self.value(key, default)
        if not is_finite_number(value) or not low <= float(value) <= high:
            raise PolicyError(
                f"{self._where}{key} must be a number from {low:g} to {high:g}, got {value!r:.80}"
            )
        return float(value)

    def numbers(
        self, key: str, count: int, default: float | None = None
    ) -> Float[np.ndarray, " n"]:
        """One number for all, or as many as there are."""
        value = self.value(key, default)
        many = value if isinstance(value, list) else [value] * count
        if len(many) != count or not all(map(is_finite_number, many)):
            raise PolicyError(
                f"{self._where}{key} must be a number, or a list of {count}, got {value!r:.80}"
            )
        return np.array(many, dtype=float)

    def gains(self, key: str) -> Array12:
        gains = self.numbers(key, 12)
        if (gains < 0.0).any():
            raise PolicyError(f"{self._where}{key} must be 0 or more, got {gains.min():g}")
        return gains

    def range(self, key: str) -> tuple[float, float]:
        value = self.value(key)
        if (
            not isinstance(value, list)
            or len(value) != 2
            or not all(map(is_finite_number, value))
            or not value[0] <= 0.0 <= value[1]
        ):
            raise PolicyError(
                f"{self._where}{key} must be [least, greatest] with 0 between, got {value!r:.80}"
            )
        return float(value[0]), float(value[1])
