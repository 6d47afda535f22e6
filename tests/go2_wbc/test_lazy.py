"""Public names are imported when they are first used, without collecting garbage meanwhile."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from go2_wbc import legs, motion_plan, reference
from go2_wbc.lazy import lazy_exports, without_collecting
from tests.script_server import python

MODULE = """
import gc
was_collecting = gc.isenabled()
"""
INIT = """
from typing import TYPE_CHECKING
from go2_wbc.lazy import lazy_exports
if TYPE_CHECKING:
    from {package}.home import {name}
__getattr__ = lazy_exports(__name__)
"""


def package(parent: Path, package: str, name: str, home: str) -> str:
    """Written: one whose ``name`` is in a module with the text ``home``; returns its name."""
    (folder := parent / package).mkdir()
    (folder / "__init__.py").write_text(INIT.format(package=package, name=name))
    (folder / "home.py").write_text(home)
    return package


@pytest.fixture(params=[True, False], ids=["collecting", "not collecting"])
def is_collecting(request: pytest.FixtureRequest) -> Iterator[bool]:
    """Whether garbage is collected before the import."""
    before = gc.isenabled()
    (gc.enable if request.param else gc.disable)()
    yield request.param
    (gc.enable if before else gc.disable)()


def test_no_garbage_is_looked_for_during_an_import_and_as_before_after_one_that_fails(
    is_collecting: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = package(tmp_path, f"lazy_package_{is_collecting}", "was_collecting", MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    assert import_module(made).was_collecting is False
    assert gc.isenabled() is is_collecting
    made = package(tmp_path, f"lazy_failing_{is_collecting}", "Thing", "import no_such_module\n")
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        _ = import_module(made).Thing
    assert gc.isenabled() is is_collecting


def test_an_attribute_that_a_module_lacks_is_not_taken_for_a_missing_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "lazy_broken", "Thing", "import math\nmath.no_such_function\nThing = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ImportError, match=r"lazy_broken\.home .*'no_such_function'") as caught:
        exec("from lazy_broken import Thing", {})
    assert isinstance(caught.value.__cause__, AttributeError)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Other'"):
        lazy_exports("go2_wbc")("Other")


@pytest.fixture
def _nothing_frozen() -> Iterator[None]:
    """As in a program that has frozen nothing."""
    gc.unfreeze()
    yield
    gc.freeze()


@pytest.mark.usefixtures("_nothing_frozen")
def test_what_an_import_made_is_old_and_a_programs_frozen_objects_stay_frozen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with without_collecting():
        made = [[] for _ in range(5000)]
        monkeypatch.setitem(sys.modules, "go2_wbc.first", ModuleType("first"))
    assert gc.get_count()[0] < len(made)
    assert not gc.get_freeze_count()
    gc.freeze()
    with without_collecting():
        monkeypatch.setitem(sys.modules, "go2_wbc.second", ModuleType("second"))
    assert gc.get_freeze_count()


def test_frozen_objects_are_not_counted_where_nothing_is_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(gc, "get_freeze_count", lambda: pytest.fail("takes tens of ms"))
    assert lazy_exports("go2_wbc")("Leg") is legs.Leg


def test_a_name_that_has_moved_is_found_and_says_where_it_is() -> None:
    with pytest.warns(DeprecationWarning, match=r"import it from go2_wbc\.motion_plan") as told:
        from go2_wbc.reference import Posture
    assert Posture is motion_plan.Posture
    assert told[0].filename == __file__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(reference, "nothing")  # noqa: B009 - no type checker knows it


PACKAGES = ("go2_wbc", "motions", "motions.dynamics", "motions.music", "viz", "controller")


@pytest.mark.parametrize("name", [*PACKAGES, "controller.demo", "controller.sweeps"])
def test_every_public_name_of_a_package_is_found(name: str) -> None:
    found = import_module(name)
    assert [public for public in found.__all__ if getattr(found, public, None) is None] == []


@pytest.mark.parametrize("name", ["motions", "controller"])
def test_a_users_file_that_hides_a_package_is_named(name: str, tmp_path: Path) -> None:
    (tmp_path / f"{name}.py").write_text("")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import go2_wbc"
    told = f"{tmp_path / name}.py hides the package {name!r} of go2-wbc: rename it"
    assert told in python("-c", code).stderr
