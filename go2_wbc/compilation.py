"""Functions that are compiled, and how their machine code is kept between runs.

A ``subroutine`` is called by compiled code, a ``kernel`` by Python as well; both are plain Python
with annotations, from which Numba's signature is made:

    @subroutine
    def ground_at(g: Ground, x: float, y: float) -> float: ...

    @kernel
    def plan(now: Snapshot, s: Planner, c: Walk, target: Target) -> None: ...

An argument may be a number, a flag, an array, a triple, or a record (``records``). Python gives a
kernel records, and the kernel is entered with their rows: a call costs 0.2 us more than its work.
A subroutine called from Python is the Python that it is written in. With ``GO2_WBC_PLAIN=1`` in the
environment kernels are, too: a debugger steps from the planner into a foothold.

Numba compiles a kernel for this processor when it is first called, or by ``load_kernels``, about
20 s for all, announced by one line of the log; ``kept_code`` keeps the machine code. No fast-math
flag is set: the bits of a result depend on the inputs only.
"""

from __future__ import annotations

import dataclasses
import inspect
import os
import typing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property, update_wrapper
from importlib import import_module
from types import FunctionType
from typing import Annotated, Any, TypeVar, cast, overload

import numba
import numpy as np
from jaxtyping import AbstractArray
from numba import types
from numba.core.imputils import lower_cast
from numba.extending import intrinsic
from numba.extending import overload as overload_of
from numba.np.arrayobj import make_array, populate_array

from go2_wbc.kept_code import KeptCode, Written
from go2_wbc.records import Record, layout_of

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

PLAIN_VARIABLE = "GO2_WBC_PLAIN"
"""Environment variable; 1 runs every kernel as the Python that it is written in."""
_IS_PLAIN = os.environ.get(PLAIN_VARIABLE, "0") not in ("", "0")
MODULES = (
    "go2_wbc.algebra.active_set",
    "go2_wbc.planning.locomotion",
    "go2_wbc.plant.mujoco.layout",
    "go2_wbc.reference",
    "go2_wbc.robot.joint_friction",
    "go2_wbc.robot.leg_kinematics",
    "go2_wbc.robot.motor",
    "go2_wbc.robot.payload_estimation",
    "go2_wbc.robot.rigid_body",
    "go2_wbc.robot.rotations",
    "go2_wbc.robot.safety",
    "go2_wbc.tracking.plan_curves",
    "go2_wbc.tracking.plan_tracking",
    "go2_wbc.wbc.condensed",
    "go2_wbc.wbc.constraints",
    "go2_wbc.wbc.elimination",
    "go2_wbc.wbc.tasks",
    "go2_wbc.wbc.trajectory_loads",
)
"""Modules that hold kernels."""
_FOREIGN = "foreign"
Foreign = Annotated[T, _FOREIGN]
"""An array that is only read, and may come from elsewhere: read-only, or with gaps."""


class _Routine(Written):
    """A function that Numba is told of when code that calls it is compiled."""

    def __init__(self, function: Callable[..., Any], *, nogil: bool = False) -> None:
        self.python = function
        self.written = inspect.unwrap(function)  # a type checker may be around
        self.nogil = nogil
        update_wrapper(self, function)

    @cached_property
    def signature(self) -> Any:
        """The function's signature, as Numba has it."""
        hints = typing.get_type_hints(self.written, include_extras=True)
        given = hints.pop("return", None)
        names = self.written.__code__.co_varnames[: self.written.__code__.co_argcount]
        where = self.written.__qualname__
        return _type_of(given, where)(*(_type_of(hints[n], f"{where}: {n}") for n in names))

    @cached_property
    def _dispatcher(self) -> Any:
        """For callers that are compiled; kept, as Numba refers to it weakly."""
        return numba.njit(error_model="numpy")(self.written)

    @property
    def _numba_type_(self) -> Any:
        """What Numba asks a global variable for, once it compiles code that names it."""
        if not self._dispatcher.overloads:
            with _short_errors():
                self._dispatcher.compile(self.signature)
            self._dispatcher.disable_compile()
        return self._dispatcher._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        return self.python(*arguments)


class _Kernel(_Routine):
    """A function that Python enters by its machine code.

    Each is of a class of its own, whose ``__call__`` is made of the function's parameters.
    """

    def load(self) -> None:
        """Load or compile it now, if that has not been done."""
        if not _IS_PLAIN:
            _ = self.compiled

    @cached_property
    def compiled(self) -> Any:
        """The machine code, loaded or compiled now; it takes rows in the place of records."""
        dispatcher = numba.njit(error_model="numpy", nogil=self.nogil)(self._entry())
        arguments = [
            types.float64[::1] if _is_record(kind) else kind for kind in self.signature.args
        ]
        dispatcher._cache = KeptCode(self)
        with _short_errors():
            dispatcher.compile(self.signature.return_type(*arguments))
        dispatcher.disable_compile()
        return dispatcher

    def _entry(self) -> FunctionType:
        """A function of rows that looks at them as records: passing these costs 11 us each.

        The written one is put into it, rather than called, and so compiled once.
        """
        names = self.written.__code__.co_varnames[: self.written.__code__.co_argcount]
        space: dict[str, Any] = {
            "_written": numba.njit(error_model="numpy", inline="always")(self.written),
            "__name__": self.written.__module__,
        }
        given = []
        for name, kind in zip(names, self.signature.args, strict=True):
            if _is_record(kind):
                space[f"_{name}_"] = kind.dtype
                given.append(f"{name}.view(_{name}_)[0]")
            else:
                given.append(name)
        called = self.written.__name__
        source = f"def {called}({', '.join(names)}):\n    return _written({', '.join(given)})\n"
        exec(source, space)
        entry = space[called]
        entry.__qualname__ = self.written.__qualname__
        return entry


