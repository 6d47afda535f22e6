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
20 s for all, announced by one line of the log. The machine code is kept in a file whose name has a
hash of all that it depends on: the kernel's and its subroutines' own code and constants, their
records, the versions and the processor. So a change of one function compiles only what calls it. A
file that cannot be read is made anew; where no file can be written, kernels are compiled in every
process. No fast-math flag is set: the bits of a result depend on the inputs only.

Loading is part of every start, so it must not take long: only kernels are loaded, and loading needs
nothing of Numba's compiler; see ``_what_running_takes``.
"""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import inspect
import logging
import os
import pickle
import platform
import tempfile
import typing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property, update_wrapper
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Annotated, Any, TypeVar, cast, overload

import llvmlite.binding
import numba
import numpy as np
from jaxtyping import AbstractArray
from numba import types
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.environment import Environment
from numba.core.imputils import lower_cast
from numba.core.runtime import _nrt_python  # pyright: ignore[reportAttributeAccessIssue]
from numba.core.serialize import dumps

from go2_wbc.records import Flag, Record, layout_of

_log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

CACHE_VARIABLE = "GO2_WBC_CACHE_DIR"
"""Environment variable that names the folder for compiled kernels and solved plans; by default the
user's cache."""
PLAIN_VARIABLE = "GO2_WBC_PLAIN"
"""Environment variable; 1 runs every kernel as the Python that it is written in."""
_IS_PLAIN = os.environ.get(PLAIN_VARIABLE, "0") not in ("", "0")
MODULES: tuple[str, ...] = (
    "go2_wbc.algebra.active_set",
    "go2_wbc.plant.mujoco.layout",
    "go2_wbc.reference",
    "go2_wbc.robot.estimator",
    "go2_wbc.robot.leg_kinematics",
    "go2_wbc.robot.payload_estimation",
    "go2_wbc.robot.rigid_body",
    "go2_wbc.robot.rotations",
    "go2_wbc.robot.safety",
    "go2_wbc.wbc.trajectory_loads",
)
"""Modules that hold kernels."""
_FOREIGN = "foreign"
Foreign = Annotated[T, _FOREIGN]
"""An array that is only read, and may come from elsewhere: read-only, or with gaps."""
_OUR_OWN = ("go2_wbc", "motions", "controller", "viz")
_KEPT = 4
"""How many versions of a kernel are kept: those of other environments, or branches."""


class _Routine:
    """A function that Numba is told of when code that calls it is compiled."""

    def __init__(self, function: Callable[..., Any], *, nogil: bool = False) -> None:
        self.python = function
        self.written = cast(FunctionType, inspect.unwrap(function))  # a type checker may be around
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

    @property
    def name(self) -> str:
        """Module and function."""
        return f"{self.written.__module__}.{self.written.__qualname__}"

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
        dispatcher._cache = _KeptCode(self)
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
    hints = list(typing.get_type_hints(self.written).items())
    given = []
    for value, (_, hint) in zip(arguments, hints, strict=False):
        if isinstance(hint, type) and issubclass(hint, Record) and not isinstance(value, hint):
            value = hint.of(value.row)
        given.append(np.float64(value) if hint is float else value)
    with np.errstate(all="ignore"):
        return self.python(*given)


def _is_record(kind: Any) -> bool:
    return isinstance(kind, types.Record)


def _type_of(hint: Any, where: str) -> Any:
    """Numba's type of an annotation."""
    simple = {None: types.void, type(None): types.void, float: types.float64, int: types.int64}
    if hint in (bool, Flag):
        return types.boolean
    if isinstance(hint, (type, type(None))) and hint in simple:
        return simple[hint]
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


_NUMBERS = {"float64": types.float64, "int64": types.int64, "int32": types.int32}
_NUMBERS |= {"bool": types.boolean, "bool_": types.boolean}


_record_names: dict[str, str] = {}
"""Of each record that is known: how Numba writes its type, and what it is called."""


@cache
def _record_type(cls: type) -> Any:
    kind = numba.from_dtype(layout_of(cls).dtype)
    _record_names[str(kind)] = cls.__name__
    return kind


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


# --- what is kept ------------------------------------------------------------------------------


class _KeptCode(NullCache):
    """The file in which a kernel's machine code is kept, in the place of Numba's own cache."""

    def __init__(self, made: _Kernel) -> None:
        self._kernel = made
        folder = kernel_folder()
        self._file = None if folder is None else folder / f"{made.name}-{_fingerprint(made)}.code"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was kept; None if there is none that can be used."""
        del sig
        if self._file is None:
            _say_that_it_takes_time()
            return None
        try:
            content = self._file.read_bytes()
        except OSError:
            _say_that_it_takes_time()
            return None
        if content[:_DIGEST] != _digest(content[_DIGEST:]):
            _log.warning("%s is damaged: it is compiled anew", self._file)
            return None
        _offer_runtime()
        return CompileResult._rebuild(target_context, *pickle.loads(content[_DIGEST:]))

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep it, and not more than a few older ones."""
        del sig
        if self._file is None or cres.library.has_dynamic_globals:
            return
        content = dumps(_what_running_takes(cres))
        try:
            with tempfile.NamedTemporaryFile(dir=self._file.parent, delete=False) as file:
                file.write(_digest(content) + content)
            Path(file.name).replace(self._file)
            others = self._file.parent.glob(f"{self._kernel.name}-*.code")
            for old in sorted(others, key=lambda path: path.stat().st_mtime)[:-_KEPT]:
                old.unlink()
        except OSError as error:
            _log.warning("the compiled kernels cannot be kept in %s: %s", self._file.parent, error)


