"""Tests that solve dynamic motions: they need the extra [dynamics], and may be told to have it."""

import os
from importlib.util import find_spec

import pytest

IS_REQUIRED = os.environ.get("GO2_WBC_REQUIRE_SOLVER") == "1"
HAS_SOLVER = find_spec("crocoddyl") is not None
needs_solver = pytest.mark.skipif(
    not (HAS_SOLVER or IS_REQUIRED), reason="needs crocoddyl: pip install go2-wbc[dynamics]"
)
