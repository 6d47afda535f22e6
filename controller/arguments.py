"""Arguments of ``GO2Controller``: checked here, so that wrong ones end in errors of our own."""

from __future__ import annotations

import re
from pathlib import Path

from controller.policies.policy import Policy
from go2_wbc.config import Config, load_config
from go2_wbc.errors import CommandError, ConfigError, PolicyError
from go2_wbc.planning.command import finite_number
from go2_wbc.plant.base import Plant
from go2_wbc.robot.description import GO2
from go2_wbc.validation import is_finite_number

NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
LONGEST = 1e6  #: Time [s] of one call: 11 days
LONGEST_PERIOD = 0.1  #: Control period [s]: a robot falls in three times as long


def require_pace(plant: Plant | None, *, realtime: bool) -> None:
    """Raise ConfigError for a ``plant`` that needs ``realtime`` without it."""
    if plant is not None and plant.is_live and not realtime:
        raise ConfigError(
            f"{type(plant).__name__} must get commands without a break: give "
            "GO2Controller(plant=..., realtime=True)"
        )


def require_period(plant: Plant) -> None:
    """Raise ConfigError if the ``plant`` cannot be controlled in its ``control_period``."""
    period: object = plant.control_period
    if not (is_finite_number(period) and 0.0 < period <= LONGEST_PERIOD):
        raise ConfigError(
            f"{type(plant).__name__}.control_period must be above 0, at most {LONGEST_PERIOD} s; "
            f"got {period!r}"
        )


def time(name: str, value: float) -> float:
    """``value`` [s]; raise CommandError if it is no number from 0 to ``LONGEST``."""
    value = finite_number(name, value)
    if not 0.0 <= value <= LONGEST:
        raise CommandError(f"{name} must be from 0 to {LONGEST:g} s, got {value}")
    return value


def namespace(value: str) -> str:
    """``value``; raise ConfigError if it is not a name."""
    if not isinstance(value, str) or not NAMESPACE.match(value):
        hint = "; a plant is given as plant=..." if isinstance(value, Plant) else ""
        raise ConfigError(
            "namespace must be letters, digits and underscores, a letter first; "
            f"got {value!r}{hint}"
        )
    return value


def config(
    value: Config | Path | str | None, robot: str | None = None, plant: Plant | None = None
) -> Config:
    """The configuration meant: itself, that of a TOML file, or the one of the robot.

    That is ``robot`` or the one of the ``plant``, or else a Go2.

    Raises:
        ConfigError: if the file is wrong, or they are of different robots.
    """
    is_of = GO2 if plant is None else plant.robot
    if value is None:
        value = Config.of_robot(robot or is_of)
    if not isinstance(value, Config):
        value = load_config(value)
    known = {"robot": robot, "plant": plant and is_of, "config": value.robot}
    if len({name for name in known.values() if name is not None}) > 1:
        told = ", ".join(f"{what} says {name!r}" for what, name in known.items() if name)
        raise ConfigError(f"of which robot? {told}; Config.of_robot(...) has a robot's numbers")
    return value


def policy(value: Policy | Path | str, plant: Plant) -> Policy:
    """The policy meant: itself, or that of an ONNX file and its sidecar.

    Raises:
        PolicyError, MissingDependency: see ``Policy.load``; also for another robot's.
    """
    meant = value if isinstance(value, Policy) else Policy.load(value)
    if (robot := meant.sidecar.robot) != plant.robot:
        raise PolicyError(f"policy {meant.name} is for {robot}, the plant is {plant.robot}")
    return meant
