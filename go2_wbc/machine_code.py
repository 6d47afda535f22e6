"""Machine code for kernels, by Numba: their types, their entries, compiling and loading them.

Numba compiles functions of records to the same code as functions of arrays; but a record that
Python passes costs 11 us. So a kernel's entry takes rows, looks at them as records, and has the
written function put into it.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Annotated, Any

import numba
from jaxtyping import AbstractArray
from numba import types

from go2_wbc.kept_code import KeptCode
from go2_wbc.records import Record, layout_of
from go2_wbc.written import FOREIGN, Written


def signature_of(routine: Written) -> Any:
    """A function's signature, as Numba has it.

    Raises:
        TypeError: for an annotation that compiled code does not know, by the parameter's name.
    """
    hints = typing.get_type_hints(routine.written, include_extras=True)
    given, where = hints.pop("return", None), routine.written.__qualname__
    arguments = (_type_of(hints[name], f"{where}: {name}") for name in routine.parameters)
    return _type_of(given, where)(*arguments)


_callees: dict[int, Any] = {}  #: Numba refers to what it compiled weakly: kept here, by the routine


def as_callee(routine: Written) -> Any:
    """The type of a function that code which is compiled now calls: it is compiled along."""
    _extend_numba()
    dispatcher = _callees[id(routine)] = numba.njit(error_model="numpy")(routine.written)
    with _short_errors():
        dispatcher.compile(routine.signature)
    dispatcher.disable_compile()
    return dispatcher._numba_type_


def entered(kernel: Written) -> tuple[Callable[..., Any], list[bool]]:
    """A kernel's machine code, loaded or compiled, and which of its arguments are rows."""
    kept = KeptCode(kernel)
    code, takes_rows = kept.load()
    if code is None:
        kinds = kernel.signature.args
        takes_rows = [isinstance(kind, types.Record) for kind in kinds]
        row = types.float64[::1]
        given = [row if is_row else k for k, is_row in zip(kinds, takes_rows, strict=True)]
        dispatcher = numba.njit(error_model="numpy", nogil=kernel.nogil)(_entry(kernel, takes_rows))
        _extend_numba()
        with _short_errors():
            dispatcher.compile(kernel.signature.return_type(*given))
        (code,) = dispatcher.overloads.values()
        kept.save(code, takes_rows)
    else:
        stub = _named_like(kernel, "pass")
        dispatcher = numba.njit(error_model="numpy", nogil=kernel.nogil)(stub)
        dispatcher.add_overload(code)
    dispatcher.disable_compile()
    return dispatcher, takes_rows


def _entry(kernel: Written, takes_rows: list[bool]) -> FunctionType:
    """A function of rows that looks at them as records."""
    written = numba.njit(error_model="numpy", inline="always")(kernel.written)
    space: dict[str, Any] = {"_written": written}
    given = []
    pairs = zip(kernel.parameters, kernel.signature.args, takes_rows, strict=True)
    for name, kind, is_row in pairs:
        if is_row:
            space[f"_{name}_"] = kind.dtype
        given.append(f"{name}.view(_{name}_)[0]" if is_row else name)
    return _named_like(kernel, f"return _written({', '.join(given)})", space)


def _named_like(kernel: Written, body: str, space: dict[str, Any] | None = None) -> FunctionType:
    written, space = kernel.written, space or {}
    space["__name__"] = written.__module__
    exec(f"def {written.__name__}({', '.join(kernel.parameters)}):\n    {body}\n", space)
    made = space[written.__name__]
    made.__qualname__ = written.__qualname__
    return made


def _type_of(hint: Any, where: str) -> Any:
    """Numba's type of an annotation."""
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    if typing.get_origin(hint) is Annotated and FOREIGN in hint.__metadata__:
        array = _type_of(hint.__origin__, where)
        return types.Array(array.dtype, array.ndim, "A", readonly=True)
    if typing.get_origin(hint) is tuple:
        return types.Tuple([_type_of(kind, where) for kind in typing.get_args(hint)])
    if isinstance(hint, type) and issubclass(hint, tuple):  # a NamedTuple
        parts = typing.get_type_hints(hint, include_extras=True).items()
        return types.NamedTuple([_type_of(kind, f"{where}.{part}") for part, kind in parts], hint)
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        names = set(hint.dtypes)
        number = next(t for name, t in _NUMBERS.items() if name in names)
        return types.Array(number, max(len(hint.dim_str.split()), 1), "C")
    if isinstance(hint, type) and (issubclass(hint, Record) or dataclasses.is_dataclass(hint)):
        return _record_type(hint)
    raise TypeError(f"{where} is declared as {hint!r}, which compiled code does not know")


_SIMPLE = {None: types.void, type(None): types.void, bool: types.boolean}
_SIMPLE |= {float: types.float64, int: types.int64}
_NUMBERS = {"float64": types.float64, "int64": types.int64, "int32": types.int32}
_NUMBERS |= {"bool": types.boolean, "bool_": types.boolean}


_record_names: dict[str, str] = {}
"""Of each record that is known: how Numba writes its type, and what it is called."""


@cache
def _record_type(cls: type) -> Any:
    kind = numba.from_dtype(layout_of(cls).dtype)
    _record_names[str(kind)] = cls.__name__
    return kind


@cache
def _extend_numba() -> None:
    """What compiling, not loading, needs: it imports Numba's library of functions, 0.2 s."""
    import_module("go2_wbc.numba_extensions")


@contextmanager
def _short_errors() -> Iterator[None]:
    """Numba writes every part of a record out where it names its type: the class's name will do."""
    try:
        yield
    except numba.core.errors.NumbaError as error:
        text = str(error)
        for long, short in _record_names.items():
            text = text.replace(long, short)
        error.args = (text,)
        raise
    except KeyError as error:
        raise TypeError(f"a record has no part {error} that a kernel reads") from error
