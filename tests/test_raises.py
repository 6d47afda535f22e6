"""Every public call that can raise says what: a ``Raises`` section where its own code raises."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from types import FunctionType, ModuleType
from typing import Any

import pytest

import controller
import go2_wbc
import motions
import viz
from go2_wbc.errors import ClosedError, Go2WbcError, ModeError

PACKAGES = (go2_wbc, motions, viz, controller)
OWN = tuple(f"{package.__name__}." for package in PACKAGES)

SAID_ONCE = (ClosedError, ModeError)
"""Of a closed, fallen or busy robot: its class says it of all of its calls."""


def calls(package: ModuleType) -> Iterator[tuple[str, FunctionType, type | None]]:
    """Public functions, and methods of public classes with their class, by name.

    What a class takes is described with the class, and tested where it is made.
    """
    for name in package.__all__:
        value = getattr(package, name)
        if isinstance(value, FunctionType):
            yield name, value, None
        if not isinstance(value, type) or not value.__module__.startswith(OWN):
            continue
        for key, item in inspect.getmembers_static(value):
            function = getattr(item, "fget", getattr(item, "__func__", item))
            function = inspect.unwrap(function) if callable(function) else None
            if isinstance(function, FunctionType) and not key.startswith("_"):
                yield f"{name}.{key}", function, value


CALLS = {
    f"{package.__name__}.{name}": (call, kind)
    for package in PACKAGES
    for name, call, kind in calls(package)
    if call.__module__.startswith(OWN)
}


def raises(function: FunctionType, kind: type | None, depth: int = 1) -> bool:
    """Whether its code raises an error of ours, or the code of what it calls, ``depth`` deep."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    names = function.__globals__
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            error = _named(node.exc.func, names, kind)
            is_ours = isinstance(error, type) and issubclass(error, Go2WbcError)
            if is_ours and error not in SAID_ONCE:
                return True
        if isinstance(node, ast.Call) and depth:
            called = inspect.unwrap(_named(node.func, names, kind) or print)
            if not isinstance(called, FunctionType) or not called.__module__.startswith(OWN):
                continue
            if raises(called, kind, depth - 1):
                return True
    return False


def _named(node: ast.expr, names: Mapping[str, Any], kind: type | None) -> Any:  # noqa: ANN401
    """What is called: a name, something of a module, or a method of ``self``."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        owner = kind if node.value.id == "self" else names.get(node.value.id)
        return getattr(owner, node.attr, None) if isinstance(owner, ModuleType | type) else None
    return None


@pytest.mark.parametrize("name", [name for name, call in CALLS.items() if raises(*call)])
def test_what_can_raise_says_what(name: str) -> None:
    assert "Raises:" in (inspect.getdoc(CALLS[name][0]) or "")
