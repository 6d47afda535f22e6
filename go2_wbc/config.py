"""All numbers of the engine in one value, with overrides from TOML.

Each part is a frozen dataclass beside its consumer, with units and sources. A file overrides the
keys that it names and nothing else:

    [locomotion]
    height = 0.27

    [wbc]
    solver = "proxqp"
    swing_foot = { kp = [400, 400, 400], kd = [35, 35, 35] }
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, SolverUnavailable, unknown_name
from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.planning.command import VelocityEnvelope
from go2_wbc.planning.locomotion import LocomotionConfig
from go2_wbc.planning.trunk import PoseEnvelope
from go2_wbc.robot.description import GO2, find_profile, profile_names
from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.motor import TORQUE_SPEED, require_motor
from go2_wbc.robot.payload_estimation import PayloadConfig
from go2_wbc.robot.safety import SafetyConfig
from go2_wbc.validation import is_finite_number
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import BACKENDS

_Part = TypeVar("_Part")


@typed()
@dataclass(frozen=True, slots=True)
class Config:
    """The engine's numbers."""

    wbc: WbcConfig = field(default_factory=WbcConfig)  #: whole-body controller
    locomotion: LocomotionConfig = field(default_factory=LocomotionConfig)  #: locomotion planner
    envelope: VelocityEnvelope | None = None
    """Velocity commands that are followed. None, and so not configured: in simulation that of the
    robot's profile, which was measured; where a real robot may be moved (``beside_hardware``) the
    default of ``VelocityEnvelope``."""
    pose: PoseEnvelope = field(default_factory=PoseEnvelope)
    """Poses of the trunk that are taken while walking."""
    safety: SafetyConfig = field(default_factory=SafetyConfig)  #: when to give up
    payload: PayloadConfig = field(default_factory=PayloadConfig)
    """Estimate of what the robot carries."""
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    """Of the state, for a plant that measures no pose: its maker passes it on."""
    feasibility: FeasibilityLimits = field(default_factory=FeasibilityLimits)
    """What a motion must keep to be played."""
    backend: str = "condensed"  #: whole-body back end: condensed, full or placo
    motor: str = TORQUE_SPEED
    """What the motors are taken for: "torque-speed", or "ideal" for the peak torque at every
    speed."""
    robot: str = GO2
    """Name of the profile of the robot that they are for; ``of_robot`` has all of them."""

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown motor, robot or back end."""
        require_motor(self.motor)
        if self.backend not in BACKENDS:
            raise ConfigError(unknown_name("WBC back end", self.backend, BACKENDS))
        find_profile(self.robot)

    @staticmethod
    def of_robot(name: str) -> Config:
        """The numbers of a robot that ships.

        Raises:
            ConfigError: for an unknown one; lists the valid ones.
        """
        return override(Config(robot=name), find_profile(name).config, where=f"robot {name!r}")

    @property
    def cautious_envelope(self) -> VelocityEnvelope:
        """The envelope that is configured, or one of half the speeds that hold in simulation."""
        return self.envelope or VelocityEnvelope()

    @property
    def beside_hardware(self) -> Config:
        """These numbers where a real robot may be moved, by what was measured in simulation."""
        return dataclasses.replace(self, envelope=self.cautious_envelope)


@typed()
def load_config(path: Path | str) -> Config:
    """The default configuration, or that of its ``robot``, with the overrides of a TOML file.

    Raises:
        ConfigError: if the file cannot be read, names an unknown key, or has a wrong value.
    """
    try:
        overrides = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ConfigError(f"cannot read the configuration {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from error
    robot = overrides.get("robot", GO2)
    if robot not in profile_names():
        raise ConfigError(f"{path}: {unknown_name('robot', str(robot), profile_names())}")
    own = Config.of_robot(robot)
    return override(own, overrides, where=str(path))


def override(part: _Part, values: Mapping[str, Any], where: str) -> _Part:
    """A copy of the dataclass ``part`` with ``values`` put in, nested tables included.

    Args:
        part: a frozen dataclass.
        values: new values by field name; a mapping overrides a nested dataclass.
        where: what to call this place in an error.

    Raises:
        ConfigError: for an unknown key, or a value of another type than the field's.
    """
    fields = {name: getattr(part, name) for name in part.__dataclass_fields__}  # type: ignore[attr-defined]
    changes = {}
    for key, value in values.items():
        if key not in fields:
            raise ConfigError(f"{where}: {unknown_name('key', key, fields)}")
        before = VelocityEnvelope() if fields[key] is None else fields[key]  # not configured yet
        changes[key] = _convert(before, value, f"{where}: {key}")
    try:
        return dataclasses.replace(part, **changes)  # type: ignore[type-var]
    except (ConfigError, SolverUnavailable) as error:
        raise type(error)(f"{where}: {error}") from None


def _convert(current: object, value: object, where: str) -> object:
    if dataclasses.is_dataclass(current):
        if not isinstance(value, Mapping):
            raise ConfigError(f"{where} must be a table, got {value!r}")
        return override(current, value, where)
    if isinstance(current, tuple):
        if not isinstance(value, list) or len(value) != len(current):
            raise ConfigError(f"{where} must be a list of {len(current)} numbers, got {value!r}")
        return tuple(_convert(c, v, where) for c, v in zip(current, value, strict=True))
    if isinstance(current, float):
        if not is_finite_number(value):
            raise ConfigError(f"{where} must be a finite number, got {value!r}")
        return float(value)
    if type(value) is not type(current):
        expected = type(current).__name__
        raise ConfigError(f"{where} must be of type {expected}, got {value!r}")
    return value
