"""Pictures of a robot as it is now, on its ground: for what has no recording yet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np
import pinocchio as pin
import trimesh
from jaxtyping import Float, UInt8

from go2_wbc.plant.blocks import Block
from go2_wbc.robot.description import GO2
from viz.render.camera import Camera
from viz.render.frame_renderer import ShotStyle, render
from viz.render.mesh import Surface, smooth_surface
from viz.render.robot_meshes import PosedRobot, load_robot_visuals

STYLE = ShotStyle(size=(480, 320))
_NEAR = 1.2  # [m] from the robot, within which blocks are drawn: before the camera
_BELOW = 0.1  # [m] of the base's middle, where the camera looks
_COLOR = np.array([0.55, 0.45, 0.35])  # of blocks, as in MuJoCo's window
_CREASE = np.deg2rad(30.0)


@final
class SnapshotCamera:
    """Takes pictures from aside, at a fixed distance from the robot."""

    def __init__(self, model_file: str) -> None:
        """Load the robot's meshes, of its own ``model_file`` if it has one."""
        self._robot = PosedRobot(load_robot_visuals(GO2, model_file).simplified(STYLE.detail))

    def shoot(
        self, q: Float[np.ndarray, "19"], blocks: Sequence[Block] = ()
    ) -> UInt8[np.ndarray, "h w 3"]:
        """The robot in the configuration ``q``, among the blocks around it."""
        target = q[:3] - [0.0, 0.0, _BELOW]
        near = [block for block in blocks if math.dist(block.centre[:2], q[:2]) < _NEAR]
        camera = Camera(target, STYLE.azimuth, STYLE.elevation, STYLE.distance, STYLE.size)
        surface = Surface.joined([self._robot.at(q), *map(_surface, near)])
        return render(camera, surface, samples=STYLE.samples)


def _surface(block: Block) -> Surface:
    box = trimesh.creation.box(extents=2.0 * np.array(block.half_size))
    sides = smooth_surface(np.array(box.vertices), np.array(box.faces), _COLOR, crease=_CREASE)
    turn = pin.rpy.rpyToMatrix(0.0, block.pitch, block.yaw)
    return sides.placed(pin.SE3(turn, np.array(block.centre)))
