"""A pinhole camera that looks at a point, and the floor's homography under it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the picture is taken from.

    Attributes:
        p_world_target: point in the middle of the picture [m].
        azimuth: direction of the camera seen from the target, about world z [rad].
        elevation: angle of the camera above the floor [rad].
        distance: from target to camera [m].
        size: width and height of the picture [px].
        field_of_view: vertical opening angle [rad].
    """

    p_world_target: Float[np.ndarray, "3"]
    azimuth: float
    elevation: float
    distance: float
    size: tuple[int, int]
    field_of_view: float = 0.5

    @property
    def R_camera_world(self) -> Float[np.ndarray, "3 3"]:
        """Rows: the picture's right, the picture's up, and the way back to the camera."""
        ca, sa = np.cos(self.azimuth), np.sin(self.azimuth)
        ce, se = np.cos(self.elevation), np.sin(self.elevation)
        return np.array([[-sa, ca, 0.0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]])

    @property
    def p_world_camera(self) -> Float[np.ndarray, "3"]:
        """The eye [m]."""
        return self.p_world_target + self.distance * self.R_camera_world[2]

    @property
    def focal_length(self) -> float:
        """Pixels per unit of slope."""
        return self.size[1] / 2 / np.tan(self.field_of_view / 2)

    def scaled(self, factor: int) -> Camera:
        """The same view on a picture ``factor`` times as large."""
        return replace(self, size=(self.size[0] * factor, self.size[1] * factor))

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """World points [m] to column, row [px] and nearness [1/m].

        Points must lie in front of the camera.
        """
        seen = (points - self.p_world_camera) @ self.R_camera_world.T
        nearness = -1.0 / seen[:, 2]
        focal = self.focal_length
        return np.column_stack(
            [
                self.size[0] / 2 + focal * seen[:, 0] * nearness,
                self.size[1] / 2 - focal * seen[:, 1] * nearness,
                nearness,
            ]
        )

    @property
    def H_floor_picture(self) -> Float[np.ndarray, "3 3"]:
        """Homography from (column, row, 1) [px] to floor (x, y, 1) [m] up to scale.

        The ray of a pixel is d = M (column, row, 1), here ``ray`` @ it, and the eye e + s d meets
        the floor z = 0 at s = -e_z / d_z: x = e_x - e_z d_x / d_z, so that x (-d_z) = e_z d_x -
        e_x d_z, and likewise y. The third component, -d_z, is positive where the pixel shows the
        floor, negative above the horizon.
        """
        focal = self.focal_length
        right, up, back = self.R_camera_world
        ray = np.column_stack(
            [
                right / focal,
                -up / focal,
                -back - right * self.size[0] / 2 / focal + up * self.size[1] / 2 / focal,
            ]
        )
        eye = self.p_world_camera
        return np.vstack(
            [-eye[0] * ray[2] + eye[2] * ray[0], -eye[1] * ray[2] + eye[2] * ray[1], -ray[2]]
        )
