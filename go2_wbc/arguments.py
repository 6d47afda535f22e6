"""Arguments of public functions: values that do not fit their annotations are refused.

    @typed(error=CommandError)
    def wait(seconds: float) -> None: ...

``wait("a while")``, ``wait(nan)`` and ``wait(1e300)`` raise CommandError, with the value and what
is valid.
"""

from __future__ import annotations

import inspect
import os
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import InitVar
from functools import cache, cached_property, wraps
from numbers import Integral
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, cast

import numpy as np

from go2_wbc.errors import ConfigError, Go2WbcError
from go2_wbc.validation import LARGEST, is_finite_number

_Item = TypeVar("_Item", bound=Callable[..., Any])
_MOST = 2**63  #: Whole numbers are smaller: those of a file of a sweep, and of NumPy's arrays
_LONGEST_NAME = 255  #: Of a file [bytes]; most file systems have this limit
_FUNCTION = typing.get_origin(Callable[..., Any])
_Parameter = inspect.Parameter
_UNIONS = (UnionType, typing.Union)


def typed(
    *names: str, error: type[Go2WbcError] = ConfigError, late: bool = False
) -> Callable[[_Item], _Item]:
    """Let a function, or a value's constructor, refuse what its annotations do not take.

    Numbers must be finite, and ``LARGEST`` at most. A default is always taken. Where only a type
    checker can tell, nothing is refused.

    Args:
        names: of the parameters to check; all of them if there is none.
        error: what to raise.
        late: check only once the call has failed with another error, which costs nothing: for what
            is called in every tick.
    """

    def decorate(item: _Item) -> _Item:
        if not isinstance(item, type):
            return cast(_Item, _refusing(item, _Taken(item, names, error), late=late))
        taken = _Taken(item.__init__, names, error)
        own = _refusing(item.__init__, taken, late=True, is_made=True)
        setattr(item, "__init__", own)  # noqa: B010
        return cast(_Item, item)

    return decorate


