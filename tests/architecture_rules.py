"""The rules of the house as functions over a source tree; each returns its violations as lines.

The tree is read with ``ast`` and never imported, so a rule also sees the imports inside functions
and under ``TYPE_CHECKING``. ``test_architecture.py`` applies the rules to this project, and to
small trees that break them.
"""

from __future__ import annotations

import ast
import math
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

PACKAGES = ("go2_wbc", "motions", "viz", "controller", "benchmarks")
"""Our packages; ``.importlinter`` says who may import whom."""

FENCES: dict[str, tuple[str, ...]] = {
    "mujoco": (
        "go2_wbc/plant/mujoco/*",
        "benchmarks/model.py",
    ),
    "meshcat": ("viz/*",),
    "matplotlib": ("viz/*", "benchmarks/figures.py", "go2_wbc/recording.py"),  # there only its type
    "placo": (
        "go2_wbc/wbc/placo_backend.py",
        "go2_wbc/robot/inverse_kinematics.py",
        "benchmarks/speed_placo.py",
    ),
    "crocoddyl": ("motions/dynamics/*",),
    "librosa": ("motions/music/*",),
    "soundfile": ("motions/music/*",),
    "rclpy": ("controller/bridges/*",),
    "cyclonedds": ("controller/bridges/*",),
    "ray": ("controller/sweeps/ray_engine.py",),
    "pyarrow": ("controller/sweeps/run.py",),
    "mcap": ("viz/replay/mcap_file.py",),
    "rerun": ("viz/replay/rerun_file.py",),
    "sqlite3": ("controller/sweeps/sweep_file.py",),
}
"""The only files that may import each of these libraries."""

DISTRIBUTIONS = {"pinocchio": "pin", "PIL": "pillow", "collada": "pycollada"}
"""What to install for an import name, where the two differ."""

OPTIONAL = frozenset(
    {"rclpy", "cyclonedds", "crocoddyl", "librosa", "soundfile", "ray", "pyarrow", "pandas"}
    | {"mcap", "rerun"}
)
"""Libraries that are imported only by those who have them; their fences keep them apart."""

MAX_FILE_LINES = 500
MAX_BODY_LINES = 70
MAX_BODY_LINES_P90 = 30

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True, slots=True)
class Module:
    """One source file: its path relative to the root, dotted name, text and syntax tree."""

    path: str
    name: str
    text: str
    tree: ast.Module


def read_tree(root: Path, packages: Iterable[str] = PACKAGES) -> list[Module]:
    """Every module of ``packages`` under ``root``."""
    files = (file for package in packages for file in sorted((root / package).rglob("*.py")))
    return [_read(root, file) for file in files]


def _read(root: Path, file: Path) -> Module:
    relative = file.relative_to(root)
    parts = relative.with_suffix("").parts
    name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    text = file.read_text(encoding="utf-8")
    return Module(relative.as_posix(), name, text, ast.parse(text, str(file)))


def imports(module: Module, known: frozenset[str]) -> Iterator[tuple[int, str]]:
    """Line and dotted target of each import; a name taken from a package resolves to its module.

    Args:
        module: the importing module.
        known: the dotted names of all our modules.
    """
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(module, node)
            for alias in node.names:
                full = f"{base}.{alias.name}"
                yield node.lineno, full if full in known else base


def _absolute(module: Module, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    parts = module.name.split(".")
    is_package = module.path.endswith("/__init__.py")
    kept = parts[: len(parts) - node.level + is_package]
    return ".".join([*kept, node.module] if node.module else kept)


def _names(modules: Iterable[Module]) -> frozenset[str]:
    return frozenset(module.name for module in modules)


def fence_violations(modules: list[Module]) -> list[str]:
    """Third-party libraries imported outside the files that own them."""
    known = _names(modules)
    return [
        f"{module.path}:{line}: {top} belongs in {', '.join(FENCES[top])}"
        for module in modules
        for line, target in imports(module, known)
        if (top := target.split(".")[0]) in FENCES and not _matches(module.path, FENCES[top])
    ]


def undeclared_libraries(
    modules: list[Module], pyproject: str, stdlib: frozenset[str]
) -> list[str]:
    """Third-party imports that ``pyproject`` does not list as a dependency."""
    rows = tomllib.loads(pyproject)["project"]["dependencies"]
    declared = {re.split(r"[^A-Za-z0-9._-]", row.strip())[0] for row in rows}
    known = _names(modules)
    allowed = stdlib | OPTIONAL | {*PACKAGES, "tests"}
    return [
        f"{module.path}:{line}: {top} is not a dependency in pyproject.toml"
        for module in modules
        for line, target in imports(module, known)
        if (top := target.split(".")[0]) not in allowed
        and DISTRIBUTIONS.get(top, top) not in declared
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


def _matches(path: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(path, pattern) for pattern in patterns)
