"""Without the extra the bridge says what is missing, and everything else goes on."""

import subprocess

import pytest

import controller.bridges.ros2 as bridge
from controller.cli.common import ExitCode
from controller.go2_controller import GO2Controller
from tests.controller.plants import StillPlant, is_limp
from tests.script_server import python

HIDDEN = "for name in ('rclpy', 'cyclonedds.core'): sys.modules[name] = None"


def without_extras(code: str) -> subprocess.CompletedProcess[str]:
    """Run ``code`` in a fresh Python in which there is no rclpy and no CycloneDDS."""
    return python("-c", f"import sys\n{HIDDEN}\n{code}")


DRIVE = "unitree-drive --interface lo --domain 1 --i-have-the-remote-in-hand"


@pytest.mark.parametrize(
    ("command", "extra"),
    [("ros2", "ros2"), ("demo --ros2", "ros2"), ("unitree-sim", "unitree"), (DRIVE, "unitree")],
)
def test_without_the_extra_a_command_says_in_a_line_what_installs_it(
    command: str, extra: str
) -> None:
    run = without_extras(f"import controller.cli.main as m; sys.exit(m.main({command.split()}))")
    assert run.returncode == ExitCode.RUNTIME
    (line,) = run.stderr.splitlines()
    assert line.startswith("go2-wbc: ")
    assert line.endswith(f'python -m pip install "go2-wbc[{extra}]"')


def test_without_the_extra_the_client_is_an_error_of_ours() -> None:
    run = without_extras("import controller.bridges.ros2 as bridge; bridge.GO2ControllerNode")
    assert "MissingDependency: ROS 2 is not here" in run.stderr.splitlines()[-1]


def test_a_name_that_the_bridge_does_not_have_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nothing"):
        _ = bridge.nothing


def test_importing_the_bridge_imports_no_ros() -> None:
    code = "import sys, controller.bridges.ros2; sys.exit('rclpy' in sys.modules)"
    assert python("-c", code).returncode == 0


def test_what_follows_every_tick_may_make_the_robot_limp_and_follows_nothing_else() -> None:
    plant, turns = StillPlant(), []

    def turn() -> None:
        turns.append(len(plant.commands))
        go2.damp()

    with GO2Controller(plant=plant, after_tick=turn) as go2:
        before = len(plant.commands)
        go2.wait(3 * plant.control_period)
    assert turns == [before + 1, before + 3, before + 5]
    assert all(map(is_limp, plant.commands))
