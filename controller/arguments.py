"""Arguments of ``GO2Controller``: checked here, so that wrong ones end in errors of our own."""

from __future__ import annotations

import math
import re
from numbers import Real
from pathlib import Path

from go2_wbc.config import Config, load_config
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.plant.base import Plant

NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def finite(name: str, value: float) -> float:
    """``value`` as a float.

    Raises:
        CommandError: if it is not a finite number.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise CommandError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError:  # an integer beyond every float
        number = math.inf
    if not math.isfinite(number):
        raise CommandError(f"{name} must be finite, got {value}")
    return number


def word(name: str, value: str) -> str:
    """``value``.

    Raises:
        CommandError: if it is not a string.
    """
    if not isinstance(value, str):
        raise CommandError(f"{name} must be a string, got {value!r}")
    return value


def flag(name: str, value: bool) -> bool:
    """``value``.

    Raises:
        ConfigError: if it is neither True nor False.
    """
    if not isinstance(value, bool):
        raise ConfigError(f"{name} must be True or False, got {value!r}")
    return value


def pace(realtime: bool, plant: Plant | None) -> bool:
    """``realtime``.

    Raises:
        ConfigError: if it is neither True nor False, or False though ``plant`` needs it.
    """
    if not flag("realtime", realtime) and plant is not None and plant.is_live:
        raise ConfigError(
            f"{type(plant).__name__} must get commands without a break: give "
            "GO2Controller(plant=..., realtime=True)"
        )
    return realtime


def namespace(value: str) -> str:
    """``value``.

    Raises:
        ConfigError: if it is not a name.
    """
    if not isinstance(value, str) or not NAMESPACE.match(value):
        raise ConfigError(
            f"namespace must be letters, digits and underscores, a letter first; got {value!r}"
        )
    return value


def config(value: Config | Path | str | None) -> Config:
    """The configuration meant: itself, that of a TOML file, or the default.

    Raises:
        ConfigError: if it is none of these, or the file is wrong.
    """
    if value is None:
        return Config()
    if isinstance(value, Config):
        return value
    if not isinstance(value, Path | str):
        raise ConfigError(f"config must be a Config or the path of a TOML file, got {value!r}")
    return load_config(value)


def path_or_none(name: str, value: Path | str | None) -> Path | None:
    """``value`` as a path.

    Raises:
        ConfigError: if it is none.
    """
    if value is not None and not isinstance(value, Path | str):
        raise ConfigError(f"{name} must be a path, got {value!r}")
    return None if value is None else Path(value)


def plant_or_none(value: Plant | None) -> Plant | None:
    """``value``.

    Raises:
        ConfigError: if it is neither a plant nor None.
    """
    if value is not None and not isinstance(value, Plant):
        raise ConfigError(f"plant must be a Plant, got {value!r}")
    return value
