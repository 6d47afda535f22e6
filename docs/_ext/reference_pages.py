"""The parts of the reference that the code itself says.

- Before a build, from the docstrings: in ``reference/api`` a page for what each package offers, in
  ``reference/api/internals`` one for every room of the packages, with all the rest.
- ``{cli-help} NAME``: what ``go2-wbc NAME --help`` prints.
- ``{examples}``: the scripts of ``examples/``.
- ``{config-table} MODULE.CLASS``: the fields of a configuration with default and meaning.
- ``{envelopes}``: how fast each gait may be walked, as it was measured.
"""

from __future__ import annotations

import argparse
import ast
import dataclasses
import inspect
import os
import re
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from unittest import mock

from docutils import nodes
from docutils.statemachine import StringList
from plain_docstrings import as_markup
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.docutils import SphinxDirective

from controller.cli.main import COMMANDS, PROGRAM
from go2_wbc.planning.envelopes import measured_envelopes
from go2_wbc.wbc.config import Gains

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("go2_wbc", "motions", "viz", "controller")
OFFERED = (*PACKAGES, "motions.music", "controller.learning")
"""Packages whose public names programs use; of those that two of them offer the first one tells."""
LEFT_OUT = ("controller/cli", "controller/bridges", "motions/library")
"""Described on other pages: the command line, ROS 2 and Unitree, the gallery."""
_FIELD = re.compile(r"^    ([a-z]\w*(?:, [a-z]\w*)*): (.*(?:\n {5,}.*)*)", re.MULTILINE)


def rooms(root: Path = ROOT) -> dict[str, list[str]]:
    """The modules of every page of the API reference: one page a sub-package, one the rest."""
    found: dict[str, list[str]] = {}
    for package in PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            path = file.relative_to(root)
            if path.as_posix().startswith(LEFT_OUT) or not file.read_text().strip():
                continue
            parts = path.with_suffix("").parts
            page = ".".join(parts[: max(1, len(parts) - 1)][:2])
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            found.setdefault(page, []).append(name)
    return {page: _important_first(page, modules, root) for page, modules in found.items()}


def _important_first(page: str, modules: list[str], root: Path) -> list[str]:
    """The package itself, the modules whose names it or its parent passes on, and the others."""
    packages = {page, page.split(".")[0]}
    homes = {home for name in packages for home in exports_of(name, root).values()}
    return sorted(modules, key=lambda name: (name != page, name not in homes))


def offered(root: Path = ROOT) -> dict[str, dict[str, str]]:
    """The public names on the page of each package, and the module that each is defined in."""
    found: dict[str, dict[str, str]] = {}
    told: set[tuple[str, str]] = set()
    for package in OFFERED:
        own = exports_of(package, root)
        found[package] = dict(item for item in own.items() if item not in told)
        told |= found[package].items()
    return found


def user_page(package: str, names: Mapping[str, str], root: Path = ROOT) -> str:
    """What a package offers, in MyST."""
    lines = [f"# {package}", "", *_package(package, root), "```{eval-rst}"]
    for name, home in names.items():
        kind = _directive(name, home, root)
        members = ["   :members:"] * (kind == "autoclass")
        lines += [f".. {kind}:: {home}.{name}", *members, ""]
    return "\n".join([*lines, "```", ""])


def _directive(name: str, home: str, root: Path) -> str:
    """How Sphinx is asked for a name of a module."""
    file = root.joinpath(*home.split("."))
    file = file / "__init__.py" if file.is_dir() else file.with_suffix(".py")
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return "autoclass" if isinstance(node, ast.ClassDef) else "autofunction"
    return "autodata"


def api_page(room: str, modules: list[str], root: Path = ROOT) -> str:
    """A page of the API reference in MyST, without what programs use."""
    lines = [f"# {room}, inside", ""]
    used = {(home, name) for names in offered(root).values() for name, home in names.items()}
    for name in modules:
        if (root / name.replace(".", "/")).is_dir():
            lines += [*([f"## {name}", ""] * (name != room)), *_package(name, root)]
        else:
            lines += [f"## {name}", "", "```{eval-rst}", f".. automodule:: {name}", "   :members:"]
            elsewhere = sorted(other for home, other in used if home == name)
            lines += [*([f"   :exclude-members: {', '.join(elsewhere)}"] * bool(elsewhere))]
            lines += ["```", ""]
    return "\n".join(lines)


def exports_of(package: str, root: Path = ROOT) -> dict[str, str]:
    """The public names that a package passes on, and the module that each is defined in."""
    init = root / package.replace(".", "/") / "__init__.py"
    if not init.is_file():
        return {}
    found: dict[str, str] = {}
    for node in ast.walk(ast.parse(init.read_text(encoding="utf-8"))):
        home = node.module or "" if isinstance(node, ast.ImportFrom) else ""
        if isinstance(node, ast.ImportFrom) and home.startswith(f"{package}."):
            for name in (alias.name for alias in node.names):
                found[name] = exports_of(home, root).get(name, home)
    return dict(sorted(found.items()))


