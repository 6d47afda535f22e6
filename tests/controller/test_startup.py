"""A robot is there at once: what it does not need yet is not imported."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import sys
from controller import GO2Controller

with GO2Controller() as go2:
    assert go2.stand()
print(*sys.modules)
"""
LATER = {
    "scipy.interpolate": "a motion is compiled",
    "scipy.linalg": "a kernel is compiled",
    "qpsolvers": "another solver than active_set is asked for",
    "placo": "a motion is balanced",
    "trimesh": "the robot is drawn",
    "matplotlib": "a margin is drawn",
    "glfw": "a window is opened",
    "meshcat": "a page is shown",
    "proxsuite": "it is asked for",
}
"""Libraries that take long, by what they wait for."""


def test_a_robot_stands_without_the_libraries_of_authoring_and_drawing() -> None:
    root = str(Path(__file__).resolve().parents[2])
    environment = {**os.environ, "PYTHONPATH": root}
    command = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    loaded = done.stdout.split()
    assert "go2_wbc.wbc.condensed" in loaded
    assert not LATER.keys() & set(loaded)