class _Taken:
    """What a call takes, by the annotations of its parameters."""

    def __init__(
        self, call: Callable[..., object], names: tuple[str, ...], error: type[Go2WbcError]
    ) -> None:
        self._call, self._names, self._error = call, names, error
        self._signature = inspect.signature(call)
        kinds = {one.kind for one in self._signature.parameters.values()}
        self._has_rest = bool(kinds & {_Parameter.VAR_POSITIONAL, _Parameter.VAR_KEYWORD})

    @cached_property
    def _kinds(self) -> dict[str, object]:
        """By name; worked out late, since names may not be there yet when a class is made."""
        hints = typing.get_type_hints(self._call)
        names = self._names or tuple(self._signature.parameters)
        return {name: hints[name] for name in names if name in hints}

    def require(self, *args: object, **keywords: object) -> None:
        """Raise the error for the first argument that is not taken."""
        if not self._has_rest:  # binding takes ten times as long
            names = self._signature.parameters
            if not any(self._refused({**dict(zip(names, args, strict=False)), **keywords})):
                return
        try:
            given = self._signature.bind(*args, **keywords).arguments
        except TypeError:  # Python says what is missing, or too much
            return
        for name, value in self._refused(given):
            must = f"{name} must be {_in_words(self._kinds[name])}"
            raise self._error(f"{must}, got {value!r:.80}") from None

    def _refused(self, given: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
        for name, kind in self._kinds.items():
            parameter = self._signature.parameters[name]
            if name not in given or given[name] is parameter.default:
                continue
            several = parameter.kind is parameter.VAR_POSITIONAL
            for value in given[name] if several else (given[name],):
                if not _fits(value, kind):
                    yield name, value


def _refusing(
    call: Callable[..., object], taken: _Taken, *, late: bool, is_made: bool = False
) -> Callable[..., object]:
    @wraps(call)
    def checked(*args: object, **keywords: object) -> object:
        taken.require(*args, **keywords)
        return call(*args, **keywords)

    @wraps(call)
    def checked_late(*args: object, **keywords: object) -> object:
        try:
            result = call(*args, **keywords)
        except Go2WbcError:
            raise
        except Exception:
            taken.require(*args, **keywords)
            raise
        if is_made:  # what its own checks say comes first
            taken.require(*args, **keywords)
        return result

    return checked_late if late else checked


@cache
def _parts(kind: object) -> tuple[Any, tuple[Any, ...]]:
    """What an annotation is of, and what is in its brackets."""
    kind = kind.type if isinstance(kind, InitVar) else kind
    return typing.get_origin(kind) or kind, typing.get_args(kind)


def _fits(value: object, kind: object) -> bool:
    origin, parts = _parts(kind)
    if origin in _UNIONS:
        if isinstance(value, str) and Path in parts:
            return _fits(value, Path)
        return any(_fits(value, part) for part in parts)
    if origin is float:
        return is_finite_number(value) and abs(value) <= LARGEST
    if origin is int:
        return isinstance(value, Integral) and is_finite_number(value) and abs(value) < _MOST
    if origin is bool:
        return isinstance(value, bool | np.bool_)
    if hasattr(origin, "array_type"):
        return _is_array(value, origin)
    if origin is _FUNCTION:
        return callable(value)
    if origin is Path:
        return isinstance(value, Path | str) and _is_possible(value)
    is_class = isinstance(origin, type) and origin not in (Any, object)
    if not is_class or getattr(origin, "_is_protocol", False):
        return True
    return _is_collection(value, origin, parts) if parts else isinstance(value, origin)


def _is_possible(path: Path | str) -> bool:
    """Whether a file can have this path."""
    try:
        names = os.fsencode(path).split(b"/")
    except UnicodeEncodeError:  # half of a pair of surrogates
        return False
    return b"\0" not in b"".join(names) and max(map(len, names)) <= _LONGEST_NAME


def _is_collection(value: object, origin: type, parts: tuple[Any, ...]) -> bool:
    """Whether it is one, of elements that fit; lists may be tuples or arrays."""
    if issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(
            _fits(key, parts[0]) and _fits(one, parts[1]) for key, one in value.items()
        )
    if not issubclass(origin, Iterable) or not isinstance(value, list | tuple):
        return isinstance(value, origin | np.ndarray) and not isinstance(value, str)
    if origin is tuple and Ellipsis not in parts:
        return len(value) == len(parts) and all(map(_fits, value, parts))
    if parts[0] is str and set(map(type, value)) <= {str}:  # a label for each of many samples
        return True
    return all(_fits(one, parts[0]) for one in value)


def _is_array(value: object, kind: Any) -> bool:  # noqa: ANN401
    try:
        array = np.asarray(value)
    except ValueError:  # of lists of several lengths
        return False
    lengths = kind.dim_str.split()
    is_whole = array.dtype.kind in "iub" and "float64" in kind.dtypes
    if not (is_whole or array.dtype.name in kind.dtypes):
        return False
    if not all(length.isalnum() for length in lengths):  # of any shape
        return True
    return array.ndim == len(lengths) and all(
        length == str(size) or not length.isdigit()
        for length, size in zip(lengths, array.shape, strict=True)
    )


def _in_words(kind: object) -> str:
    """What an annotation takes."""
    origin, parts = _parts(kind)
    if origin in _UNIONS:
        named = [part for part in parts if part is not int or float not in parts]
        return " or ".join(map(_in_words, named))
    if hasattr(origin, "array_type"):
        return f"an array of shape ({origin.dim_str.strip()})"
    if origin in _WORDS:
        return _WORDS[origin]
    if parts and issubclass(origin, Mapping):
        return "a mapping"
    if parts and issubclass(origin, Iterable):
        return f"a list, each {_in_words(parts[0])}"
    name = getattr(origin, "__name__", str(origin))
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


_WORDS: dict[object, str] = {
    float: f"a finite number, {LARGEST:g} at most",
    int: "a whole number",
    bool: "True or False",
    str: "a text",
    NoneType: "None",
    Path: "a path that a file can have",
    _FUNCTION: "a function",
}
