"""A pinhole camera: where it should look, and the floor's homography under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d

from go2_wbc.recording import Recording
from viz.render.robot_meshes import PosedRobot


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the picture is taken from."""

    p_world_target: Float[np.ndarray, "3"]  #: point in the middle of the picture [m]
    azimuth: float  #: direction of the camera seen from the target, about world z [rad]
    elevation: float  #: angle of the camera above the floor [rad]
    distance: float  #: from target to camera [m]
    size: tuple[int, int]  #: width and height of the picture [px]
    field_of_view: float = 0.5  #: vertical opening angle [rad]

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


_STEP = 0.08  # [s] between the poses that are looked at; the camera is slower than that
_TRUNK_ENDS = np.array([[0.33, 0.0, 0.08], [-0.25, 0.0, 0.08]])  # [m] nose and tail, base frame
_STEPS_PER_DEVIATION = 8  # of the even grid on which paths are smoothed
_HEADROOM = 0.04  # [m] the middle of the picture lies this much above the middle of the robot


def nearest_rows(recording: Recording, times: Float[np.ndarray, " k"]) -> Int[np.ndarray, " k"]:
    """Rows of the samples nearest to ``times`` [s] after the start."""
    wanted = recording.time[0] + times
    after = np.clip(np.searchsorted(recording.time, wanted), 1, len(recording.time) - 1)
    before = after - 1
    is_before = wanted - recording.time[before] < recording.time[after] - wanted
    return np.where(is_before, before, after)


def camera_path(
    recording: Recording, robot: PosedRobot, *, smoothing: float
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, "k 3"]]:
    """Times [s] after the start, and the point to look at [m], calm and without delay.

    ``robot`` says where the feet are; ``smoothing`` is the filter's standard deviation [s].
    """
    times = np.arange(0.0, recording.duration + _STEP, _STEP)
    rows, is_level = nearest_rows(recording, times), len(recording.ground) == 0
    middles = [_middle(recording.q[row], robot, is_level=is_level) for row in rows]
    return times, smoothed(times, np.array(middles), smoothing)


def heading_path(recording: Recording, *, smoothing: float) -> Float[np.ndarray, " n"]:
    """Calm heading [rad] of the trunk at each sample, continuous over full turns."""
    x, y, z, w = recording.q[:, 3:7].T
    yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return smoothed(recording.time, yaw[:, None], smoothing)[:, 0]


def smoothed(
    time: Float[np.ndarray, " n"], values: Float[np.ndarray, "n k"], deviation: float
) -> Float[np.ndarray, "n k"]:
    """Gaussian low-pass, without delay, of samples that may be uneven; the ends are held.

    ``deviation`` is the filter's standard deviation, in the unit of the increasing ``time``.
    """
    step = deviation / _STEPS_PER_DEVIATION
    grid = np.arange(time[0] - deviation, time[-1] + deviation + step, step)
    even = np.column_stack([np.interp(grid, time, column) for column in values.T])
    calm = gaussian_filter1d(even, _STEPS_PER_DEVIATION, axis=0, mode="nearest")
    return np.column_stack([np.interp(time, grid, column) for column in calm.T])


def _middle(
    q: Float[np.ndarray, "19"], robot: PosedRobot, *, is_level: bool
) -> Float[np.ndarray, "3"]:
    """Middle of the box around feet, nose and tail; on a level floor it begins there."""
    points = np.vstack([robot.feet(q), robot.on_trunk(_TRUNK_ENDS)])
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = 0.0 if is_level else low[2]
    return (low + high) / 2 + [0.0, 0.0, _HEADROOM]
