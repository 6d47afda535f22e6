"""Every example runs, prints its point, says nothing bad, and fails aloud when the point fails."""

import ast
import importlib.util
import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.pages import USERS_BIN, as_user
from tests.script_server import run_script

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "examples"
SCRIPTS = sorted(FOLDER.glob("*.py"))
LEAST, MOST = 10, 60  #: Lines of an example
FEWEST = 24
NEEDS = {
    "19_log_to_a_data_frame": "pandas",
    "24_motion_in_pytest": "pytest",
    "29_ros2_student_class": "rclpy",
    "30_sport_client": "cyclonedds",
    "33_learn_with_gymnasium": "gymnasium",
    "34_clone_the_trot": "onnxruntime",
}
"""What an example needs beside the project."""
BEHIND = re.compile(r"^(WARNING: )?the loop is \d+ ms behind the wall clock$")
"""What a busy machine makes of an example that runs in real time."""
POINTS = {
    "01_stand_and_high_five": ("high five: True, with the paw held 0.6", "sat down: True"),
    "02_walk_and_turn": ("corner 4:", r"back at the start to within \d+ mm"),
    "03_velocity_and_state": (r"speed: 0\.(39|40)", r"turning: 0\.(29|30|31)"),
    "04_honest_outcomes": (r"high five: False.* fell at t=", "refused", "recovered: True"),
    "05_first_motion": ("played: True", r"nose went down by 1\d\.\d deg"),
    "06_check_and_report": ("no   bow of 30 deg", r"FL calf at 0\.80 s", "the robot can do it"),
    "07_library_motion_with_parameters": ("refused: times must be 1 to 8, got 99", "paw: True"),
    "08_sequence_and_mirror_to_a_tempo": ("ok   dance", r"danced 7\.7 s: True"),
    "09_push_and_recovery": (r"largest tilt \d+\.\d deg", "still walking"),
    "10_payload_and_friction": (r"3\.0 kg +0\.4 +True +True",),
    "11_terrain_of_boxes": ("293 boxes", r"walked to x = 2\.\d+ m"),
    "12_noisy_sensors": (r"ideal: true speed 0\.50", r"harsh: .*gyro noise 0\.05"),
    "13_my_own_mjcf": ("12 motors", "walked 1.6 m: True", r"feet are 3\.\d cm higher"),
    "14_my_own_gait": (r"trot +0\.\d+ m/s", r"quick trot +0\.", r"grounded trot .*60% of the time"),
    "15_my_own_wbc_task": (r"asked 0 N: measured -?[0-7]\.", r"asked 40 N: measured (3|4)\d\."),
    "16_back_ends_agree": (r"condensed .* within \d\.\de-", r"placo .* within \d\.\de-"),
    "17_residuals_and_forces": (r"weight 157\.8 N", "base dynamics", "found no solution"),
    "18_my_own_plant": (r" 90% of the torque: stands True", r" 40% of the torque: stands False"),
    "19_log_to_a_data_frame": (r"walk +\d+ +0\.\d+", r"\d+ rows, 19 columns"),
    "20_compare_two_gains": (r" 15 +\d+\.\d mm +35\.4 mm", r"120 +\d+\.\d mm"),
    "21_batch_of_seeds": (r"6 of 6 done in \d+ processes",),
    "22_margins_and_offline_page": ("joint position", r"wave\.html: \d+ kB", r"wave\.svg: \d+ kB"),
    "23_animation_and_filmstrip": (r"run\.webp: \d\d pictures", r"run\.png: three moments"),
    "24_motion_in_pytest": ("::greet PASSED", "5 passed"),
    "25_realtime": (r"\d\.\d\d s for the robot, which walked 0\.",),
    "26_cancel_from_another_thread": (
        "play.. returned False: high_five was cancelled",
        "one: True",
    ),
    "27_export_for_a_robot": ("rows of 37 columns", "first motor FR_hip"),
    "28_configuration_by_toml": ("back end full", r"walks 0\.2\d+ m high", "unknown key 'fricton'"),
    "29_ros2_student_class": ("up: True", "walk: True", "high_five: True", "sit: True"),
    "30_sport_client": ("version: 1", "'STAND_UP': 0, 'BALANCE_STAND': 0"),
    "31_walk_with_my_own_task": (r"0 tasks .* 0\.1\d\d rad/s", r"1 tasks .* rad/s, [345]\d%"),
    "34_clone_the_trot": (
        "round 3: the teacher .* 30%",
        r"the network walks at 0\.[45]\d m/s",
        "walks on: walking",
    ),
    "33_learn_with_gymnasium": (
        r"26:38 +joint_velocities \[rad/s\]",
        r"random: 0\.\d s, .* by fall",
        r"standing: 20\.0 s",
    ),
    "32_stairs_by_sight": ("at first: <SeenTerrain", r"climbed (4[5-9]|5[01]) cm"),
    "35_why_this_torque": ("standing: no limit binds", "a weak calf: torque", "contradicts the"),
}
"""What must be read in the output of each: regular expressions."""
DEAD_MOTORS = """
import dataclasses, runpy, sys
from go2_wbc.plant import MujocoPlant
write = MujocoPlant.write
MujocoPlant.write = lambda self, c: write(self, dataclasses.replace(c, tau=0 * c.tau, kp=0 * c.kp))
runpy.run_path(sys.argv[1], run_name="__main__")
"""
BLIND_CHECK = """
import runpy, sys
from motions import FeasibilityReport
FeasibilityReport.failures = ()
runpy.run_path(sys.argv[1], run_name="__main__")
"""
WITHOUT = """
import runpy, sys
sys.modules[sys.argv[2]] = None
runpy.run_path(sys.argv[1], run_name="__main__")
"""


