"""How kernels are compiled, and kept between runs.

Numba compiles a kernel for this processor where its module is first imported, about 20 s for all,
announced by one line of the log. The machine code is kept in a folder named by a hash of every
kernel's source, the versions and the processor, so that it never outlives them: numba itself looks
at the file that defines a function, not at those it calls. A folder that cannot be read is emptied
and filled anew; where no folder can be written, the kernels are compiled in every process.
"""

from __future__ import annotations

import hashlib
import logging
import os
import platform
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding
import numba
import numpy as np

_log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

CACHE_VARIABLE = "GO2_WBC_CACHE_DIR"
"""Environment variable that names the folder for compiled kernels; by default the user's cache."""


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


def _compiled(function: F, signature: str, folder: Path | None, nogil: bool) -> F:
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = "" if folder is None else str(folder)
    try:
        options = {"cache": folder is not None, "error_model": "numpy", "nogil": nogil}
        return numba.njit(signature, **options)(function)
    finally:
        numba.config.CACHE_DIR = before


@cache
def kernel_folder() -> Path | None:
    """Where compiled kernels are kept; None if nothing can be written. Says when it is empty."""
    folder = _cache_root() / f"kernels-{_fingerprint()}"
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


def _cache_root() -> Path:
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named)
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "go2_wbc"
    return Path.home() / ".cache" / "go2_wbc"


def _fingerprint() -> str:
    """A hash of all that machine code depends on."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    processor = llvmlite.binding.get_host_cpu_name()
    versions = (platform.python_version(), numba.__version__, np.__version__, processor)
    digest.update(repr((versions, Path(__file__).parent)).encode())
    return digest.hexdigest()[:16]
