"""Mesh files: every colour one part; files that cannot be shown are named."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from go2_wbc.errors import DescriptionError
from go2_wbc.robot.description import find_description
from go2_wbc.robot.mesh_file import read_mesh


def test_the_feet_are_one_black_part() -> None:
    name = "package://example-robot-data/robots/go2_description/visuals/foot.dae"
    (part,) = read_mesh(find_description().mesh_path(name))
    assert part.rgba == (0.0, 0.0, 0.0, 1.0)
    assert part.triangles.max() == len(part.points) - 1


def test_a_mesh_without_a_material_is_grey(tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "box.stl")
    (part,) = read_mesh(tmp_path / "box.stl")
    assert len(part.triangles) == 12
    assert part.rgba == pytest.approx((0.67, 0.69, 0.77, 1.0), abs=0.01)


def test_a_missing_mesh_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"nowhere\.dae"):
        read_mesh(tmp_path / "nowhere.dae")
