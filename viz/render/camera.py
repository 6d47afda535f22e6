"""A pinhole camera that looks at a point, and the floor's homography under it."""

from __future__ import annotations

from dataclasses import dataclass

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

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """World points [m] to column, row [px] and nearness [1/m].

        Points must lie in front of the camera.
        """
        scaled = (points - self.p_world_camera) @ self._M_picture_world.T
        nearness = 1 / scaled[:, 2:]
        return np.hstack([scaled[:, :2] * nearness, nearness])

    @property
    def H_floor_picture(self) -> Float[np.ndarray, "3 3"]:
        """Homography from (column, row, 1) [px] to floor (x, y, 1) [m] up to scale.

        The inverse of how floor points are projected, times the height of the eye. The third
        component is the slope of the pixel's ray: positive where it goes down to the floor,
        negative above the horizon.
        """
        eye = self.p_world_camera
        onto_floor = np.column_stack([np.eye(3)[:, :2], -eye])  # (x, y, 1) less the eye
        return eye[2] * np.linalg.inv(self._M_picture_world @ onto_floor)

    @property
    def _M_picture_world(self) -> Float[np.ndarray, "3 3"]:
        """From a point less the eye to (column, row, 1), times its distance along the view."""
        focal, (width, height) = self.focal_length, self.size
        K = np.array([[focal, 0.0, -width / 2], [0.0, -focal, -height / 2], [0.0, 0.0, -1.0]])
        return K @ self.R_camera_world
