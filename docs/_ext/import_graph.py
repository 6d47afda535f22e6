"""Draws who imports whom, from the imports themselves: a directive that becomes an inline SVG.

    ```{import-graph} go2_wbc
    ```

draws the rooms of one package (its modules and sub-packages), ``packages`` all packages. A box lies
above everything that it imports. An arrow that follows from two others is left out.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("benchmarks", "controller", "viz", "motions", "go2_wbc")
WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 136, 42, 12, 34, 2
"""Size of a box and the space around it [px]."""
MOST_PER_ROW = 5

Graph = dict[str, set[str]]


@dataclass(frozen=True, slots=True)
class Module:
    """A source file: its dotted name, whether it is a package's own, its lines, its imports."""

    name: str
    is_package: bool
    lines: int
    imports: tuple[ast.Import | ast.ImportFrom, ...]


@cache
def read_modules(root: Path = ROOT) -> Mapping[str, Module]:
    """All modules of the packages, by name, without importing them."""
    found = {}
    for file in (file for package in PACKAGES for file in sorted((root / package).rglob("*.py"))):
        parts = file.relative_to(root).with_suffix("").parts
        is_package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_package else parts)
        text = file.read_text(encoding="utf-8")
        nodes_of_file = ast.walk(ast.parse(text))
        imports = [n for n in nodes_of_file if isinstance(n, ast.Import | ast.ImportFrom)]
        found[name] = Module(name, is_package, len(text.splitlines()), tuple(imports))
    return found


def room_of(name: str, package: str) -> str:
    """The room of a module as drawn: a package for ``packages``, else its second word."""
    parts = name.split(".")
    if package == "packages":
        return parts[0]
    return parts[1] if parts[0] == package and len(parts) > 1 else ""


def graph_of(modules: Mapping[str, Module], package: str) -> Graph:
    """The rooms that every room imports."""
    homes = {name: _exports(module) for name, module in modules.items() if module.is_package}
    graph: Graph = {room_of(name, package): set() for name in modules}
    for name, module in modules.items():
        for target in _imports(module, modules, homes):
            graph[room_of(name, package)].add(room_of(target, package))
    graph.pop("", None)
    return {room: {t for t in graph[room] if t not in ("", room)} for room in sorted(graph)}


