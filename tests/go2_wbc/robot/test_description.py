"""The description finds the Go2's real files and refuses what is not a Go2."""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import trimesh

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.robot.description import find_description, parse_disabled_pairs, read_mesh

# Unitree Go2 specification: hip, thigh, calf.
EFFORTS = (23.7, 23.7, 45.43) * 4
SPEEDS = (30.1, 30.1, 15.7) * 4
SRDF_PAIRS = 14


def installed_urdf() -> str:
    return find_description().urdf_path.read_text(encoding="utf-8")


def written(tmp_path: Path, text: str, name: str = "my_go2.urdf") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_installed_description_has_real_files_limits_and_adjacent_links() -> None:
    found = find_description()
    assert found.urdf_path.is_file()
    assert found.srdf_path is not None
    assert found.srdf_path.is_file()
    assert found.efforts == EFFORTS
    assert found.speeds == SPEEDS
    pairs = find_description().disabled_pairs
    assert len(pairs) == SRDF_PAIRS
    assert ("base", "FL_thigh") in pairs


def test_every_mesh_of_the_urdf_resolves_to_a_file_and_a_missing_one_is_named(
    tmp_path: Path,
) -> None:
    found = find_description()
    names = {mesh.get("filename", "") for mesh in ET.fromstring(installed_urdf()).iter("mesh")}
    assert len(names) > 10
    assert all(found.mesh_path(name).is_file() for name in names)
    with pytest.raises(DescriptionError, match=r"nowhere\.stl.*tried /"):
        find_description().mesh_path("package://go2/nowhere.stl")
    with pytest.raises(DescriptionError, match=r"nowhere\.dae"):
        read_mesh(tmp_path / "nowhere.dae")


def test_without_the_wheel_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    with pytest.raises(DescriptionError, match="pip install example-robot-data"):
        find_description()


def test_a_users_urdf_is_taken_with_the_installed_srdf_or_its_own(tmp_path: Path) -> None:
    path = written(tmp_path, installed_urdf().replace("45.43", "40.0"))
    found = find_description(path)
    assert found.urdf_path == path
    assert found.efforts == (23.7, 23.7, 40.0) * 4
    assert len(found.disabled_pairs) == SRDF_PAIRS
    mesh = "package://example-robot-data/robots/go2_description/collisions/base_convex.stl"
    assert found.mesh_path(mesh).is_file()
    path = written(tmp_path, installed_urdf())
    pair = '<disable_collisions link1="FL_foot" link2="FR_foot"/>'
    written(tmp_path, f"<robot name='x'>{pair}</robot>", "my_go2.srdf")
    assert find_description(path).disabled_pairs == (("FL_foot", "FR_foot"),)


def test_a_missing_or_broken_file_and_a_joint_without_effort_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"nothing\.urdf: No such file"):
        find_description(tmp_path / "nothing.urdf")
    with pytest.raises(DescriptionError, match="not a valid SRDF"):
        parse_disabled_pairs(written(tmp_path, "<robot", "broken.srdf"))
    text = installed_urdf().replace('effort="45.43"', "", 1)
    with pytest.raises(DescriptionError, match="FL_calf_joint has no valid effort limit"):
        find_description(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<robot name='x'>", "not a valid URDF"),
        ("<sdf/>", "its root is <sdf>"),
        ("", "not a valid"),
    ],
)
def test_a_broken_urdf_is_refused_with_the_reason(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(DescriptionError, match=reason):
        find_description(written(tmp_path, text))


def test_another_robot_is_refused_with_every_name_that_it_lacks(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        find_description(written(tmp_path, "<robot name='other'><link name='base'/></robot>"))
    assert all(name in str(caught.value) for name in (*JOINT_NAMES, *FOOT_NAMES))
    text = installed_urdf().replace('"RR_calf_joint"', '"rr_knee"')
    with pytest.raises(DescriptionError) as caught:
        find_description(written(tmp_path, text))
    assert "joint RR_calf_joint" in str(caught.value)
    assert "FL_hip_joint" not in str(caught.value)


def test_colours_come_from_materials_and_grey_is_the_rest(tmp_path: Path) -> None:
    name = "package://example-robot-data/robots/go2_description/visuals/foot.dae"
    (part,) = read_mesh(find_description().mesh_path(name))
    assert part.rgba == (0.0, 0.0, 0.0, 1.0)
    assert part.triangles.max() == len(part.points) - 1
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "box.stl")
    (part,) = read_mesh(tmp_path / "box.stl")
    assert len(part.triangles) == 12
    assert part.rgba == pytest.approx((0.67, 0.69, 0.77, 1.0), abs=0.01)
