"""The picture of a ROS 2 call in the documentation names what there is. No ROS is needed."""

import ast
import re
from itertools import pairwise

from tests.controller.bridges.ros2_graph import ROOT

WIDTH = 80  # columns


def picture() -> str:
    """The sequence diagram, names that are broken over two lines put together again."""
    text = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
    (found,) = re.findall(r"```text\n(client.*?)```", text, re.DOTALL)
    assert max(map(len, found.splitlines())) <= WIDTH
    return found


def names_in(text: str) -> set[tuple[str, str]]:
    """Class and method of each ``Class.method``; the method may stand below its class."""
    lines = text.splitlines()
    names = set(re.findall(r"\b([A-Z]\w+)\.(\w+)", text))
    for line, below in pairwise(lines):
        for start in re.finditer(r"(?<=\| )\.(\w+)", below):
            names.add((re.split(r"\W", line[start.start() :])[0], start[1]))
    return names


def classes_of_the_controller() -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for file in (ROOT / "controller").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                members = (m for m in node.body if isinstance(m, ast.FunctionDef | ast.AnnAssign))
                names = {
                    m.name if isinstance(m, ast.FunctionDef) else ast.unparse(m.target)
                    for m in members
                }
                found.setdefault(node.name, set()).update(names)
    return found


def test_the_sequence_of_a_call_names_classes_and_methods_that_exist() -> None:
    classes, text = classes_of_the_controller(), picture()
    heads = text.splitlines()[0].split()[1:]
    assert heads == ["RobotNode", "JobServer", "GO2Controller", "ControlLoop"]
    named = names_in(text)
    assert {("GO2Controller", "stand"), ("ControlLoop", "tick"), ("Job", "reply")} <= named
    assert len(named) >= 12
    for owner, member in named:
        assert member in classes[owner], f"{owner}.{member}"
