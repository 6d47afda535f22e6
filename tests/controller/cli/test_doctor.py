"""The doctor finds each known illness, names the line that cures it, and likes a healthy body."""

import importlib.metadata
import json
import sys
import tomllib
from pathlib import Path

import pytest

from controller.cli import doctor
from controller.cli.common import PROGRAM, ExitCode
from controller.cli.doctor import Finding, ImportProbe, Status
from go2_wbc.errors import EXTRAS, DescriptionError
from tests.controller.cli.conftest import Run

ROOT = Path(__file__).resolve().parents[3]
INSIDE = str(Path(sys.prefix) / "lib" / "placo.so")
BOUNDS = ">=0.10.2,<0.11"
HEALTHY = Finding("Python", "python", Status.OK, "3.11.7")
ILL = Finding("Libraries", "placo", Status.PROBLEM, "not installed", 'pip install "placo"')


def test_the_environment_of_these_tests_is_healthy() -> None:
    findings = doctor.examine()
    # Whether the project itself is installed does not matter for running its tests.
    problems = [item for item in findings if item.status is Status.PROBLEM]
    assert [item for item in problems if item.subject != PROGRAM] == []
    subjects = {item.subject for item in findings}
    assert {"pin", "placo", "mujoco", "placo + pin", "URDF", "SRDF", "daqp"} <= subjects


def test_a_module_that_imports_is_found_where_it_lies_and_qpsolvers_names_its_solvers() -> None:
    probes = doctor.probe_imports(["json", "qpsolvers"])
    assert probes["json"].error == ""
    assert Path(probes["json"].file).name == "__init__.py"
    assert "daqp" in probes["qpsolvers"].solvers


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("import os\nos.abort()", "crashed (SIGABRT)"),
        ("raise ImportError('libpinocchio.so.4: no such file')", "libpinocchio.so.4"),
        ("import sys\nsys.exit(7)", "exit code 7"),
    ],
)
def test_a_broken_import_is_a_finding_and_not_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, expected: str
) -> None:
    (tmp_path / "broken_library.py").write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert expected in doctor.probe_imports(["broken_library"])["broken_library"].error


