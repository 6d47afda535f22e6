"""How kernels are compiled, and kept between runs.

Numba compiles a kernel for this processor where its module is first imported, about 20 s for all,
announced by one line of the log. The machine code is kept in a folder named by a hash of every
kernel's source, the versions and the processor, so that it never outlives them: numba itself looks
at the file that defines a function, not at those it calls. A folder that cannot be read is emptied
and filled anew; where no folder can be written, the kernels are compiled in every process.

Loading is part of every start, so it must not take long. Only what Python calls is loaded, a
``kernel``; a ``subroutine`` is part of the machine code of the kernels that call it. And loading
needs nothing of Numba's compiler: see ``_KernelCache``.
"""

from __future__ import annotations

import hashlib
import logging
import os
import platform
import shutil
import tempfile
from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite.binding
import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.environment import Environment
from numba.core.registry import CPUDispatcher
from numba.core.runtime import _nrt_python  # pyright: ignore[reportAttributeAccessIssue]

_log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

CACHE_VARIABLE = "GO2_WBC_CACHE_DIR"
"""Environment variable that names the folder for compiled kernels and solved plans; by default the
user's cache."""


def kernel(signature: str, *, nogil: bool = False) -> Callable[[F], F]:
    """Compile a function for one signature (numba's notation) now, or load what was compiled.

    No fast-math flag is set: the bits of a result depend on the inputs only, not on the processor.
    With ``nogil`` other threads run meanwhile: for one that works long enough to delay a control
    loop, on arrays that no other thread changes.
    """

    def compiled(function: F) -> F:
        folder = kernel_folder()
        if folder is None:
            return _compiled(function, signature, None, nogil)
        try:
            return _compiled(function, signature, folder, nogil)
        except Exception as error:  # whatever unpickling a damaged file, or a full disk, raises
            what = f"{type(error).__name__}: {error}"
            _log.warning("the compiled kernels in %s are of no use (%s)", folder, what)
        shutil.rmtree(folder, ignore_errors=True)
        try:
            return _compiled(function, signature, folder, nogil)
        except OSError:
            return _compiled(function, signature, None, nogil)

    return compiled


def subroutine(signature: str) -> Callable[[F], F]:
    """Compile a function for one signature when a kernel that calls it is compiled.

    A process that loads the kernel does not need it. Called from Python, as by a test, it is
    compiled for the arguments that it is given.
    """
    return lambda function: cast(F, _Subroutine(function, signature))


class _Subroutine:
    """A function that Numba is told of when it is needed: most processes load only its callers."""

    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        self._function, self._signature = function, signature

    @cached_property
    def _dispatcher(self) -> Any:
        return numba.njit(error_model="numpy")(self._function)

    @property
    def _numba_type_(self) -> Any:
        """What Numba asks a global variable for, once it compiles code that names it."""
        if not self._dispatcher.overloads:
            self._dispatcher.compile(self._signature)
            self._dispatcher.disable_compile()
        return self._dispatcher._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        return self._dispatcher(*arguments)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._dispatcher, name)


def _compiled(function: F, signature: str, folder: Path | None, nogil: bool) -> F:
    dispatcher = numba.njit(error_model="numpy", nogil=nogil)(function)
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = "" if folder is None else str(folder)
    try:
        if folder is not None:
            dispatcher._cache = _KernelCache(function)
        dispatcher.compile(signature)
    finally:
        numba.config.CACHE_DIR = before
    dispatcher.disable_compile()
    if dispatcher.stats.cache_hits:
        dispatcher.__class__ = _Loaded
        dispatcher._for_callers = _Subroutine(function, signature)
    return dispatcher


class _Loaded(CPUDispatcher):
    """A kernel that was loaded: a kernel that calls it and is compiled now compiles it along."""

    _for_callers: _Subroutine

    @property
    def _numba_type_(self) -> Any:
        return self._for_callers._numba_type_


class _MachineCode(CompileResultCacheImpl):
    """What is kept of a compiled function: what running it takes, not what a caller is linked with.

    With it Numba keeps the function's intermediate code, for callers that are compiled later, and
    loading one parses it all: only the entry's name is asked for. And it keeps an environment for
    each of its own functions that was compiled along (``np.zeros``, ``min``), and loading one
    imports that function's module, scipy.linalg at last. Compiled code takes nothing from that
    module: any other will do.
    """

    def reduce(self, cres: Any) -> tuple[Any, ...]:
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


class _KernelCache(FunctionCache):
    """Numba's cache, but loading does not import the compiler's library of functions.

    That is 0.2 s of processor time, and compiling imports it where it is needed.
    """

    _impl_class = _MachineCode

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        _offer_runtime()
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


@cache
def kernel_folder() -> Path | None:
    """Where compiled kernels are kept; None if nothing can be written. Says when it is empty."""
    folder = cache_root() / f"kernels-{_fingerprint()}"
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
    if not any(folder.rglob("*.nbi")):
        _log.warning("compiling the control kernels for this machine, once (about 20 s)")
    return folder


def cache_root() -> Path:
    """The folder for what this package makes once and keeps."""
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named)
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "go2_wbc"
    return Path.home() / ".cache" / "go2_wbc"


def _fingerprint() -> str:
    """A hash of all that machine code depends on."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.parent.rglob("*.py")):
        digest.update(source.read_bytes())
    processor = llvmlite.binding.get_host_cpu_name()
    versions = (platform.python_version(), numba.__version__, np.__version__, processor)
    digest.update(repr((versions, Path(__file__).parent)).encode())
    return digest.hexdigest()[:16]
