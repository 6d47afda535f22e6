"""Range checks for the frozen ``*Config`` classes, called from their ``__post_init__``."""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Real

from go2_wbc.errors import ConfigError


def require_positive(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is finite and above 0."""
    for name in names:
        _require(config, name, lambda value: value > 0.0, "positive")


def require_not_negative(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is finite and at least 0."""
    for name in names:
        _require(config, name, lambda value: value >= 0.0, "at least 0")


def require_finite(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is a finite number."""
    for name in names:
        _require(config, name, lambda _: True, "finite")


def require_share(config: object, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` is in (0, 1]."""
    for name in names:
        _require(config, name, lambda value: 0.0 < value <= 1.0, "above 0 and at most 1")


def _require(config: object, name: str, holds: Callable[[float], bool], what: str) -> None:
    field = getattr(config, name)
    for value in field if isinstance(field, tuple) else (field,):
        is_number = isinstance(value, Real) and not isinstance(value, bool)
        if not (is_number and math.isfinite(value) and holds(float(value))):
            raise ConfigError(f"{type(config).__name__}.{name} must be {what}, got {field!r}")
