"""Where a call that is inserted goes, so that no line gets long: the rest of the file stays."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from contextlib import suppress

from controller.studio.syntax import Span, Syntax

LONGEST_LINE = 100  #: characters; an inserted call that would make it longer gets its own line
INDENT = "    "  #: of what is put in brackets


def placed(syntax: Syntax, call: ast.Call, end: int, text: str) -> tuple[Span, str, int]:
    """How ``text`` is put behind a call that ends in byte ``end``.

    In its line, if there is room; else on a line of its own: as a statement, where a name is given
    its value; in the brackets that are there; or in new ones around the whole value.

    Returns:
        The span that is replaced, by what, and the byte behind ``text`` then.
    """
    statement = syntax.statement(call)
    start, value = syntax.span(statement)[0], getattr(statement, "value", None)
    line, stop = _line(syntax, end)
    in_line = (end, end), text, end + len(text.encode())
    if text[:1] in "\r\n":
        end = tail(syntax.data, end)
        return (end, end), text, end + len(text.encode())
    if len(syntax.text((line, stop))) + len(text) <= LONGEST_LINE:
        return in_line
    first, _ = _line(syntax, start)
    left = syntax.text((first, start))
    if _depth(syntax.text((start, end))):
        own = re.match(r"[ \t]*", syntax.text((line, end)))
        inner = own[0] if own and line > first else left + INDENT
        text = f"{syntax.line_end}{inner}{text}"
        return (end, end), text, end + len(text.encode())
    if left.strip() or not isinstance(value, ast.expr):
        return in_line
    if value is call and isinstance(statement, ast.Assign):
        (target, *others), end = statement.targets, tail(syntax.data, end)
        if isinstance(target, ast.Name) and not others:
            text = f"{syntax.line_end}{left}{target.id} = {target.id}{text}"
            return (end, end), text, end + len(text.encode())
    return _bracketed(syntax, syntax.span(value), end, text, left)


def _bracketed(
    syntax: Syntax, whole: Span, end: int, text: str, left: str
) -> tuple[Span, str, int]:
    """In new brackets around a value."""
    inner = f"{syntax.line_end}{left}{INDENT}"
    before, behind = syntax.text((whole[0], end)), syntax.text((end, whole[1]))
    is_long = len(f"{left}{INDENT}{text}{behind}") > LONGEST_LINE and behind.startswith(".")
    head = f"({inner}{before}{inner}{text}"
    rest = f"{inner if is_long else ''}{behind}{syntax.line_end}{left})"
    return whole, head + rest, whole[0] + len(head.encode())


def tail(data: bytes, end: int) -> int:
    """The end of the comment on the line that ends in ``end``."""
    match = re.compile(rb"[ \t]*#[^\r\n]*").match(data, end)
    return match.end() if match else end


def _line(syntax: Syntax, at: int) -> Span:
    """The line of a byte, without its end."""
    start = syntax.starts[syntax.site(at)[0] - 1]
    match = re.compile(rb"[^\r\n]*").match(syntax.data, start)
    return start, match.end() if match else start


def _depth(code: str) -> int:
    """How many brackets are open at the end of a text."""
    depth = 0
    with suppress(tokenize.TokenError):  # it ends in the middle of a statement
        for token in tokenize.generate_tokens(io.StringIO(code).readline):
            if token.type == tokenize.OP:
                depth += (token.string in "([{") - (token.string in ")]}")
    return depth
