"""Where a camera should look so that the whole robot stays in the picture."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d

from go2_wbc.recording import Recording
from viz.render.robot_meshes import PosedRobot

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
    middles = [_middle(recording.q[row], robot) for row in nearest_rows(recording, times)]
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


def _middle(q: Float[np.ndarray, "19"], robot: PosedRobot) -> Float[np.ndarray, "3"]:
    """Middle of the box around feet, nose and tail, from the floor to the highest of them."""
    points = np.vstack([robot.feet(q), robot.on_trunk(_TRUNK_ENDS)])
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2] / 2 + _HEADROOM])
