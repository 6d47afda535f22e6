"""``go2-wbc doctor``: what is installed, what is missing, and the command that installs it.

Each ``judge_...`` checks one thing. ``version`` is the installed one, ``bounds`` are the versions
that this project requires, and a ``probe`` reports the import of a module in a process of its own:
a library that crashes the interpreter, or loads the wrong shared object, is a finding and does not
end the program.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import signal
import site
import subprocess
import sys
import textwrap
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import groupby
from pathlib import Path
from typing import Annotated

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from controller.cli.common import PROGRAM, ExitCode, installed_version, print_json
from go2_wbc.errors import EXTRAS, DescriptionError
from go2_wbc.errors import install_line as extra_line

WIDTH = 80
OLDEST_PYTHON, NEWEST_PYTHON = (3, 11), (3, 13)
MODULES: Mapping[str, str | None] = {
    "pin": "pinocchio",
    "pillow": "PIL",
    "pycollada": "collada",
    "example-robot-data": None,
}
"""The modules of libraries that have other names than these; ``None`` is data only."""
ROS2: Mapping[str, str] = {
    "ros-rclpy": "rclpy",
    "ros-rmw-fastrtps-cpp": "rclpy",
    "ros-geometry-msgs": "geometry_msgs.msg",
    "ros-nav-msgs": "nav_msgs.msg",
    "ros-rosgraph-msgs": "rosgraph_msgs.msg",
    "ros-sensor-msgs": "sensor_msgs.msg",
    "ros-std-srvs": "std_srvs.srv",
    "quadropted-msgs": "quadropted_msgs.action",
    "tf2-msgs": "tf2_msgs.msg",
}
"""What ``go2-wbc ros2`` uses, and the module that each brings; those of ``BUILT`` are built."""
BUILT = ("quadropted-msgs", "tf2-msgs")
BUILD_LINE = "ros2/build_interfaces.sh {python} dist && {pip} dist/*.whl"
NEEDED_SOLVERS: Mapping[str, str] = {"daqp": "daqp", "proxqp": "proxsuite", "quadprog": "quadprog"}
"""The QP solvers that the project uses, and the package that brings each."""


IMPORT_TIME_LIMIT = 60.0
"""Seconds after which an import counts as hung; the slowest takes 1 s on a laptop."""

_PROBE = """
import importlib, json, sys
module = importlib.import_module(sys.argv[1])
solvers = getattr(module, "available_solvers", [])
print(json.dumps({"file": getattr(module, "__file__", None) or "", "solvers": solvers}))
"""
_SIGNALS = {number.value: number.name for number in signal.Signals}


class Status(Enum):
    """How a finding bears on the installation: with a problem the project does not work."""

    OK = "ok"
    NOTE = "note"
    PROBLEM = "PROBLEM"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at, and the line to type if there is something to do."""

    section: str
    subject: str
    status: Status
    detail: str
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class ImportProbe:
    """How the import of a module went."""

    error: str = ""  #: why it failed, in one line; empty if it worked
    file: str = ""  #: the file that was imported
    solvers: tuple[str, ...] = ()  #: the QP solvers that the module offers, if it is ``qpsolvers``


def run(*, json: Annotated[bool, "print JSON for a program to read"] = False) -> int:
    """Check this installation: versions, robot files, QP solvers, display.

    Exit code 0 if all that is needed is here, 1 otherwise.

    Examples:
        go2-wbc doctor
        go2-wbc doctor --json
    """
    findings = examine()
    problems = [finding for finding in findings if finding.status is Status.PROBLEM]
    if json:
        rows = [asdict(item) | {"status": item.status.value.lower()} for item in findings]
        print_json({"ok": not problems, "findings": rows})
    else:
        print(render(findings))
    return ExitCode.FAILED if problems else ExitCode.OK


