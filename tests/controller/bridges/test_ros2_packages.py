"""The course's own package builds in a colcon workspace, and its commands and tests run."""

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.controller.bridges.ros2_graph import IS_REQUIRED, ROOT, needs_ros2

HAS_COLCON = importlib.util.find_spec("colcon_core") is not None
pytestmark = [
    needs_ros2,
    pytest.mark.skipif(
        not HAS_COLCON and not IS_REQUIRED, reason="colcon is not here: run `make test-ros2`"
    ),
]

Done = subprocess.CompletedProcess[str]
PACKAGE = "go2_high_five"


def run(command: list[str], folder: Path) -> Done:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=180.0,
        check=False,
    )


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("go_sim")
    shutil.copytree(ROOT / "ros2" / PACKAGE, folder / "src" / PACKAGE)
    built = run(["colcon", "build", "--packages-select", PACKAGE, "--symlink-install"], folder)
    assert built.returncode == 0, built.stdout
    return folder


def sourced(line: str) -> list[str]:
    return ["bash", "-c", f"source install/setup.bash && {line}"]


def test_the_workspace_finds_the_package_and_its_class(workspace: Path) -> None:
    code = "from go2_high_five.controller import GO2Controller as C; print(C.__mro__[1].__name__)"
    done = run(sourced(f"python -c '{code}'"), workspace)
    assert done.stdout.strip() == "GO2ControllerNode"
    assert (workspace / f"install/{PACKAGE}/share/ament_index/resource_index/packages").is_dir()


def test_the_tests_that_patch_two_methods_pass_without_a_robot(workspace: Path) -> None:
    done = run(sourced(f"python -m pytest -q -p no:cacheprovider src/{PACKAGE}/test"), workspace)
    assert done.returncode == 0, done.stdout
    assert "5 passed" in done.stdout


def test_the_installed_executable_runs_the_demo(
    workspace: Path, paced: Callable[[Callable[[], Done]], Done]
) -> None:
    line = sourced(f"install/{PACKAGE}/lib/{PACKAGE}/high_five_demo")
    done = paced(lambda: run(line, workspace))
    assert done.returncode == 0, done.stdout
    assert "5 of 5 behaviours done" in done.stdout
