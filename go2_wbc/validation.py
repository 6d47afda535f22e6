"""Range checks for the frozen ``*Config`` classes, called from their ``__post_init__``."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from numbers import Real
from typing import TypeGuard

from go2_wbc.errors import ConfigError


def require_positive(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is finite and above 0."""
    _require(config, "positive", lambda value: value > 0.0, *names)


def require_not_negative(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is finite and at least 0."""
    _require(config, "at least 0", lambda value: value >= 0.0, *names)


def require_finite(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is a finite number."""
    _require(config, "finite", lambda _: True, *names)


def require_between(config: object, low: float, high: float, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is in [``low``, ``high``]."""
    what = f"between {low:g} and {high:g}"
    _require(config, what, lambda value: low <= value <= high, *names)


def require_share(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is in (0, 1]."""
    _require(config, "above 0 and at most 1", lambda value: 0.0 < value <= 1.0, *names)


def is_finite_number(value: object) -> TypeGuard[Real]:
    """Whether ``value`` is a finite number; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def _require(config: object, what: str, holds: Callable[[float], bool], *names: str) -> None:
    for name in names:
        field = getattr(config, name)
        for value in field if isinstance(field, tuple) else (field,):
            if not (is_finite_number(value) and holds(float(value))):
                raise ConfigError(f"{type(config).__name__}.{name} must be {what}, got {field!r}")


def warn_retired(name: str, instead: str) -> None:
    """Warn the caller of a config's constructor that its argument ``name`` has no effect."""
    message = f"{name} has no effect any more: {instead}"
    warnings.warn(message, FutureWarning, stacklevel=4)
