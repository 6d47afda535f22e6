"""What is kept of compiled kernels between runs: machine code, in files.

The name of a file has a hash of all that the code in it depends on: the kernel's and its
subroutines' own code and constants, their records, the versions and the processor. So a change of
one function makes anew only what calls it. A file that is damaged is made anew; where no file can
be written, kernels are compiled in every process.

Loading is part of every start, so it must not take long: it needs nothing of Numba's compiler; see
``_what_running_takes``.
"""

from __future__ import annotations

import enum
import hashlib
import inspect
import logging
import os
import pickle
import platform
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.environment import Environment
from numba.core.runtime import _nrt_python  # pyright: ignore[reportAttributeAccessIssue]
from numba.core.serialize import dumps

_log = logging.getLogger(__name__)

CACHE_VARIABLE = "GO2_WBC_CACHE_DIR"
"""Environment variable that names the folder for compiled kernels and solved plans; by default the
user's cache."""
_OUR_OWN = ("go2_wbc", "motions", "controller", "viz")
KEPT = 8
"""How many versions of a kernel are kept, those used last: of other environments, or branches."""


class Written(ABC):
    """A function that is compiled.

    Attributes:
        written: the function.
    """

    written: Any  # a function

    @property
    def name(self) -> str:
        """Module and function."""
        return f"{self.written.__module__}.{self.written.__qualname__}"

    @cached_property
    @abstractmethod
    def signature(self) -> Any:
        """As Numba has it."""


class KeptCode(NullCache):
    """The file in which a kernel's machine code is kept, in the place of Numba's own cache."""

    def __init__(self, made: Written) -> None:
        self._kernel = made
        folder = kernel_folder()
        self._file = None if folder is None else folder / f"{made.name}-{fingerprint(made)}.code"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was kept; None if there is none that can be used."""
        del sig
        if self._file is None:
            say_that_it_takes_time()
            return None
        try:
            content = self._file.read_bytes()
            self._file.touch()  # it is in use
        except OSError:
            say_that_it_takes_time()
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
            for old in sorted(others, key=lambda path: path.stat().st_mtime)[:-KEPT]:
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
def say_that_it_takes_time() -> None:
    """Log once that kernels are compiled now."""
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


def fingerprint(routine: Written) -> str:
    """A hash of all that a kernel's machine code depends on."""
    versions = (platform.python_version(), numba.__version__, np.__version__)
    processor = (
        llvmlite.binding.get_host_cpu_name(),
        str(llvmlite.binding.get_host_cpu_features()),
    )
    parts = [repr((versions, processor, str(routine.signature)))]
    parts += _ingredients(routine.written, set())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _ingredients(function: Any, seen: set[int]) -> Iterator[str]:
    """The code of a function, its constants, and the same of all that it calls."""
    if id(function) in seen:
        return
    seen.add(id(function))
    names: set[str] = set()
    for code in _codes(function.__code__):
        constants = [c for c in code.co_consts if c != function.__doc__ and not _is_code(c)]
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
        if _is_code(constant):
            yield from _codes(constant)


def _is_code(constant: object) -> bool:
    return isinstance(constant, CodeType)
