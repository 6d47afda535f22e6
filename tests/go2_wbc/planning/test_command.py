"""Velocity commands: what they are made of, and how the envelope clips."""

import importlib.util
import math
import sys
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.planning import command as command_module
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope

ROUNDING = 1e-12  # of a ratio of numbers of order one
speeds = st.floats(-1e6, 1e6)
commands = st.builds(VelocityCommand, speeds, speeds, speeds)
bounds = st.floats(0.1, 5.0)
envelopes = st.builds(VelocityEnvelope, bounds, bounds, bounds, bounds, bounds)


def components(command: VelocityCommand) -> np.ndarray:
    return np.array([command.linear_x, command.linear_y, command.angular_z])


def load(envelope: VelocityEnvelope, command: VelocityCommand) -> float:
    x = command.linear_x / (envelope.forward if command.linear_x >= 0 else envelope.backward)
    y, turn = command.linear_y / envelope.lateral, command.angular_z / envelope.turning
    curve = math.hypot(command.linear_x, command.linear_y) * abs(command.angular_z)
    return max(math.hypot(x, y, turn), math.sqrt(curve / envelope.curve))


@pytest.fixture(scope="module")
def unchecked() -> ModuleType:
    """The module as users have it: under pytest, the checks of annotations come before its own."""
    name, path = command_module.__name__, command_module.__file__
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("value", [1, np.float32(0.5), np.int64(-1), 0.25], ids=repr)
def test_every_kind_of_real_number_becomes_a_float(unchecked: ModuleType, value: float) -> None:
    command = unchecked.VelocityCommand(linear_x=value)
    assert type(command.linear_x) is float
    assert command.linear_x == value
    assert command.is_zero is False  # a numpy number made this a numpy bool once


@given(commands)
def test_only_the_command_of_three_zeros_asks_the_robot_to_stay(command: VelocityCommand) -> None:
    assert command.is_zero == (not components(command).any())
    assert ZERO_COMMAND.is_zero


@given(envelopes, commands)
def test_a_clipped_command_lies_inside(
    envelope: VelocityEnvelope, command: VelocityCommand
) -> None:
    clipped = envelope.clip(command)
    assert load(envelope, clipped) <= 1.0 + ROUNDING
    assert -envelope.backward - ROUNDING <= clipped.linear_x <= envelope.forward + ROUNDING
    assert abs(clipped.linear_y) <= envelope.lateral + ROUNDING
    assert abs(clipped.angular_z) <= envelope.turning + ROUNDING


@given(envelopes, commands)
def test_clipping_twice_is_clipping_once_to_the_last_bit(
    envelope: VelocityEnvelope, command: VelocityCommand
) -> None:
    clipped = envelope.clip(command)
    assert envelope.clip(clipped) is clipped


@given(envelopes, commands)
def test_clipping_keeps_the_direction_and_uses_the_whole_envelope(
    envelope: VelocityEnvelope, command: VelocityCommand
) -> None:
    asked, clipped = components(command), components(envelope.clip(command))
    if load(envelope, command) <= 1.0:
        np.testing.assert_array_equal(clipped, asked)
        return
    assert load(envelope, envelope.clip(command)) == pytest.approx(1.0)
    unit = asked / np.linalg.norm(asked)
    np.testing.assert_allclose(clipped / np.linalg.norm(clipped), unit, atol=ROUNDING)


def test_clipping_keeps_the_direction_of_the_greatest_numbers_there_are() -> None:
    greatest = sys.float_info.max
    clipped = VelocityEnvelope().clip(VelocityCommand(greatest, -greatest, greatest))
    np.testing.assert_allclose(components(clipped), components(clipped)[0] * np.array([1, -1, 1]))
    assert load(VelocityEnvelope(), clipped) == pytest.approx(1.0)


def test_a_share_of_the_envelope_scales_every_bound() -> None:
    half = VelocityEnvelope().scaled(0.5)
    whole = VelocityEnvelope()
    assert half == VelocityEnvelope(
        whole.forward / 2, whole.backward / 2, whole.lateral / 2, whole.turning / 2, whole.curve / 4
    )


def test_a_fast_curve_is_clipped_to_what_the_floor_holds() -> None:
    # Inside the ellipsoid, and three of three robots fell at (2, 0.5) m/s and 3 rad/s.
    envelope = VelocityEnvelope(3.0, 2.0, 1.0, 6.0)
    x, y, turn = components(envelope.clip(VelocityCommand(2.0, 0.5, 3.0)))
    assert math.hypot(x, y) * turn == pytest.approx(envelope.curve)
