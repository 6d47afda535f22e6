"""Machine code for kernels, by Numba: their types and entries, compiling, storing and loading.

Numba compiles functions of records to the same code as functions of arrays; but passing a record
from Python costs 11 us. So a kernel's entry takes rows, views them as records, and inlines the
written function.

The code is kept between runs, in files. The name of a file has a hash of all that the code in it
depends on: the code and constants of the kernel and its subroutines, their records, the versions
and the processor. So after a change of one function only the kernels that call it are compiled
again. A damaged file is made anew; where no file can be written, every process compiles the
kernels.

Loading is part of every start, so it must be fast: a list says which file belongs to which kernel
as long as no source has changed, and loading needs nothing of Numba's compiler; see
``_what_running_takes``.
"""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import inspect
import json
import logging
import os
import pickle
import platform
import tempfile
import typing
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Annotated, Any

import llvmlite.binding
import numba
import numpy as np
from jaxtyping import AbstractArray
from numba import types
from numba.core.compiler import CompileResult
from numba.core.environment import Environment
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python  # pyright: ignore[reportAttributeAccessIssue]
from numba.core.serialize import dumps

from go2_wbc.records import Record, layout_of
from go2_wbc.written import FOREIGN, Written

_log = logging.getLogger(__name__)

CACHE_VARIABLE = "GO2_WBC_CACHE_DIR"
"""Environment variable that names the folder for compiled kernels and solved plans; by default the
user's cache."""
_OUR_OWN = ("go2_wbc", "motions", "controller", "viz")
KEPT = 8
"""How many versions of a kernel are kept, those used last: of other environments, or branches."""


class KeptCode:
    """The file in which a kernel's machine code is kept."""

    def __init__(self, kernel: Written) -> None:
        """Finds the file: by the list of those of these sources, or by all that it depends on."""
        self._kernel, self._folder = kernel, kernel_folder()
        self._file: Path | None = None
        self._takes_rows: list[bool] = []
        listed = None if self._folder is None else _listed(self._folder).get(kernel.name)
        if self._folder is not None and listed is not None:
            self._file, self._takes_rows = self._folder / listed[0], listed[1]

    def is_there(self) -> bool:
        """Whether it has been kept; also where nothing can be."""
        return self._folder is None or (self._file is not None and self._file.exists())

    def load(self) -> tuple[Any, list[bool]]:
        """What was kept, or None, and which arguments are rows."""
        if self._folder is None:
            say_that_it_takes_time()
            return None, []
        if self._file is None:
            name = f"{self._kernel.name}-{fingerprint(self._kernel)}.code"
            self._file = self._folder / name
            kinds = self._kernel.signature.args
            self._takes_rows = [isinstance(kind, numba.types.Record) for kind in kinds]
        try:
            content = self._file.read_bytes()
            self._file.touch()  # it is in use
        except OSError:
            say_that_it_takes_time()
            return None, self._takes_rows
        if content[:_DIGEST] != _digest(content[_DIGEST:]):
            _log.warning("%s is damaged: it is compiled anew", self._file)
            return None, self._takes_rows
        _offer_runtime()
        _list(self._folder, self._kernel.name, self._file.name, self._takes_rows)
        context = cpu_target.target_context
        return CompileResult._rebuild(context, *pickle.loads(content[_DIGEST:])), self._takes_rows

    def save(self, code: Any, takes_rows: list[bool]) -> None:
        """Keep it, and not more than a few older ones."""
        if self._folder is None or self._file is None or code.library.has_dynamic_globals:
            return
        content = dumps(_what_running_takes(code))
        try:
            _write(self._file, _digest(content) + content)
            others = self._folder.glob(f"{self._kernel.name}-*.code")
            for old in sorted(others, key=lambda path: path.stat().st_mtime)[:-KEPT]:
                old.unlink()
        except OSError as error:
            _log.warning("the compiled kernels cannot be kept in %s: %s", self._folder, error)
        _list(self._folder, self._kernel.name, self._file.name, takes_rows)


_lists: dict[Path, dict[str, tuple[str, list[bool]]]] = {}
"""Of each folder: which file belongs to which kernel, as the sources are now."""


def _listed(folder: Path) -> dict[str, tuple[str, list[bool]]]:
    """Which file belongs to which kernel: to find it out anew takes 0.2 s for all."""
    if folder not in _lists:
        try:
            _lists[folder] = json.loads(_list_file(folder).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            _lists[folder] = {}
    return _lists[folder]


def _list(folder: Path, kernel: str, file: str, takes_rows: list[bool]) -> None:
    """Put a kernel of the engine on the list, if it is not there."""
    known = _listed(folder)
    if kernel.startswith("go2_wbc.") and known.get(kernel) != [file, takes_rows]:
        known[kernel] = [file, takes_rows]  # type: ignore[assignment]
        with suppress(OSError):
            _write(_list_file(folder), json.dumps(known).encode())


def _list_file(folder: Path) -> Path:
    return folder / f"{_sources()}.list"


@cache
def _sources() -> str:
    """A hash of all of the engine's sources, and of what else machine code depends on."""
    digest = hashlib.sha256(repr(_machine()).encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _write(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(content)
    Path(file.name).replace(path)


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
def say_that_it_takes_time() -> None:
    """Log once that kernels are compiled now."""
    if kernel_folder() is not None:
        _log.warning("compiling the control kernels for this machine, once (about 30 s)")


@cache
def kernel_folder() -> Path | None:
    """Where compiled kernels are kept; None if nothing can be written, which is said."""
    folder = cache_root() / f"kernels-{platform.python_version()}-{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        _log.warning(
            "compiling the control kernels (about 30 s); they cannot be kept: %s. Name a folder "
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


def fingerprint(routine: Written) -> str:
    """A hash of all that a kernel's machine code depends on."""
    parts = [repr((_machine(), str(routine.signature)))]
    parts += _ingredients(routine.written, set())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _machine() -> tuple[str, ...]:
    """Versions and processor."""
    binding = llvmlite.binding
    versions = (platform.python_version(), numba.__version__, np.__version__)
    return (*versions, binding.get_host_cpu_name(), str(binding.get_host_cpu_features()))


def _ingredients(function: Any, seen: set[int]) -> Iterator[str]:
    """The code of a function, its constants, and the same of all that it calls."""
    if id(function) in seen:
        return
    seen.add(id(function))
    yield str(function.__module__)  # kept code names where each part of it comes from
    names: set[str] = set()
    for code in _codes(function.__code__):
        constants = [
            c for c in code.co_consts if c != function.__doc__ and not isinstance(c, CodeType)
        ]
        yield repr((code.co_code.hex(), constants, code.co_names, code.co_varnames))
        names |= set(code.co_names)
    known = dict(inspect.getclosurevars(function).nonlocals)
    known |= {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, value in sorted(known.items()):
        if isinstance(value, ModuleType) and value.__name__.partition(".")[0] in _OUR_OWN:
            inside = {n: part for n, part in vars(value).items() if n in names}
            for part, one in sorted(inside.items()):
                yield from _ingredient(f"{name}.{part}", one, seen)
        else:
            yield from _ingredient(name, value, seen)


def _ingredient(name: str, value: Any, seen: set[int]) -> Iterator[str]:
    if isinstance(value, Written):
        yield f"{name}: {value.signature}"
        yield from _ingredients(value.written, seen)
    elif isinstance(value, FunctionType):
        yield from _ingredients(value, seen)
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
        if isinstance(constant, CodeType):
            yield from _codes(constant)


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