_DIGEST = 32


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def _what_running_takes(cres: Any) -> tuple[Any, ...]:
    """Of a compiled function what running it takes, not what a caller is linked with.

    Numba keeps the function's intermediate code as well, for callers that are compiled later, and
    loading one parses it all: only the entry's name is asked for. And it keeps an environment for
    each of its own functions that was compiled along (``np.zeros``, ``min``), and loading one
    imports that function's module, scipy.linalg at last. Compiled code takes nothing from that
    module: any other will do.
    """
    (name, kind, (machine_code, _)), *rest, environments = cres._reduce()
    entry = f'define void @"{cres.fndesc.llvm_cpython_wrapper_name}"() {{ ret void }}'
    names = llvmlite.binding.parse_assembly(entry).as_bitcode()
    library = (name, kind, (machine_code, names))
    return (library, *rest, [_light(environment) for environment in environments])


def _light(environment: Environment) -> Environment:
    """The same environment, of a module that is there already if it is one of Numba's."""
    if not str(environment.globals["__name__"]).startswith("numba."):
        return environment
    light = Environment(vars(numba))
    light.env_name, light.consts[:] = environment.env_name, environment.consts
    return light


@cache
def _offer_runtime() -> None:
    """Name the functions of Numba's runtime that machine code calls.

    That much of ``rtsys.initialize`` does loaded code need; compiling does the rest.
    """
    for name, address in _nrt_python.c_helpers.items():
        llvmlite.binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


@cache
def _say_that_it_takes_time() -> None:
    if kernel_folder() is not None:
        _log.warning("compiling the control kernels for this machine, once (about 20 s)")


@cache
def kernel_folder() -> Path | None:
    """Where compiled kernels are kept; None if nothing can be written, which is said."""
    folder = cache_root() / f"kernels-{platform.python_version()}-{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        _log.warning(
            "compiling the control kernels (about 20 s); they cannot be kept: %s. Name a folder "
            "that can be written in %s",
            error,
            CACHE_VARIABLE,
        )
        return None
    return folder


def cache_root() -> Path:
    """The folder for what this package makes once and keeps."""
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named)
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "go2_wbc"
    return Path.home() / ".cache" / "go2_wbc"


def _fingerprint(routine: _Routine) -> str:
    """A hash of all that a kernel's machine code depends on."""
    versions = (platform.python_version(), numba.__version__, np.__version__)
    processor = (
        llvmlite.binding.get_host_cpu_name(),
        str(llvmlite.binding.get_host_cpu_features()),
    )
    parts = [repr((versions, processor, str(routine.signature)))]
    parts += _ingredients(routine.written, set())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _ingredients(function: FunctionType, seen: set[int]) -> Iterator[str]:
    """The code of a function, its constants, and the same of all that it calls."""
    if id(function) in seen:
        return
    seen.add(id(function))
    names: set[str] = set()
    for code in _codes(function.__code__):
        constants = [c for c in code.co_consts if c != function.__doc__ and not _is_code(c)]
        yield repr((code.co_code.hex(), constants, code.co_names, code.co_varnames))
        names |= set(code.co_names)
    known = inspect.getclosurevars(function).nonlocals
    known |= {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, value in sorted(known.items()):
        if isinstance(value, ModuleType) and value.__name__.partition(".")[0] in _OUR_OWN:
            inside = {n: getattr(value, n) for n in names if hasattr(value, n)}
            for part, one in sorted(inside.items()):
                yield from _ingredient(f"{name}.{part}", one, seen)
        else:
            yield from _ingredient(name, value, seen)


def _ingredient(name: str, value: Any, seen: set[int]) -> Iterator[str]:
    if isinstance(value, _Routine):
        yield f"{name}: {value.signature}"
        yield from _ingredients(value.written, seen)
    elif isinstance(value, FunctionType):
        yield from _ingredients(value, seen)
    elif type(value).__module__ == "go2_wbc.kernels.compilation":  # until none is left
        yield from _ingredients(value._function, seen)
    elif isinstance(value, type) and issubclass(value, enum.Enum):
        yield f"{name} = {[(member.name, member.value) for member in value]}"
    elif isinstance(value, (bool, int, float, str, tuple, np.generic, np.ndarray)):
        yield f"{name} = {value!r}"  # arrays are small: large ones are not compiled in
    elif not isinstance(value, (ModuleType, type)):
        raise TypeError(
            f"{name} = {value!r} is used by a kernel, which cannot tell when it changes"
        )


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if _is_code(constant):
            yield from _codes(constant)


def _is_code(constant: object) -> bool:
    return isinstance(constant, CodeType)


def load_kernels() -> None:
    """Compile every kernel, or load it: half a second, or about 20 s the first time.

    Before a robot is taken over: a loop must not wait for a compiler.
    """
    for module in map(import_module, MODULES):
        for value in vars(module).values():
            if isinstance(value, _Kernel) and value.written.__module__ == module.__name__:
                value.load()