def examine() -> list[Finding]:
    """Everything that can be said about this installation."""
    bounds = requirements_of(PROGRAM)
    versions = {name: installed_version(name) for name in (*bounds, *ROS2)}
    modules = {name: MODULES.get(name, name) for name in bounds}
    ros2 = {module for name, module in ROS2.items() if versions[name] is not None}
    probes = probe_imports({module for module in modules.values() if module} | ros2)
    findings = [
        judge_python(sys.version_info[:3], platform.platform()),
        judge_system(sys.platform, platform.machine()),
        _judge_project(installed_version(PROGRAM)),
    ]
    for name, module in modules.items():
        probe = probes[module] if module else ImportProbe()
        findings.append(judge_library(name, versions[name], bounds[name], probe))
    placo, pin = versions.get("placo"), versions.get("pin")
    pairing = requirements_of("placo").get("pin", "")
    findings += judge_pairing(placo, pin, pairing, bounds.get("placo", ""))
    findings += judge_robot_files(bounds.get("example-robot-data", ""))
    findings += judge_solvers(probes.get("qpsolvers", ImportProbe()).solvers, bounds)
    for name in EXTRAS:
        asked = requirements_of(PROGRAM, name)
        here = {package: installed_version(package) for package in asked}
        findings.append(judge_extra(name, asked, here))
    findings.append(judge_display(sys.platform, os.environ))
    return findings + judge_ros2(versions, probes)


def judge_ros2(
    versions: Mapping[str, str | None], probes: Mapping[str, ImportProbe]
) -> list[Finding]:
    """Whether ``go2-wbc ros2`` can run; it is optional, so that nothing here is a problem."""
    section, install = "ROS 2 (optional)", extra_line("ros2", _python())
    if versions["ros-rclpy"] is None:
        detail = "not installed: go2-wbc ros2 and high_five_demo --ros2 need it"
        return [Finding(section, "extra [ros2]", Status.NOTE, detail, install)]
    build = BUILD_LINE.format(python=_python(), pip=_pip())
    found = []
    for name, module in ROS2.items():
        version, remedy = versions[name], build if name in BUILT else install
        if version is None:
            found.append(Finding(section, name, Status.NOTE, "not installed", remedy))
        elif error := probes[module].error:
            detail = f"{version} does not import: {error}"
            found.append(Finding(section, name, Status.NOTE, detail, remedy))
        else:
            found.append(Finding(section, name, Status.OK, version))
    return found


def judge_python(version: tuple[int, ...], system: str) -> Finding:
    """Whether this Python is one that all libraries have wheels for."""
    name = ".".join(map(str, version))
    if OLDEST_PYTHON <= version[:2] <= NEWEST_PYTHON:
        return Finding("Python", "python", Status.OK, f"{name} on {system}")
    detail = f"{name}: 3.11, 3.12 or 3.13 is needed"
    remedy = "make clean && make PYTHON=python3.12 demo"
    return Finding("Python", "python", Status.PROBLEM, detail, remedy)


def judge_system(system: str, machine: str) -> Finding:
    """Whether the project is tested on this system."""
    if (system, machine) == ("linux", "x86_64"):
        return Finding("Python", "system", Status.OK, "Linux on x86-64, which is tested")
    if system == "win32":
        detail = "Windows has no wheels of Pinocchio: work in WSL, which is a Linux"
        return Finding("Python", "system", Status.PROBLEM, detail, "wsl --install")
    name = {"darwin": "macOS", "linux": "Linux"}.get(system, system)
    return Finding("Python", "system", Status.NOTE, f"untested on {name}, {machine}")


def _judge_project(version: str | None) -> Finding:
    if version is None:
        return Finding("Python", PROGRAM, Status.PROBLEM, "not installed", f"{_pip()} -e .")
    return Finding("Python", PROGRAM, Status.OK, version)


def judge_library(name: str, version: str | None, bounds: str, probe: ImportProbe) -> Finding:
    """Whether a library is there, in a version that fits, and can be imported."""
    remedy = install_line(name, bounds)
    if version is None:
        detail = "not installed"
        if probe.file:
            detail += f" by pip here, but found at {probe.file}"
    elif not satisfies(version, bounds):
        detail = f"{version} does not fit {bounds}"
    elif probe.error:
        detail = f"{version} is installed, but its import fails: {probe.error}"
        remedy = install_line(name, bounds, again=True)
    elif _is_foreign(probe.file):
        detail = f"{version}, but {probe.file} is imported in its place"
        remedy = "unset PYTHONPATH"
    else:
        return Finding("Libraries", name, Status.OK, version)
    return Finding("Libraries", name, Status.PROBLEM, detail, remedy)


