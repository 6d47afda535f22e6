"""A made-up recording with every feature that the viewers draw: kinematics only, no physics."""

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import Leg
from go2_wbc.planning.height_map import CELL
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel

FOOT_RADIUS = find_profile().foot_radius

_LINK = 0.213  # [m] length of thigh and calf
_STEP, _PERIOD, _DUTY, _APEX = 0.16, 0.5, 0.6, 0.07  # [m], [s], -, [m]
_STAND = 0.29  # [m] from hip axis to foot centre
_WEIGHT = 157.8  # [N]
_RATE = 100.0  # [Hz]


def synthetic_recording(*, script: tuple[tuple[str, float], ...]) -> Recording:
    """``stand``, trot forward on a curve, raise the right paw, crouch, each for so many seconds."""
    robot = RobotModel()
    limits = robot.torque_limits
    ends = np.cumsum([seconds for _, seconds in script])
    time = np.arange(0.0, ends[-1], 1 / _RATE)
    which = np.minimum(np.searchsorted(ends, time, side="right"), len(script) - 1)
    labels = tuple(script[i][0] for i in which)
    into = time - np.concatenate([[0.0], ends])[which]
    walking = np.array([label == "walk" for label in labels])
    speed = np.where(walking, _STEP / (_DUTY * _PERIOD), 0.0)
    yaw = np.cumsum(np.where(walking, 0.15, 0.0)) / _RATE
    x, y = np.cumsum(speed * np.cos(yaw)) / _RATE, np.cumsum(speed * np.sin(yaw)) / _RATE
    q = np.zeros((len(time), 19))
    q[:, 0], q[:, 1], q[:, 5], q[:, 6] = x, y, np.sin(yaw / 2), np.cos(yaw / 2)
    stance = np.ones((len(time), 4), dtype=bool)
    com = np.zeros((len(time), 3))
    for k, label in enumerate(labels):
        duration = script[which[k]][1]
        q[k, 7:], stance[k] = _posture(label, into[k], duration)
        _, feet = robot.forward_kinematics(q[k])
        q[k, 2] += FOOT_RADIUS - feet[:, 2].min()
        com[k], _ = robot.forward_kinematics(q[k])
    margin = np.where(stance.sum(axis=1) < 3, np.nan, 0.05)
    forces = np.where(stance, _WEIGHT / stance.sum(axis=1, keepdims=True), 0.0)
    forces *= 1 + 0.15 * np.sin(40 * time)[:, None]
    wave = np.sin(2 * np.pi * time / _PERIOD)[:, None]
    tau = 0.25 * limits * (1 + 0.8 * walking[:, None] * wave)
    v = np.zeros((len(time), 18))
    v[:, 0] = speed
    return Recording(time + 1.0, q, v, tau, forces, stance, com, margin, labels)


def step_ahead(height: float, at: float) -> Float[np.ndarray, "n 3"]:
    """Ground that has been seen, 2 m long and 1.2 m wide: a step of this height [m] at x [m]."""
    x, y = np.meshgrid(CELL * (np.arange(-20, 60) + 0.5), CELL * (np.arange(-24, 24) + 0.5))
    return np.column_stack([x.ravel(), y.ravel(), np.where(x.ravel() > at, height, 0.0)])


def _posture(label: str, t: float, duration: float) -> tuple[Float[np.ndarray, "12"], np.ndarray]:
    joints, stance = np.zeros(12), np.ones(4, dtype=bool)
    ramp = float(np.clip(min(t, duration - t) / 0.8, 0, 1))
    ease = ramp * ramp * (3 - 2 * ramp)
    for leg in Leg:
        forward, height = 0.0, _STAND
        if label == "walk":
            offset = 0.0 if leg in (Leg.FL, Leg.RR) else 0.5
            phase = (t / _PERIOD + offset) % 1.0
            if phase < _DUTY:
                forward = _STEP * (0.5 - phase / _DUTY)
            else:
                swing = (phase - _DUTY) / (1 - _DUTY)
                forward = _STEP * (swing - 0.5)
                height -= _APEX * np.sin(np.pi * swing)
                stance[leg] = False
        if label == "sit":
            height -= 0.12 * ease
        joints[leg.joints] = _leg_angles(forward, height)
    if label == "high_five":
        raised = np.array([0.0, -0.9, -1.0])
        standing = joints[Leg.FR.joints]
        joints[Leg.FR.joints] = standing + ease * (raised - standing)
        stance[Leg.FR] = ease == 0.0
    return joints, stance


def _leg_angles(forward: float, height: float) -> Float[np.ndarray, "3"]:
    bend = np.arccos(np.hypot(forward, height) / (2 * _LINK))
    return np.array([0.0, np.arctan2(-forward, height) + bend, -2 * bend])
