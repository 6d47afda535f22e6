"""The scene of a page: one trunk that moves, and twelve joints below it in the order of q."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from go2_wbc.legs import JOINT_NAMES
from viz.render.robot_meshes import load_robot_visuals
from viz.replay.meshcat_scene import robot_scene
from viz.replay.packing import Pack


def test_the_page_can_move_the_trunk_and_every_joint_about_its_axis() -> None:
    visuals = load_robot_visuals()
    scene: Any = robot_scene(visuals, Pack())
    assert len(scene["joints"]) == len(JOINT_NAMES)
    for name, joint in zip(JOINT_NAMES, scene["joints"], strict=True):
        above, _, last = joint["path"].removesuffix("/turn").rpartition("/")
        assert last == name
        assert above.startswith(scene["base"])
        assert joint["axis"] == pytest.approx([1, 0, 0] if "hip" in name else [0, 1, 0])
    assert scene["meshes"] == sum(len(parts) for parts in visuals.meshes.values())


def test_every_joint_is_placed_where_the_robot_has_it() -> None:
    visuals = load_robot_visuals()
    scene: Any = robot_scene(visuals, Pack())
    placed = {
        command["path"]: np.reshape(command["matrix"], (4, 4), order="F")
        for command in scene["commands"]
        if command["type"] == "set_transform"
    }
    for joint in scene["joints"]:
        path = joint["path"].removesuffix("/turn")
        (found,) = [matrix for place, matrix in placed.items() if place.endswith(path)]
        index = visuals.model.getJointId(path.rpartition("/")[2])
        expected = visuals.model.jointPlacements[index].homogeneous
        np.testing.assert_allclose(found, expected, atol=1e-6)
