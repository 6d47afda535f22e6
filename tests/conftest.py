"""Switches on the run-time checks of array shapes (jaxtyping with beartype) before any import.

The checks cost time in every call of a checked function, so they run under pytest only, and the
repetitions in long loops are checked now and again only (see ``tests/typechecker.py``).
``GO2_WBC_TYPECHECK=0`` switches them off. pytest-xdist workers load this file too.
"""

import gc
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

from go2_wbc.compilation import load_kernels
from tests import typechecker

if TYPE_CHECKING:
    from go2_wbc.robot.model import RobotModel
    from motions import FeasibilityChecker

ROOT = Path(__file__).resolve().parent.parent
LONGEST = tuple(
    ROOT / "tests" / name
    for name in (
        "scenarios/test_behaviour.py",
        "test_examples.py",
        "test_notebooks.py",
        "controller/bridges/unitree/test_foreign_peers.py",
        "test_docs.py",
        "viz/replay/test_plan_browser.py",
        "viz/replay/test_live_browser.py",
        "viz/replay/test_studio_browser.py",
        "viz/replay/test_browser.py",
        "controller/cli/test_demo.py",
        "scenarios/test_always_an_answer.py",
        "scenarios/test_recovery.py",
        "scenarios/test_joint_friction.py",
    )
)
"""The files with the longest tests, the longest first. The workers take whole files, so that what
a file's tests share is made once."""
PACKAGES = ("go2_wbc", "controller", "motions", "viz")
# Small functions and values that the control loop uses many times in a tick: checking these five
# modules as well makes a tick half as slow again. Their callers are checked.
UNCHECKED = frozenset(
    {
        "controller.pytest_plugin",  # pytest loads these two before this file
        "motions.pytest_plugin",
        "go2_wbc.contacts",
        "go2_wbc.curves",
        "go2_wbc.brief",
        "go2_wbc.compilation",  # loaded here, as is what it imports
        "go2_wbc.machine_code",
        "go2_wbc.numba_extensions",
        "go2_wbc.records",
        "go2_wbc.written",
        "go2_wbc.lazy",  # loaded by the pytest plugin's package
        "go2_wbc.planning.swing",
        "go2_wbc.robot.rotations",
        "go2_wbc.robot.state",
        "motions.language.tracing",  # looks which line has called it
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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with long tests first, so that no worker is left with one when the others are done."""
    rank = {path: place for place, path in enumerate(LONGEST)}
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (rank.get(item.path, len(LONGEST)), item.path not in slow))


def pytest_collection_finish() -> None:
    """What is loaded now stays to the end: the collector passes over it from now on."""
    gc.freeze()
    gc.enable()


def pytest_runtest_setup() -> None:
    """Checks the first calls of every test's fixtures; loggers say what they say by default."""
    typechecker.renew()
    for name in PACKAGES:  # a command of a test before may have told them to say more
        logging.getLogger(name).setLevel(logging.NOTSET)
    logging.getLogger().setLevel(logging.WARNING)


def pytest_runtest_call() -> None:
    """Checks the first calls of every test."""
    typechecker.renew()


# Loading makes 430,000 objects, none of which can go: looking through them takes 1.5 s.
gc.disable()

if IS_CHECKING:
    install_import_hook(checked_modules(), f"{typechecker.__name__}.checked")
    typechecker.ration()

# A property must hold, however busy the machine is: its time is no part of it.
settings.register_profile("go2_wbc", deadline=None)
settings.load_profile("go2_wbc")

# Compiled before any test, so that none of them, nor a script it starts, says that it compiles.
load_kernels()


@pytest.fixture(scope="session")
def model() -> "RobotModel":
    """The robot; no test changes it."""
    from go2_wbc.robot.model import RobotModel

    return RobotModel()


@pytest.fixture(scope="session")
def checker(model: "RobotModel") -> "FeasibilityChecker":
    """What checks motions on it."""
    from motions import FeasibilityChecker

    return FeasibilityChecker(model)


@pytest.fixture(scope="module")
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new file with the name and text that are the ``FILE`` of the module."""
    path = tmp_path_factory.mktemp("studio") / request.module.FILE[0]
    path.write_text(request.module.FILE[1], encoding="utf-8")
    return path
