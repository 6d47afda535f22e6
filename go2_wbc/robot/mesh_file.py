"""Reads the mesh files that the URDF shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from go2_wbc.errors import DescriptionError
from go2_wbc.records import ArrayNx3

_UNPAINTED = (171, 177, 197, 255)  # a part without a material gets the trunk's grey


@dataclass(frozen=True, slots=True)
class MeshPart:
    """All faces of a mesh file that have one colour.

    Attributes:
        points: (n, 3) vertices [m] in the frame of the file.
        triangles: (m, 3) rows of ``points``.
        rgba: red, green, blue, opacity in 0..1.
    """

    points: ArrayNx3
    triangles: Int[np.ndarray, "m 3"]
    rgba: tuple[float, ...]


def read_mesh(path: Path) -> tuple[MeshPart, ...]:
    """The parts of a mesh file, COLLADA or another, one for each colour.

    Raises:
        DescriptionError: if the file cannot be read or holds no triangles.
    """
    import trimesh  # takes long, and is needed only where somebody looks at the robot
    from trimesh.visual import TextureVisuals

    try:
        scene: Any = trimesh.load_scene(path)
    except (OSError, ValueError) as error:
        raise DescriptionError(f"cannot read the mesh {path}: {error}") from error
    parts = []
    for mesh in scene.dump():
        is_painted = isinstance(mesh.visual, TextureVisuals)
        color = mesh.visual.material.main_color if is_painted else _UNPAINTED
        rgba = tuple(float(value) / 255.0 for value in color)
        if len(mesh.faces):
            parts.append(MeshPart(np.array(mesh.vertices), np.array(mesh.faces), rgba))
    if not parts:
        raise DescriptionError(f"the mesh {path} holds no triangles")
    return tuple(parts)
