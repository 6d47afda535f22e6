"""What the tests of the Unitree bridge need: the extra, a domain of their own, foreign peers."""

from __future__ import annotations

import importlib.util
import itertools
import os
from pathlib import Path

import pytest

HAS_DDS = importlib.util.find_spec("cyclonedds") is not None
needs_dds = pytest.mark.skipif(
    not HAS_DDS, reason="CycloneDDS is not installed: pip install 'go2-wbc[unitree]'"
)
STOCK_SDK = "GO2_WBC_STOCK_SDK_PYTHON"
CPP_SDK = "GO2_WBC_CPP_SDK_PYTHON"
_numbers = itertools.count(os.getpid())


def free_domain() -> int:
    """A DDS domain that no other test is likely to use."""
    return 110 + next(_numbers) % 100


def peer_python(variable: str) -> str:
    """Python of a foreign SDK's environment; skips the test if there is none."""
    python = os.environ.get(variable, "")
    if not Path(python).is_file():
        pytest.skip(f"{variable} names no environment with that SDK: make test-unitree makes one")
    return python