def test_an_import_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "hanging_library.py").write_text("while True: pass", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(doctor, "IMPORT_TIME_LIMIT", 0.2)
    assert "0.2 s" in doctor.probe_imports(["hanging_library"])["hanging_library"].error


@pytest.mark.parametrize(
    ("version", "bounds", "fits"),
    [
        ("0.10.2", ">=0.10.2,<0.11", True),
        ("0.9.3", ">=0.10.2,<0.11", False),
        ("10.0", ">9", True),
        ("1.2.3rc1", "<=1.2.3", True),
        ("7", "", True),
    ],
)
def test_version_bounds_are_compared_by_number(version: str, bounds: str, fits: bool) -> None:
    assert doctor.satisfies(version, bounds) is fits


def test_requirements_are_read_without_extras_and_are_none_of_what_is_absent() -> None:
    rows = ["placo<0.11,>=0.10.2", "pin", "x[y]>=1 ; python_version>'3'", "ruff; extra == 'dev'"]
    assert doctor.parse_requirements(rows) == {"placo": "<0.11,>=0.10.2", "pin": "", "x": ">=1"}
    assert doctor.requirements_of("no-such-distribution-anywhere") == {}


@pytest.mark.parametrize("is_installed", [True, False])
def test_every_library_that_the_project_asks_for_is_known(
    monkeypatch: pytest.MonkeyPatch, *, is_installed: bool
) -> None:
    """``coal`` and ``scipy`` were not looked at: without them all was said to be there."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    rows = project["dependencies"]

    def requires(name: str) -> list[str]:
        if is_installed:
            return rows
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", requires)
    assert set(doctor.requirements_of(PROGRAM)) == set(doctor.parse_requirements(rows)) > {"coal"}


@pytest.mark.parametrize(
    ("version", "is_fine"),
    [((3, 10, 9), False), ((3, 11, 0), True), ((3, 13, 9), True), ((3, 14, 0), False)],
)
def test_a_python_without_wheels_is_a_problem(version: tuple[int, ...], *, is_fine: bool) -> None:
    finding = doctor.judge_python(version, "Linux")
    assert finding.status is (Status.OK if is_fine else Status.PROBLEM)
    assert ("make PYTHON=" in finding.remedy) is not is_fine


@pytest.mark.parametrize(
    ("version", "probe", "said", "remedy"),
    [
        (None, ImportProbe(error="No module named 'placo'"), "not installed", BOUNDS),
        ("0.9.3", ImportProbe(file=INSIDE), f"does not fit {BOUNDS}", BOUNDS),
        ("0.10.2", ImportProbe(error="libx.so"), "import fails: libx.so", "--force-reinstall"),
        ("0.10.2", ImportProbe(file="/opt/ros/placo.so"), "/opt/ros", "unset PYTHONPATH"),
        (None, ImportProbe(file="/opt/ros/placo.so"), "/opt/ros", BOUNDS),
    ],
)
def test_an_ill_library_is_named_with_its_cure(
    version: str | None, probe: ImportProbe, said: str, remedy: str
) -> None:
    finding = doctor.judge_library("placo", version, BOUNDS, probe)
    assert finding.status is Status.PROBLEM
    assert said in finding.detail
    assert remedy in finding.remedy


def test_a_library_that_fits_and_imports_is_fine() -> None:
    finding = doctor.judge_library("placo", "0.10.2", BOUNDS, ImportProbe(file=INSIDE))
    assert finding == Finding("Libraries", "placo", Status.OK, "0.10.2")


@pytest.mark.parametrize(
    ("placo", "pin", "wanted", "status"),
    [
        ("0.10.2", "3.8.0", "==3.8.0", Status.OK),
        ("0.10.2", "4.1.0", "==3.8.0", Status.PROBLEM),
        ("0.9.3", "4.1.0", "", Status.PROBLEM),
        ("0.9.3", "3.7.0", "", Status.OK),
    ],
)
def test_placo_and_pinocchio_must_be_built_for_each_other(
    placo: str, pin: str, wanted: str, status: Status
) -> None:
    """``pip install pin placo`` can pair pin 4.1.0 with placo 0.9.3, which cannot be imported."""
    (finding,) = doctor.judge_pairing(placo, pin, wanted, "")
    assert finding.status is status
    assert ("placo>=0.10.2,<0.11" in finding.remedy) is (status is Status.PROBLEM)


def test_missing_robot_files_are_named_with_their_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    def find_nothing() -> None:
        raise DescriptionError("no Go2 description in this environment")

    monkeypatch.setattr("go2_wbc.robot.description.find_description", find_nothing)
    (finding,) = doctor.judge_robot_files(">=6,<7")
    assert finding.status is Status.PROBLEM
    assert '"example-robot-data>=6,<7"' in finding.remedy


def test_a_solver_that_qpsolvers_does_not_see_is_a_problem() -> None:
    findings = doctor.judge_solvers(("daqp", "quadprog", "scs"), {"proxsuite": ">=0.8"})
    by_name = {finding.subject: finding for finding in findings}
    assert by_name["daqp"].status is Status.OK
    assert by_name["proxqp"].status is Status.PROBLEM
    assert '"proxsuite>=0.8"' in by_name["proxqp"].remedy
    assert by_name["others"].detail == "scs"


@pytest.mark.parametrize(
    ("system", "environment", "status"),
    [
        ("linux", {}, Status.NOTE),
        ("linux", {"DISPLAY": ""}, Status.NOTE),
        ("linux", {"DISPLAY": ":0"}, Status.OK),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, Status.OK),
        ("darwin", {}, Status.OK),
    ],
)
def test_a_missing_display_is_a_note_and_never_a_problem(
    system: str, environment: dict[str, str], status: Status
) -> None:
    assert doctor.judge_display(system, environment).status is status


@pytest.mark.parametrize(
    ("system", "machine", "status", "told"),
    [
        ("linux", "x86_64", Status.OK, "tested"),
        ("linux", "aarch64", Status.NOTE, "untested on Linux, aarch64"),
        ("darwin", "arm64", Status.NOTE, "untested on macOS, arm64"),
        ("win32", "AMD64", Status.PROBLEM, "work in WSL"),
    ],
)
def test_the_system_is_known(system: str, machine: str, status: Status, told: str) -> None:
    finding = doctor.judge_system(system, machine)
    assert finding.status is status
    assert told in finding.detail


@pytest.mark.parametrize(
    ("findings", "code", "verdict"),
    [
        ([HEALTHY], ExitCode.OK, "Everything that is needed is here."),
        ([HEALTHY, ILL], ExitCode.FAILED, "1 problem; the lines after -> fix them."),
        ([ILL, ILL], ExitCode.FAILED, "2 problems; the lines after -> fix them."),
    ],
)
def test_the_verdict_and_the_exit_code_follow_the_problems(
    monkeypatch: pytest.MonkeyPatch, run: Run, findings: list[Finding], code: ExitCode, verdict: str
) -> None:
    monkeypatch.setattr(doctor, "examine", lambda: findings)
    assert run("doctor", code=code).out.splitlines()[-1] == verdict


def test_json_says_the_same_and_lines_to_type_never_wrap(
    monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    monkeypatch.setattr(doctor, "examine", lambda: [HEALTHY, ILL])
    report = json.loads(run("doctor", "--json", code=ExitCode.FAILED).out)
    assert report["ok"] is False
    assert [item["status"] for item in report["findings"]] == ["ok", "problem"]
    assert report["findings"][1]["remedy"] == ILL.remedy
    line = "python -m pip install " + "x" * 90
    text = doctor.render([Finding("A", "b", Status.PROBLEM, "word " * 40, line)])
    assert f"-> {line}" in text
    assert max(len(row) for row in text.splitlines() if "->" not in row) <= 80


def test_without_the_extra_one_note_names_the_line_that_installs_it() -> None:
    (finding,) = doctor.judge_ros2(dict.fromkeys(doctor.ROS2), {})
    assert finding.status is Status.NOTE
    assert finding.remedy.endswith('pip install "go2-wbc[ros2]"')


def test_interfaces_that_are_missing_are_built_and_ros_that_is_broken_is_installed() -> None:
    versions = {**dict.fromkeys(doctor.ROS2, "1.0"), "tf2-msgs": None}
    modules = set(doctor.ROS2.values())
    probes_ = {name: ImportProbe(file=INSIDE) for name in modules}
    probes_["nav_msgs.msg"] = ImportProbe(error="no librcl")
    found = {item.subject: item for item in doctor.judge_ros2(versions, probes_)}
    assert "ros2/build_interfaces.sh" in found["tf2-msgs"].remedy
    assert "no librcl" in found["ros-nav-msgs"].detail
    assert '"go2-wbc[ros2]"' in found["ros-nav-msgs"].remedy
    others = [item for name, item in found.items() if name not in ("tf2-msgs", "ros-nav-msgs")]
    assert {item.status for item in others} == {Status.OK}
    assert not any(item.status is Status.PROBLEM for item in found.values())


def test_a_missing_extra_is_a_note_with_its_install_line() -> None:
    bounds = doctor.requirements_of("go2-wbc", "unitree")
    assert bounds == {"cyclonedds": "==11.0.1"}
    missing, old, right = (
        doctor.judge_extra("unitree", bounds, {"cyclonedds": version})
        for version in (None, "0.10.2", "11.0.1")
    )
    assert missing.status is old.status is doctor.Status.NOTE
    assert missing.remedy.endswith('-m pip install "go2-wbc[unitree]"')
    assert "unitree-sim" in missing.detail
    assert "does not fit" in old.detail
    assert right.status is doctor.Status.OK


def test_doctor_speaks_of_extras_that_there_are() -> None:
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    assert set(EXTRAS) <= set(project["optional-dependencies"])