def subroutine(function: F) -> F:
    """A function that compiled code calls, part of the machine code of each kernel that does."""
    return cast(F, _Routine(function))


@overload
def kernel(function: F, /) -> F: ...
@overload
def kernel(*, nogil: bool) -> Callable[[F], F]: ...
def kernel(function: Any = None, /, *, nogil: bool = False) -> Any:
    """A function that Python calls, compiled.

    With ``nogil`` other threads run meanwhile: for one that works long enough to delay a control
    loop, on arrays that no other thread changes.
    """
    if function is None:
        return lambda written: kernel(_made(written, nogil=nogil))
    made = function if isinstance(function, _Kernel) else _made(function, nogil=False)
    return made


def plain(function: F) -> F:
    """The Python in which a kernel or a subroutine is written."""
    return cast(F, cast(_Routine, function).python)


def _made(function: Callable[..., Any], *, nogil: bool) -> _Kernel:
    written = cast(FunctionType, inspect.unwrap(function))
    names = written.__code__.co_varnames[: written.__code__.co_argcount]
    if _IS_PLAIN:
        kind = type(function.__name__, (_Kernel,), {"__call__": _call_plain})
        return kind(function, nogil=nogil)
    # Whether an argument is a record is asked at the first call: no hint is looked at on import.
    kind = type(function.__name__, (_Kernel,), {"__call__": _first_call(names)})
    return kind(function, nogil=nogil)


def _first_call(names: tuple[str, ...]) -> Callable[..., Any]:
    def call(self: _Kernel, *arguments: Any) -> Any:
        given = [
            f"{name}.row" if _is_record(kind) else name
            for name, kind in zip(names, self.signature.args, strict=True)
        ]
        space = {"_compiled": self.compiled}
        exec(
            f"def call(_self, {', '.join(names)}):\n    return _compiled({', '.join(given)})", space
        )
        type(self).__call__ = space["call"]
        return self(*arguments)

    return call


def _call_plain(self: _Kernel, *arguments: Any) -> Any:
    """The Python: a record where there is only a row, numbers that divide by 0 as compiled ones."""
    hints = typing.get_type_hints(self.written).values()
    given = [_as_compiled(value, hint) for value, hint in zip(arguments, hints, strict=False)]
    with np.errstate(all="ignore"):
        return self.python(*given)


def _as_compiled(value: Any, hint: Any) -> Any:
    if isinstance(hint, type) and issubclass(hint, Record):
        return value if isinstance(value, hint) else hint.of(value.row)
    return np.float64(value) if hint is float else value


def _is_record(kind: Any) -> bool:
    return isinstance(kind, types.Record)


def _type_of(hint: Any, where: str) -> Any:
    """Numba's type of an annotation."""
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    if typing.get_origin(hint) is Annotated and _FOREIGN in hint.__metadata__:
        array = _type_of(hint.__origin__, where)
        return types.Array(array.dtype, array.ndim, "A", readonly=True)
    if typing.get_origin(hint) is tuple:
        return types.Tuple([_type_of(kind, where) for kind in typing.get_args(hint)])
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


def numbers_of(record: Any) -> Any:
    """All numbers of a record as one array."""
    return record.row


@overload_of(numbers_of, strict=False)
def _numbers_of(record: Any) -> Any:
    del record
    return lambda record: _row_of(record)  # pyright: ignore[reportCallIssue]


@intrinsic
def _row_of(_context: Any, record: Any) -> Any:
    """The memory of a record."""
    array = types.Array(types.float64, 1, "C")

    def build(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        row = make_array(array)(context, builder)
        kind = context.get_value_type(types.CPointer(types.float64))
        shape = (context.get_constant(types.intp, record.size // 8),)
        step = context.get_constant(types.intp, 8)
        populate_array(
            row,
            data=builder.bitcast(arguments[0], kind),
            shape=shape,
            strides=(step,),
            itemsize=step,
            meminfo=None,
        )
        return row._getvalue()

    return array(record), build


@lower_cast(types.NestedArray, types.Array)
def _array_of_a_record(_context: Any, _builder: Any, _from: Any, _to: Any, value: Any) -> Any:
    """An array in a record is one like others; without this, Numba stops with a bare assertion."""
    return value


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


def load_kernels() -> None:
    """Compile every kernel, or load it: half a second, or about 20 s the first time.

    Before a robot is taken over: a loop must not wait for a compiler.
    """
    for module in map(import_module, MODULES):
        for value in vars(module).values():
            if isinstance(value, _Kernel) and value.written.__module__ == module.__name__:
                value.load()