def _package(name: str, root: Path) -> Iterator[str]:
    """What a package is and which names it passes on; they are described where they live."""
    init = root / name.replace(".", "/") / "__init__.py"
    about = ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""
    links = [f":py:obj:`{key} <{home}.{key}>`" for key, home in exports_of(name, root).items()]
    yield from ("```{eval-rst}", *as_markup(about.splitlines()), "")
    if links:
        yield f"``from {name} import``: {', '.join(links)}."
    yield from ("```", "")


def write_api_pages(app: Sphinx) -> None:
    """Write the pages that have changed, and remove those without a room."""
    folder = Path(app.srcdir, "reference", "api")
    (folder / "internals").mkdir(parents=True, exist_ok=True)
    pages = {f"internals/{room}.md": api_page(room, modules) for room, modules in rooms().items()}
    pages |= {f"{package}.md": user_page(package, names) for package, names in offered().items()}
    for file in folder.rglob("*.md"):
        if file.relative_to(folder).as_posix() not in pages:
            file.unlink()
    for name, text in pages.items():
        file = folder / name
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def help_of(name: str) -> str:
    """The help of a subcommand of ``go2-wbc``, 80 columns wide."""
    subparsers = argparse.ArgumentParser(PROGRAM).add_subparsers()
    {command.name: command for command in COMMANDS}[name].add_to(subparsers)
    with mock.patch.dict(os.environ, {"COLUMNS": "80"}):
        return subparsers.choices[name].format_help()


def config_rows(kind: type) -> Iterator[tuple[str, str, str]]:
    """Name, default and meaning of every field, from the class's docstring or beside the field."""
    described = inspect.getdoc(kind) or ""
    meanings = {
        name: match[2]
        for match in _FIELD.finditer(described.partition("Attributes:")[2])
        for name in match[1].split(", ")
    }
    beside = ModuleAnalyzer.for_module(kind.__module__).find_attr_docs()
    meanings |= {name: " ".join(told) for (of, name), told in beside.items() if of == kind.__name__}
    example = kind()
    for item in dataclasses.fields(kind):
        value = getattr(example, item.name)
        is_table = dataclasses.is_dataclass(value) and not isinstance(value, Gains)
        meaning = " ".join(meanings[item.name].split()).rstrip(".")
        yield item.name, "" if is_table else _shown(value), f"{meaning[0].upper()}{meaning[1:]}."


def _shown(value: object) -> str:
    if dataclasses.is_dataclass(value):
        fields = (f"{f.name} = {_shown(getattr(value, f.name))}" for f in dataclasses.fields(value))
        return f"{{ {', '.join(fields)} }}"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_shown, value))}]"
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:g}" if isinstance(value, float) else str(value)


def envelope_rows() -> list[str]:
    """The table of the measured envelopes in Markdown."""
    bounds = measured_envelopes().items()
    return [
        "| gait | ahead | back | aside | turning |",
        "|---|---|---|---|---|",
        *(
            f"| `{name}` | {b.forward:.2f} m/s | {b.backward:.2f} m/s | {b.lateral:.2f} m/s "
            f"| {b.turning:.1f} rad/s |"
            for name, b in bounds
        ),
    ]


def _parsed(directive: SphinxDirective, lines: list[str], source: str) -> list[nodes.Node]:
    parent = nodes.container()
    directive.state.nested_parse(StringList(lines, source), 0, parent)
    return parent.children


class CliHelp(SphinxDirective):
    """The directive ``cli-help``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Show the help as it is printed."""
        text = help_of(self.arguments[0])
        return [nodes.literal_block(text, text, language="none")]


class ConfigTable(SphinxDirective):
    """The directive ``config-table``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make a table of the class that is named."""
        module, _, name = self.arguments[0].rpartition(".")
        lines = ["| key | default | what it is |", "|---|---|---|"]
        for key, default, meaning in config_rows(getattr(import_module(module), name)):
            shown = f"`{default}`" if default else ""
            lines.append(f"| `{key}` | {shown} | {meaning.replace('|', chr(92) + '|')} |")
        return _parsed(self, lines, self.arguments[0])


class Envelopes(SphinxDirective):
    """The directive ``envelopes``."""

    def run(self) -> list[nodes.Node]:
        """Make a table of the gaits that are measured."""
        return _parsed(self, envelope_rows(), "envelopes.json")


class Examples(SphinxDirective):
    """The directive ``examples``: every script of ``examples/`` with what it teaches."""

    def run(self) -> list[nodes.Node]:
        """A section a script."""
        return [self._section(file) for file in sorted((ROOT / "examples").glob("[0-9]*.py"))]

    def _section(self, file: Path) -> nodes.Node:
        self.env.note_dependency(str(file))
        text = file.read_text(encoding="utf-8")
        about = ast.get_docstring(ast.parse(text)) or ""
        code = text.partition('"""')[2].partition('"""')[2].strip()
        section = nodes.section("", nodes.title("", file.name), ids=[nodes.make_id(file.stem)])
        section += [nodes.paragraph("", part) for part in about.split("\n\n")]
        section += nodes.literal_block(code, code, language="python")
        return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Register pages and directives."""
    app.connect("builder-inited", write_api_pages)
    app.add_directive("cli-help", CliHelp)
    app.add_directive("config-table", ConfigTable)
    app.add_directive("envelopes", Envelopes)
    app.add_directive("examples", Examples)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