def _exports(package: Module) -> dict[str, str]:
    """The module that each name comes from which a package passes on."""
    return {
        alias.name: node.module
        for node in package.imports
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def _imports(
    module: Module, modules: Mapping[str, Module], homes: Mapping[str, Mapping[str, str]]
) -> Iterator[str]:
    for node in module.imports:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif node.module and node.module in modules:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                own = homes.get(node.module, {}).get(alias.name, node.module)
                yield full if full in modules else own


def layers_of(graph: Graph) -> dict[str, int]:
    """The height of every room: one above the highest that it imports; a circle has one height."""
    reach = {room: _reachable(graph, room) for room in graph}
    height: dict[str, int] = {}

    def visit(room: str) -> int:
        if room not in height:
            below = {t for t in reach[room] if room not in reach[t]}
            height[room] = 0
            height[room] = 1 + max((visit(t) for t in sorted(below)), default=-1)
        return height[room]

    for room in graph:
        visit(room)
    return height


def _reachable(graph: Graph, start: str) -> set[str]:
    seen: set[str] = set()
    todo = [start]
    while todo:
        for target in graph[todo.pop()] - seen:
            seen.add(target)
            todo.append(target)
    return seen


def reduced(graph: Graph) -> Graph:
    """The graph without the arrows that follow from two others."""
    reach = {room: _reachable(graph, room) for room in graph}
    return {
        room: {
            target
            for target in targets
            if room in reach[target]
            or not any(target in reach[t] for t in targets - {target} if room not in reach[t])
        }
        for room, targets in graph.items()
    }


def rows_of(graph: Graph) -> list[list[str]]:
    """The rooms in rows, highest first; a row's order puts each near what it imports."""
    height = layers_of(graph)
    rows: list[list[str]] = []
    place: dict[str, float] = {}
    for level in range(max(height.values(), default=-1) + 1):
        row = sorted(room for room in graph if height[room] == level)
        row.sort(key=lambda room: (_mean(place[t] for t in graph[room] if t in place), room))
        for start in range(0, len(row), MOST_PER_ROW):
            part = row[start : start + MOST_PER_ROW]
            rows.append(part)
            place |= {room: k - (len(part) - 1) / 2 for k, room in enumerate(part)}
    return rows[::-1]


def _mean(values: Iterator[float]) -> float:
    all_values = list(values)
    return sum(all_values) / len(all_values) if all_values else 0.0


def svg(graph: Graph, notes: Mapping[str, str], title: str) -> str:
    """The picture; colours are the page's, so that it follows light and dark."""
    rows = rows_of(graph)
    across = max((len(row) for row in rows), default=1)
    width = across * (WIDTH + GAP_X) - GAP_X + 2 * MARGIN
    height = len(rows) * (HEIGHT + GAP_Y) - GAP_Y + 2 * MARGIN
    corner: dict[str, tuple[float, float]] = {}
    for line, row in enumerate(rows):
        left = (width - len(row) * (WIDTH + GAP_X) + GAP_X) / 2
        for k, room in enumerate(row):
            corner[room] = (left + k * (WIDTH + GAP_X), MARGIN + line * (HEIGHT + GAP_Y))
    arrows = [
        _arrow(corner[room], corner[target])
        for room, targets in reduced(graph).items()
        for target in sorted(targets)
    ]
    boxes = [_box(room, notes.get(room, ""), *corner[room]) for row in rows for room in row]
    return "\n".join(
        [
            f'<svg class="import-graph" role="img" aria-label="{escape(title)}" '
            f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}" '
            'xmlns="http://www.w3.org/2000/svg">',
            '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
            'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z"/></marker></defs>',
            *arrows,
            *boxes,
            "</svg>",
        ]
    )


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    if start[1] == end[1]:  # only in a circle
        return _sideways(start, end)
    x0, y0 = start[0] + WIDTH / 2, start[1] + HEIGHT
    x1, y1 = end[0] + WIDTH / 2, end[1]
    bend = max((y1 - y0) / 2, GAP_Y / 2)
    return _path(f"M{x0:g} {y0:g}C{x0:g} {y0 + bend:g} {x1:g} {y1 - bend:g} {x1:g} {y1 - 1:g}")


def _sideways(start: tuple[float, float], end: tuple[float, float]) -> str:
    way = 1 if end[0] > start[0] else -1
    x0, x1 = start[0] + WIDTH / 2 * (1 + way), end[0] + WIDTH / 2 * (1 - way) - way
    y = start[1] + HEIGHT / 2 + 6 * way
    return _path(f"M{x0:g} {y:g}H{x1:g}")


def _path(data: str) -> str:
    return f'<path class="arrow" marker-end="url(#tip)" d="{data}"/>'


def _box(room: str, note: str, x: float, y: float) -> str:
    middle = x + WIDTH / 2
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="6"/>'
        f'<text class="name" x="{middle:g}" y="{y + 19:g}">{escape(room)}</text>'
        f'<text class="note" x="{middle:g}" y="{y + 35:g}">{escape(note)}</text>'
    )


def sizes(modules: Mapping[str, Module], package: str) -> dict[str, str]:
    """How many files and lines every room has, in words."""
    rooms: dict[str, list[int]] = {}
    for name, module in modules.items():
        rooms.setdefault(room_of(name, package), []).append(module.lines)
    return {
        room: (f"{len(lines)} files, " if len(lines) > 1 else "") + f"{sum(lines)} lines"
        for room, lines in rooms.items()
    }


class ImportGraph(SphinxDirective):
    """The directive ``import-graph``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Draw the package that is named."""
        (package,) = self.arguments
        modules = read_modules()
        title = "who imports whom among the packages" if package == "packages" else package
        picture = svg(graph_of(modules, package), sizes(modules, package), title)
        for file in (file for name in PACKAGES for file in (ROOT / name).rglob("*.py")):
            self.env.note_dependency(str(file))
        return [nodes.raw("", f'<div class="wide">{picture}</div>', format="html")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("import-graph", ImportGraph)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
