"""pytest plugin: every motion of a file is a test, and ``check_motion`` checks one inside a test.

    pytest my_motion.py                 each @motion of the file is a test
    pytest --motions FOLDER             the same for every file of a folder

    def test_bow(check_motion):
        report = check_motion(bow(angle=0.3))

Required margins beyond the limits come from the ini option ``motion_margins`` (lines such as
``support = 0.03``) or the marker ``motion_margins(support=0.03)``. This module is loaded in every
run of pytest in its environment, so it imports nothing heavy until it is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from motions import FeasibilityChecker, FeasibilityReport, Motion, Timeline

_SIGNS = ("@motion", "import")  #: What a file with motions contains
PINOCCHIO_WARNING = "ignore:Please update your 'hppfcl' imports:DeprecationWarning:hppfcl"
"""Pinocchio 3.8 imports its collision library under that library's former name."""


class InfeasibleMotion(Exception):
    """The robot cannot do a motion, or not with the required margins."""

    def __init__(self, report: FeasibilityReport, short: Mapping[str, str]) -> None:
        wrong = [*map(str, report.failures), *short.values()]
        head = f"the robot cannot do {report.motion!r} as required: {wrong[0]}"
        super().__init__("\n".join([head, *(f"x {what}" for what in wrong), report.table()]))


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--motions`` and ``motion_margins``."""
    group = parser.getgroup("go2 motions")
    group.addoption(
        "--motions",
        metavar="FOLDER",
        action="append",
        default=[],
        help="check every motion in the Python files of this folder",
    )
    parser.addini("motion_margins", "required margins of motions: check = margin", "linelist")


def pytest_configure(config: pytest.Config) -> None:
    """Announce the marker, and let pytest look into the folders of motions."""
    config.addinivalue_line(
        "markers", "motion_margins(**margins): margins that check_motion requires, by check"
    )
    config.addinivalue_line("filterwarnings", PINOCCHIO_WARNING)
    for folder in config.getoption("--motions") or []:
        if not Path(folder).exists():
            raise pytest.UsageError(f"--motions: there is no folder {folder}")
        config.args.append(folder)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect the motions of files that were asked for."""
    if file_path.suffix != ".py" or not _is_wanted(file_path, parent.config):
        return None
    text = file_path.read_text(encoding="utf-8", errors="replace")
    if not all(sign in text for sign in _SIGNS):
        return None
    return MotionFile.from_parent(parent, path=file_path)


class MotionFile(pytest.File):
    """A file with motions."""

    def collect(self) -> Iterator[MotionItem]:
        """One test for every motion."""
        from go2_wbc.errors import TimelineError
        from motions import load_file

        try:
            found = load_file(self.path)
        except TimelineError as error:
            raise self.CollectError(str(error)) from error
        for name, motion in found.items():
            yield MotionItem.from_parent(self, name=name, motion=motion)


class MotionItem(pytest.Item):
    """Checks one motion, with its default parameters."""

    def __init__(self, *, motion: Motion, **rest: object) -> None:
        """``motion``: what to check; ``rest`` is pytest's own."""
        super().__init__(**rest)  # type: ignore[arg-type]
        self._motion = motion

    def runtest(self) -> None:
        """Raise InfeasibleMotion if the robot cannot do it."""
        _require(self._motion, _ini_margins(self.config))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException]) -> str:  # type: ignore[override]
        """The table of margins instead of a traceback."""
        return str(excinfo.value)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where the motion is written."""
        line = int(self._motion.source.rsplit(":", 1)[1])
        return self.path, line - 1, f"motion {self.name}"


@pytest.fixture
def check_motion(request: pytest.FixtureRequest) -> Callable[..., FeasibilityReport]:
    """A function that checks a motion, fails the test if need be, and returns the report."""
    margins = _ini_margins(request.config)
    marker = request.node.get_closest_marker("motion_margins")
    if marker is not None:
        margins |= marker.kwargs

    def check(motion: Motion | Timeline) -> FeasibilityReport:
        __tracebackhide__ = True
        try:
            return _require(motion, margins)
        except InfeasibleMotion as error:
            message = str(error)
        pytest.fail(message, pytrace=False)

    return check


@cache
def _checker() -> FeasibilityChecker:
    from motions import FeasibilityChecker

    return FeasibilityChecker()


def _require(motion: Motion | Timeline, margins: Mapping[str, float]) -> FeasibilityReport:
    report = _checker().check(motion)
    short: dict[str, str] = {}
    for check, least in margins.items():
        name = check.replace("_", " ")
        if name not in report.margins:
            short[name] = f"{name}: required, but not among {', '.join(report.margins)}"
        elif not report.margins[name].margin >= least:
            finding = report.margins[name]
            short[name] = f"{finding}; margin {finding.margin:.3g}, required {least:g}"
    if short or not report.ok:
        raise InfeasibleMotion(report, short)
    return report


def _ini_margins(config: pytest.Config) -> dict[str, float]:
    margins = {}
    for line in config.getini("motion_margins"):
        name, _, value = line.partition("=")
        try:
            margins[name.strip()] = float(value)
        except ValueError:
            raise pytest.UsageError(f"motion_margins: {line!r} is not 'check = margin'") from None
    return margins


def _is_wanted(path: Path, config: pytest.Config) -> bool:
    """Whether a file was named on the command line, or lies in a folder of motions."""
    named = [
        Path(arg.split("::")[0]).resolve()
        for arg in config.invocation_params.args
        if isinstance(arg, str) and not arg.startswith("-")
    ]
    folders = [Path(folder).resolve() for folder in config.getoption("--motions") or []]
    is_test = path.name.startswith("test_") or path.name.endswith("_test.py")
    return (path in named and not is_test) or any(folder in path.parents for folder in folders)
