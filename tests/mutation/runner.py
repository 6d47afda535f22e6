"""Runs tests on a private copy of the tree, in which one file at a time is changed."""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

NOT_COPIED = shutil.ignore_patterns(
    ".git", ".venv*", "out", "build", "dist", "__pycache__", ".*_cache", ".hypothesis"
)
NOT_PASSED = ("PYTHONPATH", "PYTEST_ADDOPTS")
BUSY = 8.0  # real time against CPU time on a loaded machine; beyond, a test waits for ever
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
_PASSED_CODES = (0, 5)  # 5: no test was selected


@dataclass(frozen=True, slots=True)
class Outcome:
    """Whether all tests passed, which did not, and how long it took [s of CPU time]."""

    passed: bool
    failed: tuple[str, ...]
    seconds: float


class Sandbox:
    """A copy of the tree ``root`` in ``home``, whose packages come before installed ones."""

    def __init__(self, root: Path, home: Path) -> None:
        self.home = home
        self._clock = int(time.time())
        kept = {name: value for name, value in os.environ.items() if name not in NOT_PASSED}
        # Without the checks of types: a test shall notice, and it is faster.
        self._environment = {**kept, "PYTHONPATH": str(home), "GO2_WBC_TYPECHECK": "0"}
        shutil.copytree(root, home, ignore=NOT_COPIED)

    def write(self, path: str, source: bytes) -> None:
        """Replace a file; each time it looks a second newer, so that no byte code is stale."""
        self._clock += 1
        (self.home / path).write_bytes(source)
        os.utime(self.home / path, (self._clock, self._clock))

    def require_import(self, path: str) -> None:
        """Raise if importing the module of ``path`` does not load the copy's file."""
        module = path.removesuffix(".py").replace("/", ".")
        code = f"import {module}; print({module}.__file__)"
        found = subprocess.check_output(
            [sys.executable, "-c", code], cwd=self.home, env=self._environment, text=True
        )
        if Path(found.split()[-1]) != self.home / path:
            raise RuntimeError(f"{module} is imported from {found}, not from the copy")

    def test(
        self, targets: Sequence[str], marker: str, excluded: Iterable[str], limit: float
    ) -> Outcome:
        """Run tests up to the first failure, for at most ``limit`` s of CPU time (0: no limit)."""
        command = [sys.executable, "-m", "pytest", *targets, "-q", "-m", marker, "-rfE"]
        command += ["-p", "no:cacheprovider", *(f"--deselect={name}" for name in excluded)]
        command += ["-x"] if limit else []
        most = int(limit) or resource.RLIM_INFINITY
        before = _used()
        process = subprocess.Popen(
            command,
            cwd=self.home,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most)),
        )
        try:
            told, _ = process.communicate(timeout=BUSY * limit or None)
        except BaseException as reason:  # also when the run is interrupted
            os.killpg(process.pid, signal.SIGKILL)
            told, _ = process.communicate()
            if not isinstance(reason, subprocess.TimeoutExpired):
                raise
        passed = process.returncode in _PASSED_CODES
        failed = tuple(_FAILED.findall(told)) or (f"exit code {process.returncode}",)
        return Outcome(passed, () if passed else failed, _used() - before)


def nearest_tests(root: Path, path: str) -> list[str]:
    """A module's tests: those at its place and its folder's, then its package's that import it."""
    place, package = Path("tests", path), path.split("/")[0]
    module = path.removesuffix(".py").replace("/", ".")
    named = sorted((root / place.parent).glob(f"test_{place.stem}*.py"))
    named += (root / place.parent.parent).glob(f"test_{place.parent.stem}.py")
    files = sorted((root / "tests" / package).rglob("test_*.py"))
    importing = [file for file in files if file not in named and module in file.read_text()]
    return [str(file.relative_to(root)) for file in [*named, *importing]]


def _used() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
