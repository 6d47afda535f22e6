"""The rules of the house as functions over a source tree; each returns its violations as lines.

The tree is read with ``ast`` and never imported, so a rule also sees the imports inside functions
and under ``TYPE_CHECKING``. ``test_architecture.py`` applies the rules to this project, and to
small trees that break them.
"""

import ast
import math
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGES = ("go2_wbc", "motions", "viz", "controller", "benchmarks")
"""Our packages; ``.importlinter`` says who may import whom."""

DISTRIBUTIONS = {"pinocchio": "pin", "PIL": "pillow", "collada": "pycollada"}
"""What to install for an import name, where the two differ."""

OPTIONAL = frozenset(
    {"rclpy", "cyclonedds", "crocoddyl", "librosa", "soundfile", "ray", "pyarrow", "pandas"}
    | {"gymnasium", "mcap", "onnx", "onnxruntime", "rerun", "av"}
)
"""Libraries that are imported only by those who have them; contracts keep them apart."""

MAX_FILE_LINES = 500
MAX_BODY_LINES = 70
MAX_BODY_LINES_P90 = 30

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True, slots=True)
class Module:
    """One source file: its path relative to the root, text and syntax tree."""

    path: str
    text: str
    tree: ast.Module


def read_tree(root: Path, packages: Iterable[str] = PACKAGES) -> list[Module]:
    """Every module of ``packages`` under ``root``."""
    files = (file for package in packages for file in sorted((root / package).rglob("*.py")))
    texts = ((file.relative_to(root).as_posix(), file.read_text("utf-8")) for file in files)
    return [Module(path, text, ast.parse(text, path)) for path, text in texts]


def libraries(module: Module) -> Iterator[tuple[int, str]]:
    """Line and package of each import that is not relative."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name.split(".")[0]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.lineno, (node.module or "").split(".")[0]


def undeclared_libraries(
    modules: list[Module], pyproject: str, stdlib: frozenset[str]
) -> list[str]:
    """Third-party imports that ``pyproject`` does not list as a dependency."""
    rows = tomllib.loads(pyproject)["project"]["dependencies"]
    declared = {re.split(r"[^A-Za-z0-9._-]", row.strip())[0] for row in rows}
    allowed = stdlib | OPTIONAL | {*PACKAGES, "tests"}
    return [
        f"{module.path}:{line}: {top} is not a dependency in pyproject.toml"
        for module in modules
        for line, top in libraries(module)
        if top not in allowed and DISTRIBUTIONS.get(top, top) not in declared
    ]


def unpackaged_files(root: Path, pyproject: str, packages: Iterable[str] = PACKAGES) -> list[str]:
    """Data files beside the modules that no ``package-data`` pattern puts into the wheel."""
    patterns = tomllib.loads(pyproject)["tool"]["setuptools"]["package-data"]["*"]
    suffixes = {".py", ".pyc", *(Path(pattern).suffix for pattern in patterns)}
    files = (file for package in packages for file in sorted((root / package).rglob("*")))
    return [
        f"{file.relative_to(root).as_posix()}: not covered by package-data in pyproject.toml"
        for file in files
        if file.is_file() and file.suffix not in suffixes
    ]


def long_files(modules: Iterable[Module]) -> list[str]:
    """Files of more than ``MAX_FILE_LINES`` lines."""
    return [
        f"{module.path}: {count} lines, at most {MAX_FILE_LINES}"
        for module in modules
        if (count := len(module.text.splitlines())) > MAX_FILE_LINES
    ]


def body_sizes(modules: Iterable[Module]) -> dict[str, int]:
    """Lines of each function's body, without its docstring."""
    return {
        f"{module.path}:{node.lineno}: {node.name}": _body_lines(node)
        for module in modules
        for node in ast.walk(module.tree)
        if isinstance(node, _FUNCTIONS)
    }


def _body_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    if not body:
        return 0
    return (body[-1].end_lineno or body[-1].lineno) - body[0].lineno + 1


def long_functions(modules: Iterable[Module]) -> list[str]:
    """Function bodies over the hard limit, and the largest tenth if the 90th percentile is over."""
    sizes = body_sizes(modules)
    ranked = sorted(sizes.values())
    found = [
        f"{where}: body of {count} lines, at most {MAX_BODY_LINES}"
        for where, count in sizes.items()
        if count > MAX_BODY_LINES
    ]
    percentile = ranked[math.ceil(0.9 * len(ranked)) - 1] if ranked else 0
    if percentile > MAX_BODY_LINES_P90:
        found.append(f"90th percentile of the bodies: {percentile}, at most {MAX_BODY_LINES_P90}")
        found += [f"{where}: {count}" for where, count in sizes.items() if count >= percentile]
    return found
