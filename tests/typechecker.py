"""The check of every argument under pytest: as types say it, a whole number is a number too.

So is what numpy calls true and false a flag; ``Self`` is pyright's to check.

A check costs many times what most functions do, and a scenario of a minute makes the same calls
tens of thousands of times. A wrong call is wrong because of the place that makes it. So in each
phase of a test (setting up, the test itself) the first ``CHECKED_CALLS`` calls that a place in the
code makes are all checked, and of its later ones every ``STRIDE``-th.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial, wraps
from types import FunctionType
from typing import Any, Self

import jaxtyping
import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype
from jaxtyping import _decorator

CHECKED_CALLS = 10  #: Of each place: a tick of the control loop has 400, and a check takes 25 us
STRIDE = 251
"""Prime, so that the calls of a loop come up in turn, whatever their number. A control loop makes
its calls as often in half a second; at every 61st the checks took a quarter of a tick."""
_ARRAY: Any = type(jaxtyping.Float[np.ndarray, "1"])
_MEANINGS = FrozenDict({bool: bool | np.bool_, Self: object})
_check = beartype(conf=BeartypeConf(is_pep484_tower=True, hint_overrides=_MEANINGS))
_calls: dict[int, int] = {}  #: By place: how many calls it has made since the last ``renew``


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The decorator of each function of the modules that ``conftest.py`` names.

    Its checks are made when they are first needed: most functions are not called by a test.
    """
    made: list[Callable[..., Any]] = []

    def check(*args: object, **kwargs: object) -> object:
        if not made:
            made.append(_check(function))
        return made[0](*args, **kwargs)

    return check


def ration() -> None:
    """Leave most of the repetitions in long loops unchecked, in what is imported from now on."""
    jaxtyping.jaxtyped = _decorator.jaxtyped = _rationed(_decorator.jaxtyped)


def _rationed(jaxtyped: Callable[..., Any]) -> Callable[..., Any]:
    """``jaxtyped`` with functions whose calls are counted before anything else is done."""

    def decorator(decorated: object = None, *, typechecker: Callable[..., Any]) -> object:
        if decorated is None:
            return partial(decorator, typechecker=typechecker)
        if getattr(decorated, "__globals__", None) is globals():  # inherited, and counted already
            return decorated
        if isinstance(decorated, FunctionType) and not _may_be_called_wrongly(decorated):
            return decorated
        made = jaxtyped(decorated, typechecker=typechecker)
        return _counted(decorated, made) if isinstance(decorated, FunctionType) else made

    return decorator


def _may_be_called_wrongly(function: FunctionType) -> bool:
    """Whether a call may be wrong that the static check of types (pyright) finds right.

    That is one with arrays, whose shapes pyright does not know, or one of a public function, to
    which a test may give anything. A tick of the control loop makes 30 calls of others.
    """
    types = function.__annotations__
    is_own = function.__name__.startswith("_") or not types.keys() - {"return"}
    if not is_own or any(not isinstance(kind, str) or "[" in kind for kind in types.values()):
        return True
    return any(isinstance(function.__globals__.get(kind), _ARRAY) for kind in types.values())


def _counted(plain: Callable[..., Any], strict: Callable[..., Any]) -> Callable[..., Any]:
    """``strict`` for the calls that are to be checked, ``plain`` for the others."""

    @wraps(plain)
    def counted(*args: object, **kwargs: object) -> object:
        __tracebackhide__ = True
        caller = sys._getframe(1)
        place = id(caller.f_code) + caller.f_lasti  # an address within the code: no other has it
        calls = _calls[place] = _calls.get(place, 0) + 1
        if calls > CHECKED_CALLS and calls % STRIDE:
            return plain(*args, **kwargs)
        return strict(*args, **kwargs)

    return counted


def renew() -> None:
    """Check the first calls of every place again."""
    _calls.clear()
