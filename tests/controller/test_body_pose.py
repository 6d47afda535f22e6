"""The trunk's pose while the robot walks, measured in simulation."""

import math
from itertools import pairwise

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import CommandError, ModeError
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth

ASKED = BodyPose(-0.05, math.radians(8), math.radians(8), math.radians(10))
SPEED = 0.5
OFF, LOW = math.radians(2), 0.010
"""Angle [rad] and height [m] by which the measured mean may be off."""
SLOW = 0.02  #: Share by which the mean speed may be off
JUMP = 1.2  #: Rate of the trunk's attitude [rad/s] that a jump of the reference would exceed
WINDOW = 1.44  #: Time [s] of whole strides


def watch(go2: GO2Controller, seconds: float) -> np.ndarray:
    """Height of the base [m], roll, pitch, yaw [rad], once in 20 ms."""
    rows = []
    for _ in range(round(seconds / 0.02)):
        go2.wait(0.02)
        rows.append([go2.state.q[2], *go2.state.rpy])
    return np.array(rows)


def test_a_trotting_robot_takes_the_pose_and_keeps_its_speed_and_its_way() -> None:
    truth = GroundTruth(MujocoPlant(friction=0.7, seed=17))
    with GO2Controller(plant=truth) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(SPEED)
        go2.wait(1.5)
        before = watch(go2, WINDOW).mean(axis=0)
        go2.move(SPEED, height=ASKED.height, roll=ASKED.roll, pitch=ASKED.pitch, yaw=ASKED.yaw)
        assert go2.body_pose == ASKED
        way = watch(go2, 2.5)
        truth.clear()
        after = watch(go2, WINDOW).mean(axis=0)
        v = truth.recording().com_velocity[:, :2].mean(axis=0)
        assert truth.fall() is None
        go2.move(SPEED)
        assert go2.body_pose == LEVEL
        go2.wait(2.0)
        level = watch(go2, WINDOW).mean(axis=0)
        assert go2.stand()
    truth.close()
    assert after[0] - before[0] == pytest.approx(ASKED.height, abs=LOW)
    np.testing.assert_allclose(after[1:], before[1:] + ASKED.row[1:], atol=OFF)
    np.testing.assert_allclose(level, before, atol=LOW)
    ahead = np.array([math.cos(ASKED.yaw), -math.sin(ASKED.yaw)])  # seen from the turned trunk
    np.testing.assert_allclose(v, SPEED * ahead, atol=SLOW * SPEED)
    rates = [(b - a)[1:] / 0.02 for a, b in pairwise(way)]
    assert np.abs(rates).max() < JUMP


def test_a_pose_beyond_the_envelope_is_refused_and_changes_nothing() -> None:
    with GO2Controller() as go2:
        with pytest.raises(ModeError):
            go2.move(0.1, roll=0.1)
        assert go2.walk()
        go2.move(0.1, roll=0.1)
        with pytest.raises(CommandError, match=r"pitch must be -0\.15 to 0\.15 rad, got 0\.5"):
            go2.move(0.3, pitch=0.5)
        assert go2.body_pose == BodyPose(roll=0.1)
        assert go2.command.linear_x == 0.1
        go2.stop()
        assert go2.body_pose == LEVEL


def test_a_robot_that_stands_ready_leans_and_its_feet_stay() -> None:
    with GO2Controller() as go2:
        assert go2.walk()
        feet = go2.state.feet_in_contact
        go2.move(roll=0.15, yaw=-0.2)
        go2.wait(2.0)
        np.testing.assert_allclose(go2.state.rpy, [0.15, 0.0, -0.2], atol=OFF)
        assert feet.all()
        assert go2.state.feet_in_contact.all()
        assert np.abs(go2.state.v).max() < 0.05
        assert go2.stand()
