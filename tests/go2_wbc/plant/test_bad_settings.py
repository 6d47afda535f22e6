"""Settings and robot files that make no sense are refused by errors of our own, by name."""

from collections.abc import Callable
from pathlib import Path

import pytest

from go2_wbc.errors import DescriptionError
from go2_wbc.robot.description import find_description
from tests.pages import run_python

WRONG = """
from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.sensors import SensorNoise
from go2_wbc.plant.terrain import Boxes, Patch, Ramp, Slope, Stairs
from go2_wbc.wbc.config import WbcConfig

refused = {
    "seed": lambda: MujocoPlant(seed=-1),
    "height": lambda: Boxes(height=-0.1),
    "size": lambda: Boxes(size=0.0),
    "count": lambda: Stairs(count=0),
    "angle": lambda: Slope(1.2),
    "start": lambda: Ramp(0.2, start=-1.0),
    "length": lambda: Patch(length=float("inf")),
    "position": lambda: SensorNoise(position=-1.0),
    "WbcConfig.force_weight": lambda: WbcConfig(force_weight=1e-9),
}
for name, call in refused.items():
    try:
        call()
    except ConfigError as error:
        assert name in str(error) and "got" in str(error), (name, error)
    else:
        raise SystemExit(f"{name} was accepted")
"""


def test_settings_out_of_range_or_of_another_type_are_refused_by_name(tmp_path: Path) -> None:
    # In a process of its own: under pytest the run-time type checks would refuse some first.
    done = run_python(WRONG, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def edited(old: str, new: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return edit


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (edited("FL_hip_joint", "front_left"), "lacks: joint FL_hip_joint"),
        (edited('type="revolute"', 'type="continuous"'), "must be revolute, it is continuous"),
        (edited('effort="23.7"', 'effort="0"'), "no valid effort limit"),
        (edited('effort="23.7"', 'effort="strong"'), "no valid effort limit"),
        (edited('velocity="30.1"', 'velocity="-3"'), "no valid velocity limit"),
        (edited('mass value="0.089"', 'mass value="-1"'), "no valid mass"),
        (edited('lower="-1.0472"', 'lower="1.5"'), "has no range: 1.5 to 1.0472 rad"),
    ],
)
def test_a_urdf_with_impossible_numbers_is_refused_with_the_joint_or_link(
    tmp_path: Path, edit: Callable[[str], str], message: str
) -> None:
    path = tmp_path / "odd.urdf"
    text = find_description().urdf_path.read_text(encoding="utf-8")
    path.write_text(edit(text), encoding="utf-8")
    with pytest.raises(DescriptionError, match=message):
        find_description(path)
