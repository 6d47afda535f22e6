"""What the tests of the Unitree bridge need: the extra, a domain of their own, foreign peers."""

from __future__ import annotations

import importlib.util
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Final, NoReturn

import numpy as np
import pytest

from controller.bridges.unitree.codec import encode_message
from controller.bridges.unitree.low_level import low_cmd_message
from go2_wbc.robot.state import JointCommand

HAS_DDS = importlib.util.find_spec("cyclonedds") is not None
IS_REQUIRED = "GO2_WBC_REQUIRE_UNITREE" in os.environ
"""Set by ``make test-unitree``: what is missing is then a failure, not a test that is skipped."""
needs_dds = pytest.mark.skipif(
    not HAS_DDS and not IS_REQUIRED,
    reason="CycloneDDS is not installed: `make test-unitree` installs it",
)
STOCK_SDK = "GO2_WBC_STOCK_SDK_PYTHON"
OLD_STOCK_SDK = "GO2_WBC_OLD_STOCK_SDK_PYTHON"
"""The SDK on CycloneDDS 0.10.2, which is built on a package of the system."""
OLD_DDS_HEADER = Path("/usr/include/dds/dds.h")
CPP_SDK = "GO2_WBC_CPP_SDK_PYTHON"
DAMPED: Final = encode_message(low_cmd_message(JointCommand.damping(3.0)))
"""A good ``rt/lowcmd``."""


def garbage() -> list[bytes]:
    """``rt/lowcmd`` that must move nothing: not finite, out of limits, damaged."""
    command = JointCommand.servo(np.zeros(12), np.zeros(12), 400.0, 1.0)
    damaged = low_cmd_message(JointCommand.torque(np.full(12, 20.0)))
    damaged["crc"] ^= 1
    return [
        encode_message(low_cmd_message(replace(command, tau=np.full(12, np.nan)))),
        encode_message(low_cmd_message(replace(command, q_des=np.full(12, 9.0)))),
        encode_message(damaged),
    ]


def peer_python(variable: str) -> str:
    """Python of a foreign SDK's environment; without one the test is skipped, or has failed."""
    python = os.environ.get(variable, "")
    if not Path(python).is_file():
        reason = f"{variable} names no environment with that SDK: make test-unitree makes one"
        if variable == OLD_STOCK_SDK and not OLD_DDS_HEADER.is_file():
            pytest.skip("without cyclonedds-dev 0.10.2 of the system: apt-get install it")
        if variable != STOCK_SDK and sys.version_info >= (3, 13):
            pytest.skip("the C++ SDK and CycloneDDS 0.10.2 know Python up to 3.12")
        absent(reason)
    return python


def absent(reason: str) -> NoReturn:
    """End the test: as failed where nothing may be missing, else as skipped."""
    if IS_REQUIRED:
        pytest.fail(reason)
    pytest.skip(reason)
