"""Runs tests on a private copy of the tree, in which one file at a time is changed."""

import ast
import contextlib
import gc
import importlib
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

NOT_COPIED = shutil.ignore_patterns(
    ".git", ".venv*", "out", "build", "dist", "__pycache__", ".*_cache", ".hypothesis"
)
LIBRARIES = ("pinocchio", "mujoco", "placo", "hypothesis", "qpsolvers", "scipy.interpolate")
BUSY = 8.0  # real time against CPU time on a loaded machine; beyond, a test waits for ever
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/.*?)(?: - .*)?$", re.MULTILINE)
_NO_TESTS = 5  # pytest's exit code
_END = "\npytest has come to its end\n"  # a test, or what it tests, may end the process before


@dataclass(frozen=True, slots=True)
class Outcome:
    """What tests said."""

    passed: bool  #: whether all did
    failed: tuple[str, ...]  #: those that did not, or how their process ended
    seconds: float  #: of CPU time
    is_late: bool = False  #: whether they were stopped: their time was up

    @property
    def names_tests(self) -> bool:
        """Whether tests failed; else something has ended their process."""
        return bool(self.failed) and self.failed[0].startswith("tests/")


class Sandbox:
    """A copy of the tree ``root`` in ``home``, whose packages come before installed ones.

    Tests run in forks of this process, which has loaded the large libraries once.
    """

    def __init__(self, root: Path, home: Path) -> None:
        self.home = home
        self._clock = int(time.time())
        shutil.copytree(root, home, ignore=NOT_COPIED)
        for library in LIBRARIES:
            with contextlib.suppress(ImportError):
                importlib.import_module(library)

    def write(self, path: str, source: bytes) -> None:
        """Replace a file; each time it looks a second newer, so that no byte code is stale."""
        self._clock += 1
        (self.home / path).write_bytes(source)
        os.utime(self.home / path, (self._clock, self._clock))

    def test(
        self,
        targets: Sequence[str],
        marker: str,
        excluded: Iterable[str],
        limit: float,
        *,
        plain: bool = False,
        to_the_end: bool = False,
    ) -> Outcome:
        """Run tests up to the first failure, for at most ``limit`` seconds of CPU time.

        With ``plain`` kernels run as the Python that they are written in: none is compiled anew.
        With ``to_the_end`` failures stop nothing.
        """
        told = self.home.with_suffix(".txt")
        command = [*targets, "-q", "-m", marker, "-rfE", "-p", "no:cacheprovider"]
        command += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # libraries are loaded
        command += ["--continue-on-collection-errors" if to_the_end else "-x"]
        command += [f"--deselect={name}" for name in excluded]
        before = _used()
        process = multiprocessing.get_context("fork").Process(
            target=_run_pytest, args=(self.home, told, command, int(limit), plain)
        )
        process.start()
        try:
            process.join(BUSY * limit)
        finally:
            if process.is_alive():
                os.killpg(process.pid or 0, signal.SIGKILL)
                process.join()
        code, text = process.exitcode or 0, told.read_text()
        has_ended = text.endswith(_END)
        failed = tuple(_FAILED.findall(text)) if has_ended else ()
        passed = code in (0, _NO_TESTS) and has_ended
        is_late = code in (-signal.SIGXCPU, -signal.SIGKILL)
        told = () if passed else failed or (f"exit code {code}",)
        return Outcome(passed, told, _used() - before, is_late)


def _run_pytest(home: Path, told: Path, command: list[str], limit: int, plain: bool) -> None:
    """In a fork: forget what was imported of the real tree, and test the copy."""
    gc.freeze()  # what the process before the fork has made stays
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    sys.stdout = sys.stderr = stream = told.open("w")
    os.dup2(stream.fileno(), 1)
    os.dup2(stream.fileno(), 2)
    os.chdir(home)
    os.environ.pop("PYTEST_ADDOPTS", None)
    # Without the checks of types: a test shall notice, and it is faster.
    os.environ.update(PYTHONPATH=str(home), GO2_WBC_TYPECHECK="0", GO2_WBC_PLAIN=str(int(plain)))
    ours = {folder.name for folder in home.iterdir()}
    for name in [name for name in sys.modules if name.partition(".")[0] in ours]:
        del sys.modules[name]
    sys.path.insert(0, str(home))
    code = pytest.main(command)
    stream.write(_END)
    stream.flush()
    os._exit(code)


def own_tests(root: Path, path: str) -> list[str]:
    """Those at a module's place, or its folder's."""
    place = Path("tests", path)
    named = sorted((root / place.parent).glob(f"test_{place.stem}*.py"))
    named += (root / place.parent.parent).glob(f"test_{place.parent.stem}.py")
    return [str(file.relative_to(root)) for file in named]


def nearest_tests(root: Path, path: str) -> list[str]:
    """A module's own tests, and those of its package that import it; else those of its folder."""
    module, homes = path.removesuffix(".py").replace("/", "."), _exported(root)
    files = sorted((root / "tests" / path.split("/")[0]).rglob("test_*.py"))
    importing = [str(f.relative_to(root)) for f in files if module in _used_by(f, homes)]
    found = list(dict.fromkeys([*own_tests(root, path), *importing]))
    folder = sorted((root / "tests" / path).parent.glob("test_*.py"))
    return found or [str(file.relative_to(root)) for file in folder]


@cache
def _exported(root: Path) -> dict[str, str]:
    """The module behind each name that an ``__init__`` exports, such as ``motions.check``."""
    files = [file for folder in root.iterdir() for file in folder.rglob("__init__.py")]
    packages = {".".join(file.parent.relative_to(root).parts): file for file in files}
    return {
        f"{package}.{name.name}": node.module
        for package, file in packages.items()
        for node in ast.walk(ast.parse(file.read_bytes()))
        if isinstance(node, ast.ImportFrom) and node.module
        for name in node.names
    }


def _used_by(file: Path, homes: Mapping[str, str]) -> set[str]:
    """The modules that a file imports, or whose names it imports or uses; their packages, too."""
    found = set[str]()
    for node in ast.walk(ast.parse(file.read_bytes())):
        match node:
            case ast.ImportFrom(module=str(module), names=names):
                found |= {module, *(f"{module}.{name.name}" for name in names)}
            case ast.Import(names=names):
                found |= {name.name for name in names}
            case ast.Attribute(value=ast.Name(id=package), attr=name):
                found.add(f"{package}.{name}")
            case ast.Constant(value=str(words)):  # a command line
                found |= {*words.split()}
    while new := {homes[name] for name in found & homes.keys()} - found:
        found |= new
    return found


def _used() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