def name_of(script: Path) -> str:
    return script.stem


def run(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run this Python in ``folder`` on the packages of this checkout, or a user's."""
    if USERS_BIN:
        return as_user([f"{USERS_BIN}/python", *arguments], folder)
    return run_script(arguments, folder, {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100"})


def must_run(script: Path) -> bool:
    """Whether what the example needs is here, or has to be."""
    module = NEEDS.get(script.stem, "sys")
    if USERS_BIN:
        return as_user([f"{USERS_BIN}/python", "-c", f"import {module}"], ROOT).returncode == 0
    demanded = {"rclpy": "GO2_WBC_REQUIRE_ROS2", "cyclonedds": "GO2_WBC_REQUIRE_UNITREE"}
    is_here = importlib.util.find_spec(module) is not None
    return is_here or demanded.get(module, "") in os.environ


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=name_of)
def test_an_example_runs_and_prints_its_point(script: Path, tmp_path: Path) -> None:
    if not must_run(script):
        if USERS_BIN:
            said = run([str(script)], tmp_path).stdout
            assert re.search(r"python -m pip install|docs/ros2\.md", said)
        pytest.skip(f"{NEEDS[script.stem]} is not installed")
    done = run([str(script)], tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    missing = [point for point in POINTS[script.stem] if not re.search(point, done.stdout)]
    assert missing == [], done.stdout
    if script.stem not in ("29_ros2_student_class", "30_sport_client"):  # another program's words
        bad = [line for line in done.stderr.splitlines() if not BEHIND.match(line)]
        assert bad == []
    assert "Traceback" not in done.stderr
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert all(path.is_relative_to(tmp_path / "out/examples") for path in written), written


@pytest.mark.parametrize("script", [s for s in SCRIPTS if s.stem in NEEDS], ids=name_of)
def test_without_what_it_needs_an_example_says_so_and_ends_well(
    script: Path, tmp_path: Path
) -> None:
    done = run(["-c", WITHOUT, str(script), NEEDS[script.stem]], tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("this example needs")


@pytest.mark.slow
@pytest.mark.parametrize("number", ["01", "15"])
def test_an_example_fails_when_the_robot_has_no_strength(number: str, tmp_path: Path) -> None:
    (script,) = FOLDER.glob(f"{number}_*.py")
    done = run(["-c", DEAD_MOTORS, str(script)], tmp_path)
    assert done.returncode != 0, done.stdout


def test_an_example_fails_when_the_check_sees_nothing(tmp_path: Path) -> None:
    done = run(["-c", BLIND_CHECK, str(FOLDER / "06_check_and_report.py")], tmp_path)
    assert done.returncode != 0, done.stdout


def test_the_numbers_have_no_gap_and_every_point_is_tested() -> None:
    assert len(SCRIPTS) >= FEWEST
    assert [script.name[:3] for script in SCRIPTS] == [
        f"{number:02}_" for number in range(1, len(SCRIPTS) + 1)
    ]
    assert sorted(POINTS) == [script.stem for script in SCRIPTS]


@pytest.mark.parametrize("script", SCRIPTS, ids=name_of)
def test_an_example_is_short_and_says_what_it_teaches(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert LEAST <= len(text.splitlines()) <= MOST
    teaches = ast.get_docstring(ast.parse(text)) or ""
    assert re.match(r"[A-Z].{30,}[.?]$", teaches.splitlines()[0]), teaches
    need = NEEDS.get(script.stem)
    assert ("Needs" in teaches) == (need is not None)


@pytest.mark.parametrize("script", SCRIPTS, ids=name_of)
def test_an_example_can_fail_and_uses_public_names(script: Path) -> None:
    tree = ast.parse(script.read_text(encoding="utf-8"))
    assert any(
        isinstance(node, ast.If | ast.IfExp | ast.Raise | ast.Expr)
        and re.search(r"SystemExit\((?!0\))|sys\.exit\(", ast.unparse(node))
        for node in ast.walk(tree)
    )
    private = [
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and node.attr.startswith("_")
        and ast.unparse(node.value) not in ("self", "super()")
        and not node.attr.startswith("__")
    ]
    imported = [
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom | ast.Import)
        for alias in node.names
    ]
    assert [name for name in [*private, *imported] if name.startswith("_")] == []


def test_the_list_of_examples_is_true() -> None:
    listed = re.findall(
        r"^\| \[([^]]+)\]\(([^)]+)\) \| (.+) \|$",
        (FOLDER / "README.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    docstrings = [ast.get_docstring(ast.parse(script.read_text())) or "" for script in SCRIPTS]
    assert listed == [
        (script.name, script.name, text.splitlines()[0])
        for script, text in zip(SCRIPTS, docstrings, strict=True)
    ]
