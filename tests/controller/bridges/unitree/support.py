"""What the tests of the Unitree bridge need: the extra, a domain of their own, foreign peers."""

import importlib.util
import os
import sys
from pathlib import Path
from typing import NoReturn

import pytest

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