def judge_pairing(placo: str | None, pin: str | None, wanted: str, bounds: str) -> list[Finding]:
    """Whether placo and Pinocchio were built for each other: placo says which is ``wanted``."""
    if placo is None or pin is None:
        return []
    too_new = satisfies(pin, ">=4") and satisfies(placo, "<0.10")
    if satisfies(pin, wanted) and not too_new:
        return [Finding("Libraries", "placo + pin", Status.OK, "built for each other")]
    detail = f"placo {placo} was not built for pin {pin}" + (f" but for {wanted}" if wanted else "")
    line = install_line("placo", bounds or ">=0.10.2,<0.11")
    return [Finding("Libraries", "placo + pin", Status.PROBLEM, detail, line)]


def judge_robot_files(bounds: str) -> list[Finding]:
    """Whether the Go2's URDF, SRDF and meshes are found; ``example-robot-data`` brings them."""
    section, remedy = "Robot files", install_line("example-robot-data", bounds, again=True)
    try:
        from go2_wbc.robot.description import find_description

        description = find_description()
        urdf, srdf = description.urdf_path, description.srdf_path
        meshes = {mesh.get("filename", "") for mesh in ET.parse(urdf).iter("mesh")}
        for mesh in sorted(meshes):
            description.mesh_path(mesh)
    except (DescriptionError, ImportError) as error:
        return [Finding(section, "Go2", Status.PROBLEM, str(error), remedy)]
    return [
        Finding(section, "URDF", Status.OK, str(urdf)),
        Finding(section, "SRDF", Status.OK, str(srdf))
        if srdf is not None
        else Finding(section, "SRDF", Status.PROBLEM, "not found", remedy),
        Finding(section, "meshes", Status.OK, f"all {len(meshes)} found"),
    ]


def judge_solvers(available: tuple[str, ...], bounds: Mapping[str, str]) -> list[Finding]:
    """Whether every QP solver that the project uses is ``available`` in ``qpsolvers``."""
    found = []
    for name, package in NEEDED_SOLVERS.items():
        if name in available:
            found.append(Finding("QP solvers", name, Status.OK, "available"))
        else:
            line = install_line(package, bounds.get(package, ""), again=True)
            found.append(Finding("QP solvers", name, Status.PROBLEM, "not available", line))
    others = ", ".join(sorted(set(available) - set(NEEDED_SOLVERS)))
    if others:
        found.append(Finding("QP solvers", "others", Status.NOTE, others))
    return found


def judge_extra(
    name: str, bounds: Mapping[str, str], versions: Mapping[str, str | None]
) -> Finding:
    """Whether the packages of an optional extra are there; nothing else needs them."""
    purpose, lacking = EXTRAS[name], list[str]()
    for package, wanted in bounds.items():
        version = versions[package]
        if version is None:
            lacking.append(f"{package} is not installed")
        elif not satisfies(version, wanted):
            lacking.append(f"{package} {version} does not fit {wanted}")
    if not lacking:
        return Finding("Extras", name, Status.OK, purpose)
    more = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
    line = extra_line(name, _python())
    return Finding("Extras", name, Status.NOTE, f"{purpose}; {lacking[0]}{more}", line)


def judge_display(system: str, environment: Mapping[str, str]) -> Finding:
    """Whether ``--viewer`` can open a window; nothing else needs one."""
    found = next((v for v in ("WAYLAND_DISPLAY", "DISPLAY") if environment.get(v)), None)
    if system == "darwin":
        status, detail = Status.OK, 'with mjpython "$(command -v go2-wbc)" in place of go2-wbc'
    elif system == "win32":
        status, detail = Status.OK, "this system has a desktop"
    elif found is not None:
        status, detail = Status.OK, f"possible, {found} is {environment[found]}"
    else:
        status, detail = Status.NOTE, "no display here; everything else runs without one"
    return Finding("Display", "--viewer", status, detail)


