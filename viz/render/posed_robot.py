"""Triangles in the world: the whole robot placed by a configuration, and arrows."""

from __future__ import annotations

import itertools
from typing import final

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.legs import FOOT_NAMES
from viz.render.mesh import Surface
from viz.render.robot_meshes import RobotVisuals

_ARROW_SIDES = 12
_HEAD_SHARE = 2.4  # arrow head: its radius over the shaft's
_HEAD_LENGTH = 4.5  # arrow head: its length over the shaft's radius


@final
class PosedRobot:
    """Places the robot's surface in the world."""

    def __init__(self, visuals: RobotVisuals) -> None:
        """Gather the surfaces of each link in the frame of its joint."""
        self._model = visuals.model
        self._data = visuals.model.createData()
        self._foot_frames = [visuals.model.getFrameId(name) for name in FOOT_NAMES]
        self._links = [
            (item.parentJoint, Surface.joined(visuals.meshes[item.meshPath]).placed(item.placement))
            for item in visuals.geometry.geometryObjects
        ]

    def at(self, q: Float[np.ndarray, "19"]) -> Surface:
        """The robot's surface in the configuration ``q`` (quaternion x y z w)."""
        pin.forwardKinematics(self._model, self._data, q)
        return Surface.joined([link.placed(self._data.oMi[joint]) for joint, link in self._links])

    def feet(self, q: Float[np.ndarray, "19"]) -> Float[np.ndarray, "4 3"]:
        """Centres of the four feet in the world [m]."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._data.oMf[frame].translation for frame in self._foot_frames])

    def on_trunk(self, points: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
        """Points of the base frame in the world [m], in the configuration placed last."""
        T_world_base = self._data.oMi[1]
        return points @ T_world_base.rotation.T + T_world_base.translation


def arrow(
    start: Float[np.ndarray, "3"], length: float, radius: float, color: tuple[float, float, float]
) -> Surface:
    """An upright arrow.

    Args:
        start: its foot in the world [m].
        length: shaft and head together [m].
        radius: of the shaft [m].
        color: red, green, blue in 0..1.
    """
    head = min(_HEAD_LENGTH * radius, 0.6 * length)
    wide = _HEAD_SHARE * radius
    neck = length - head
    profile = [(0.0, 0.0), (radius, 0.0), (radius, neck), (wide, neck), (0.0, length)]
    return Surface.joined(
        [_cone_band(start, *band, color=color) for band in itertools.pairwise(profile)]
    )


def _cone_band(
    start: Float[np.ndarray, "3"],
    low: tuple[float, float],
    high: tuple[float, float],
    *,
    color: tuple[float, float, float],
) -> Surface:
    """The surface between two rings (radius, height) around the vertical through ``start``.

    Its normal is the profile's way (d_radius, d_height) after a right turn: (d_height, -d_radius).
    """
    angles = np.arange(_ARROW_SIDES) * 2 * np.pi / _ARROW_SIDES
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_ARROW_SIDES)])
    rings = [start + radius * circle + [0.0, 0.0, height] for radius, height in (low, high)]
    outward, upward = high[1] - low[1], low[0] - high[0]
    normal = (outward * circle + [0.0, 0.0, upward]) / np.hypot(outward, upward)
    a, b = np.arange(_ARROW_SIDES), (np.arange(_ARROW_SIDES) + 1) % _ARROW_SIDES
    faces = [np.column_stack([a, b, b + _ARROW_SIDES])]
    faces += [np.column_stack([a, b + _ARROW_SIDES, a + _ARROW_SIDES])]
    triangles = np.concatenate(faces)
    return Surface(
        np.concatenate(rings),
        np.tile(normal, (2, 1)),
        triangles,
        np.tile(color, (len(triangles), 1)),
    )
