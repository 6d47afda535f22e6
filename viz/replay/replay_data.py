"""Reduces a recording to what a replay page shows: even steps, extremes kept."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_description
from viz.content import MarginCurve
from viz.render.framing import smoothed
from viz.render.posed_robot import PosedRobot

_FRAME_RATE = 50.0  # [Hz] finer is not seen at 60 Hz screens, swings stay smooth
_MOST_FRAMES = 6000  # keeps the page of a long recording small; the rate drops instead
_MOST_MARGINS = 3000  # samples of a margin curve; the least of each step is kept
_CAMERA_SMOOTHING = 0.7  # [s]


@dataclass(frozen=True, slots=True)
class ReplayFrames:
    """A recording at even steps.

    Curves keep the extreme of each step, so that a short peak is not lost.

    Attributes:
        rate: frames per second.
        q: (n, 19) configuration, neighbouring quaternions in the same half-space.
        p_world_feet: (n, 12) foot centres FL FR RL RR [m].
        p_world_com: (n, 3) [m].
        p_world_camera_target: (n, 2) smoothed ground position of the base [m].
        foot_forces: (n, 4) largest in the step [N].
        stance: (n, 4) planned contacts.
        support_margin: (n,) least in the step [m], nan where undefined.
        torque_ratio: (n,) largest |torque| / limit of any joint in the step.
    """

    rate: float
    q: Float[np.ndarray, "n 19"]
    p_world_feet: Float[np.ndarray, "n 12"]
    p_world_com: Float[np.ndarray, "n 3"]
    p_world_camera_target: Float[np.ndarray, "n 2"]
    foot_forces: Float[np.ndarray, "n 4"]
    stance: Bool[np.ndarray, "n 4"]
    support_margin: Float[np.ndarray, " n"]
    torque_ratio: Float[np.ndarray, " n"]


def replay_frames(recording: Recording, robot: PosedRobot) -> ReplayFrames:
    """Resample a recording for the page.

    Args:
        recording: at any, also uneven, rate.
        robot: gives the positions of the feet.
    """
    rate = min(_FRAME_RATE, (_MOST_FRAMES - 1) / recording.duration)
    count = max(2, int(np.floor(recording.duration * rate)) + 1)
    rate = (count - 1) / recording.duration
    wanted = recording.time[0] + np.arange(count) / rate
    last = len(recording.time) - 1
    rows = np.minimum(np.searchsorted(recording.time, wanted - 0.25 / rate), last)
    rows[-1] = last
    q = _continuous(recording.q[rows])
    limits = np.array(find_description().efforts)
    ratio = np.max(np.abs(recording.tau) / limits, axis=1)
    base = smoothed(recording.time, recording.q[:, :2], _CAMERA_SMOOTHING)
    return ReplayFrames(
        rate=rate,
        q=q,
        p_world_feet=np.array([robot.feet(row).ravel() for row in q]),
        p_world_com=recording.p_world_com[rows],
        p_world_camera_target=base[rows],
        foot_forces=np.maximum.reduceat(recording.foot_forces, rows),
        stance=recording.stance[rows],
        support_margin=np.fmin.reduceat(recording.support_margin, rows),
        torque_ratio=np.maximum.reduceat(ratio, rows),
    )


def reduced(curve: MarginCurve) -> MarginCurve:
    """The curve with at most ``_MOST_MARGINS`` samples: the least of each step."""
    step = -(-len(curve.time) // _MOST_MARGINS)
    if step <= 1:
        return curve
    known = np.where(np.isnan(curve.margin), np.inf, curve.margin)
    edges = range(0, len(known), step)
    rows = np.array([start + int(known[start : start + step].argmin()) for start in edges])
    return replace(curve, time=curve.time[rows], margin=curve.margin[rows], worst=curve.worst[rows])


def _continuous(q: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 19"]:
    """Flip quaternions so that neighbours never differ by the sign alone."""
    flips = np.sum(q[1:, 3:7] * q[:-1, 3:7], axis=1) < 0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    result = q.copy()
    result[:, 3:7] *= signs[:, None]
    return result