def install_line(name: str, bounds: str, *, again: bool = False) -> str:
    """The command that installs a package into this very environment."""
    options = " --force-reinstall --no-deps" if again else ""
    return f'{_pip()}{options} "{name}{bounds}"'


def _pip() -> str:
    return f"{_python()} -m pip install"


def _python() -> str:
    return f'"{sys.executable}"' if " " in sys.executable else sys.executable


def _is_foreign(file: str) -> bool:
    homes = [sys.prefix, sys.base_prefix, site.getusersitepackages()]
    return bool(file) and not any(Path(file).is_relative_to(home) for home in homes)


def render(findings: list[Finding]) -> str:
    """The findings as text for a person, 80 columns wide but for paths and lines to type."""
    lines: list[str] = []
    for section, items in groupby(findings, key=lambda finding: finding.section):
        lines += [section, *(row for item in items for row in _rows(item)), ""]
    problems = sum(finding.status is Status.PROBLEM for finding in findings)
    verdict = "Everything that is needed is here."
    if problems:
        verdict = f"{problems} problem{'s' * (problems > 1)}; the lines after -> fix them."
    return "\n".join([*lines, verdict])


def _rows(finding: Finding) -> list[str]:
    head = f"  {finding.status.value:<8} {finding.subject:<19} "
    rows = textwrap.wrap(
        finding.detail,
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [*rows, f"           -> {finding.remedy}"] if finding.remedy else rows


# --- what is asked --------------------------------------------------------------------------------


def probe_imports(modules: Collection[str]) -> dict[str, ImportProbe]:
    """Import each module in a process of its own, all at the same time."""
    with ThreadPoolExecutor(max(len(modules), 1)) as pool:
        return dict(zip(modules, pool.map(_probe, modules), strict=True))


def _probe(module: str) -> ImportProbe:
    command = [sys.executable, "-P", "-c", _PROBE, module]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=IMPORT_TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return ImportProbe(error=f"the import did not end within {IMPORT_TIME_LIMIT:g} s")
    if done.returncode < 0:
        name = _SIGNALS.get(-done.returncode, f"signal {-done.returncode}")
        return ImportProbe(error=f"the import crashed ({name})")
    if done.returncode > 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return ImportProbe(error=lines[-1])
    answer = json.loads(done.stdout.splitlines()[-1])
    return ImportProbe(file=answer["file"], solvers=tuple(answer["solvers"]))


def requirements_of(distribution: str, extra: str = "") -> Mapping[str, str]:
    """Version bounds that a package puts on its dependencies by name, or on those of an extra.

    Empty for a package that is not installed, if it is not this one.
    """
    try:
        rows = importlib.metadata.requires(distribution) or []
    except importlib.metadata.PackageNotFoundError:
        here = Path(__file__).parents[2] / "pyproject.toml"
        if distribution != PROGRAM or not here.is_file():
            return {}
        project = tomllib.loads(here.read_text(encoding="utf-8"))["project"]
        rows = project["optional-dependencies"][extra] if extra else project["dependencies"]
        return parse_requirements(rows)
    return parse_requirements(rows, extra)


def parse_requirements(rows: Iterable[str], extra: str = "") -> dict[str, str]:
    """``["placo<0.11,>=0.10.2", ...]`` as ``{"placo": "<0.11,>=0.10.2", ...}``.

    Args:
        rows: as a package's metadata has them.
        extra: to have those that it alone asks for; by default what every installation needs.
    """
    found = [Requirement(row) for row in rows]
    return {
        item.name: str(item.specifier)
        for item in found
        if _is_asked(item, extra) and not (extra and _is_asked(item, ""))
    }


def _is_asked(item: Requirement, extra: str) -> bool:
    return item.marker is None or item.marker.evaluate({"extra": extra})


def satisfies(version: str, bounds: str) -> bool:
    """Whether ``version``, pre-releases included, lies within ``bounds`` (PEP 440)."""
    return SpecifierSet(bounds).contains(version, prereleases=True)
