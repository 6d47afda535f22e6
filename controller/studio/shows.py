"""A show: the motions of a file, one after the other, as a motion of the same file."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from controller.studio.layout import INDENT, LONGEST_LINE
from controller.studio.source import Source
from controller.studio.syntax import Syntax
from go2_wbc.errors import StudioError

NAME = "show"


def with_show(source: Source, motions: Sequence[str]) -> tuple[Source, str]:
    """With a motion that plays others in order, behind the last of them; and its name.

    One that calls another of them is left out: it is a show itself.

    Args:
        source: the text.
        motions: all of the file, in the order in which they are played.

    Raises:
        StudioError: if fewer than two are left.
    """
    syntax = source.syntax
    written = {name: _function(syntax, name) for name in motions}
    parts = [name for name in motions if not _called(written[name]) & {*motions} - {name}]
    if len(parts) < 2:
        raise StudioError("a show is made of two motions or more, which are no shows themselves")
    last = max((written[name] for name in parts), key=lambda one: one.lineno)
    taken = {node.id for node in syntax.nodes if isinstance(node, ast.Name)}
    taken |= {node.name for node in syntax.nodes if isinstance(node, ast.FunctionDef)}
    name = next(n for n in [NAME, *(f"{NAME}_{k}" for k in range(2, 100))] if n not in taken)
    end = syntax.span(last)[1]
    line = syntax.data.find(b"\n", end)
    at = len(syntax.data) if line < 0 else line + 1
    before = "" if syntax.data[:at].endswith(b"\n") else syntax.line_end
    text = before + _text(syntax, name, parts, last).replace("\n", syntax.line_end)
    return source.replaced((at, at), text), name


def _function(syntax: Syntax, name: str) -> ast.FunctionDef:
    for node in syntax.tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == name and node.decorator_list:
            return node
    raise StudioError(f"{name} is not written as a function of this file")


def _called(function: ast.FunctionDef) -> set[str]:
    calls = [node.func for node in ast.walk(function) if isinstance(node, ast.Call)]
    return {one.id for one in calls if isinstance(one, ast.Name)}


def _text(syntax: Syntax, name: str, parts: Sequence[str], like: ast.FunctionDef) -> str:
    """The motion, decorated and annotated as another one."""
    mark = like.decorator_list[-1]
    mark = mark.func if isinstance(mark, ast.Call) else mark
    gives = f" -> {syntax.node(like.returns)}" if like.returns else ""
    first, *others = (f"{part}()" for part in parts)
    line = f"{INDENT}return {first}.then({', '.join(others)})"
    if len(line) > LONGEST_LINE:
        rows = "".join(f"{2 * INDENT}{one},\n" for one in others)
        line = f"{INDENT}return {first}.then(\n{rows}{INDENT})"
    told = f'{INDENT}"""The motions of this file, one after the other."""'
    return f"\n\n@{syntax.node(mark)}\ndef {name}(){gives}:\n{told}\n{line}\n"
