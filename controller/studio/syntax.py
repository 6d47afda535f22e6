"""An author's file as a tree, and where each part of it stands: spans of bytes."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property, lru_cache

from go2_wbc.errors import StudioError

MODULE = "motions"  #: whose functions an author uses
_SCOPES = (ast.FunctionDef, ast.Lambda, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
Site = tuple[int, int]  #: line from 1 and column [bytes] from 0 at which a call ends
Span = tuple[int, int]  #: first byte, and the first after it


class Syntax:
    """The tree of a text.

    Attributes:
        data: the bytes of the text.
        tree: of the module.
        starts: where each line starts.
    """

    def __init__(self, data: bytes) -> None:
        """Read it.

        Raises:
            StudioError: if it is not Python, or not UTF-8; says the line.
        """
        self.data = data
        try:
            data.decode()
            coding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
            if not (data.isascii() or coding.startswith("utf-8")):
                raise StudioError(f"the file says that it is {coding}: save it as UTF-8")
            self.tree = ast.parse(data)
        except UnicodeDecodeError as error:  # what is kept are places in bytes of UTF-8
            line = data.count(b"\n", 0, error.start) + 1
            raise StudioError(f"line {line}: it is no UTF-8: save the file as UTF-8") from error
        except (SyntaxError, ValueError) as error:
            line = f"line {error.lineno}: " if isinstance(error, SyntaxError) else ""
            raise StudioError(f"{line}{error.args[0]}") from error
        bom = 3 if data.startswith(b"\xef\xbb\xbf") else 0
        ends = [match.end() for match in re.finditer(rb"\r\n|\r|\n", data)]
        self.starts = [bom, *ends]
        self._stored = dict[ast.AST, dict[str, list[ast.Name]]]()

    def stored(self, scope: ast.AST) -> dict[str, list[ast.Name]]:
        """Where the names of a scope are set, without those of the scopes in it."""
        if scope not in self._stored:
            found = self._stored[scope] = defaultdict[str, list[ast.Name]](list)
            for node in _within(scope):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    found[node.id].append(node)
        return self._stored[scope]

    @cached_property
    def nodes(self) -> list[ast.AST]:
        """All of them."""
        return list(ast.walk(self.tree))

    @cached_property
    def parents(self) -> dict[ast.AST, ast.AST]:
        """What each is in."""
        return {child: node for node in self.nodes for child in ast.iter_child_nodes(node)}

    @cached_property
    def _calls(self) -> dict[tuple[int | None, int | None], ast.Call]:
        calls = [node for node in self.nodes if isinstance(node, ast.Call)]
        return {(call.end_lineno, call.end_col_offset): call for call in calls}

    def call(self, site: Site) -> ast.Call:
        """The call that ends there; raises StudioError if none does."""
        if site not in self._calls:
            raise StudioError(f"no call ends in line {site[0]}: the file has changed")
        return self._calls[site]

    def site(self, end: int) -> Site:
        """Line and column of a byte."""
        line = bisect_right(self.starts, end)
        return line, end - self.starts[line - 1]

    def around(self, node: ast.AST) -> Iterator[ast.AST]:
        """What it is in, the innermost first."""
        while (node := self.parents.get(node, self.tree)) is not self.tree:
            yield node

    def statement(self, node: ast.AST) -> ast.stmt:
        """The statement that it is in."""
        while not isinstance(node, ast.stmt):
            node = self.parents[node]
        return node

    def span(self, node: ast.expr | ast.stmt) -> Span:
        """Where it stands."""
        start = self.starts[node.lineno - 1] + node.col_offset
        return start, self.starts[(node.end_lineno or 1) - 1] + (node.end_col_offset or 0)

    def text(self, span: Span) -> str:
        """What stands there."""
        return self.data[slice(*span)].decode()

    def node(self, node: ast.expr) -> str:
        """Its text; that of a node which stands nowhere (line 0) is made."""
        return self.text(self.span(node)) if node.lineno else ast.unparse(node)

    def name(self, call: ast.Call) -> str:
        """Of the function or method that is called, also where it was imported by another."""
        if isinstance(call.func, ast.Attribute):
            return call.func.attr
        own = self.node(call.func)
        return next((alias.name for _, alias in self._imported if alias.asname == own), own)

    def called(self, name: str) -> str:
        """What the file calls a function of ``motions``; empty if it has not imported it."""
        for module, alias in self._imported:
            if module == MODULE and alias.name in (name, "*"):
                return alias.asname or name
            if module is None and alias.name == MODULE:
                return f"{alias.asname or alias.name}.{name}"
        return ""

    @cached_property
    def _imported(self) -> list[tuple[str | None, ast.alias]]:
        """What is imported, and the module that it is of."""
        nodes = [one for one in self.tree.body if isinstance(one, ast.Import | ast.ImportFrom)]
        return [(getattr(node, "module", None), alias) for node in nodes for alias in node.names]

    @property
    def line_end(self) -> str:
        """As the file has it."""
        return "\r\n" if b"\r\n" in self.data else "\n"


def _within(scope: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a scope, without those of the scopes in it."""
    for child in ast.iter_child_nodes(scope):
        yield child
        if not isinstance(child, _SCOPES):
            yield from _within(child)


@lru_cache(maxsize=8)
def syntax_of(data: bytes) -> Syntax:
    """The tree of a text, not to be changed: while a bar is dragged, that of the saved text stays.

    Raises:
        StudioError: if it is not Python; says the line.
    """
    return Syntax(data)


def lost_comments(before: bytes, after: bytes) -> str:
    """The comments of a text that another one has not."""
    found = {before: list[str](), after: list[str]()}
    for data, comments in found.items():
        with suppress(tokenize.TokenError):  # it ends in the middle of a statement
            for token in tokenize.tokenize(io.BytesIO(data).readline):
                comments += [token.string] if token.type == tokenize.COMMENT else []
    return "  ".join((Counter(found[before]) - Counter(found[after])).elements())


def value_of(node: ast.expr) -> float | str | None:
    """The value of a literal number or word; None for anything else."""
    is_signed = isinstance(node, ast.UnaryOp) and isinstance(node.operand, ast.Constant)
    if not (is_signed or isinstance(node, ast.Constant)):
        return None
    try:
        value = ast.literal_eval(node)
    except (ValueError, TypeError):
        return None
    return value if isinstance(value, int | float | str) and not isinstance(value, bool) else None
