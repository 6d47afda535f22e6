"""Switches on the run-time checks of array shapes (jaxtyping with beartype) before any import.

The checks cost time in every call of a checked function, so they run under pytest only.
``GO2_WBC_TYPECHECK=0`` switches them off. pytest-xdist workers load this file too.
"""

from __future__ import annotations

import os
from pathlib import Path

from jaxtyping import install_import_hook

from go2_wbc.kernels.loading import load_kernels
from tests import typechecker

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("go2_wbc", "controller", "motions", "viz")
# Small functions and values that the control loop uses many times in a tick: checking these five
# modules as well makes a tick half as slow again. Their callers are checked.
UNCHECKED = frozenset(
    {
        "motions.pytest_plugin",  # pytest loads it before this file
        "go2_wbc.contacts",
        "go2_wbc.curves",
        "go2_wbc.kernels.active_set",  # compiled: a kernel cannot be wrapped
        "go2_wbc.kernels.condensed",
        "go2_wbc.kernels.derivation",
        "go2_wbc.kernels.loading",  # loaded here
        "go2_wbc.kernels.locomotion",
        "go2_wbc.kernels.validity",
        "go2_wbc.lazy",  # loaded by the pytest plugin's package
        "go2_wbc.planning.swing",
        "go2_wbc.robot.rotations",
        "go2_wbc.robot.snapshot",
    }
)
IS_CHECKING = os.environ.get("GO2_WBC_TYPECHECK", "1") != "0"


def our_modules() -> list[str]:
    """Dotted names of every module but the packages' ``__init__``, which only re-export."""
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")))
    names = (".".join(file.relative_to(ROOT).with_suffix("").parts) for file in files)
    return [name for name in names if not name.endswith(".__init__")]


def checked_modules() -> list[str]:
    """Dotted names of every module that is checked."""
    return [name for name in our_modules() if name not in UNCHECKED]


if IS_CHECKING:
    install_import_hook(checked_modules(), f"{typechecker.__name__}.checked")

# Compiled before any test, so that none of them, nor a script it starts, says that it compiles.
load_kernels()
