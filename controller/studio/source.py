"""An author's file as text in which calls and their arguments have places that can be replaced.

Places are spans of bytes, so that what is not edited stays as it is: comments, layout, line ends.
A call is known by where it ends (see ``motions.language.tracing``).
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import final

from go2_wbc.errors import StudioError, unknown_name
from motions import Timeline

Site = tuple[int, int]  #: line from 1 and column [bytes] from 0 at which a call ends
Span = tuple[int, int]  #: first byte, and the first after it
DEGREES = "deg"  #: the function of the language that takes them
ANGLES = frozenset({"roll", "pitch", "yaw", "angle", "turn"})
"""Arguments that are added in degrees; the joints of a leg stay in radians."""
LONGEST_LINE = 100  #: characters; an inserted call that would make it longer gets its own line
_DIGITS = 4  #: decimals that an edit may add


@dataclass(frozen=True, slots=True)
class Slot:
    """An argument of a call, as it is written."""

    name: str  #: of the parameter
    code: str  #: the text of it
    span: Span | None = None  #: of the literal that can be replaced; None where none can
    value: float | str | None = None  #: of the literal, in degrees where it stands in ``deg``
    is_angle: bool = False  #: whether ``value`` is in degrees
    place: str = ""  #: where the literal stands if not in the call itself: "HEIGHT, line 12"
    why: str = ""  #: why it cannot be replaced


@final
class Source:
    """The text of a file.

    Attributes:
        data: its bytes.
        site: of the call that an edit has changed or made; None where it has gone.
    """

    def __init__(self, data: bytes, end: int | None = None) -> None:
        """Read it; the call of ``site`` ends before byte ``end``.

        Raises:
            StudioError: if it is not Python; says the line.
        """
        self.data = data
        try:
            self._tree = ast.parse(data)
        except (SyntaxError, ValueError) as error:
            line = f"line {error.lineno}: " if isinstance(error, SyntaxError) else ""
            raise StudioError(f"{line}{error.args[0]}") from error
        bom = 3 if data.startswith(b"\xef\xbb\xbf") else 0
        ends = [match.end() for match in re.finditer(rb"\r\n|\r|\n", data)]
        self._starts = [bom, *ends]
        self.site: Site | None = None
        if end is not None:
            line = bisect_right(self._starts, end)
            self.site = (line, end - self._starts[line - 1])

    def slots(self, site: Site, number: int = 0) -> list[Slot]:
        """The arguments that are written in a call, in order, for the ``number``-th time it runs.

        Raises:
            StudioError: if no call ends there.
        """
        call = self._call(site)
        return [self._slot(call, name, node, number) for name, node in self._arguments(call)]

    def set(self, site: Site, name: str, value: float | str, number: int = 0) -> Source:
        """With an argument's literal replaced, or the argument added; what is no number is quoted.

        Args:
            site: of the call.
            name: of the parameter.
            value: in degrees where a literal in ``deg`` is replaced, or an angle added as one.
            number: of the run that is meant, of a call in a loop.

        Raises:
            StudioError: for an argument that is computed, or one that the call does not take.
        """
        for slot in self.slots(site, number):
            if slot.name == name:
                if slot.span is None:
                    raise StudioError(f"{name} is {slot.code}: {slot.why}")
                text = written(value, self._text(slot.span))
                _, end = self._span(self._call(site))
                longer = len(text.encode()) - (slot.span[1] - slot.span[0])
                return self._replaced(slot.span, text, end + longer * (slot.span[0] < end))
        return self._added(site, name, value)

    def delete(self, site: Site) -> Source:
        """Without a call; its statement goes too if nothing is left of it."""
        call = self._call(site)
        start, end = self._link(call)
        statement = self._statement(call)
        if isinstance(statement, ast.Assign) and statement.value is call:
            (target,), rest = statement.targets, self._receiver(call)
            if isinstance(target, ast.Name) and self._node(rest) == self._node(target):
                return self._without_statement(statement)
        return self._replaced((start, self._tail(end)), "")

    def duplicate(self, site: Site) -> Source:
        """With a call made twice, one after the other."""
        return self._behind(self._call(site), self._text(self._link(self._call(site))))

    def insert(self, site: Site, code: str) -> Source:
        """With ``code``, such as ``.hold(0.5)``, behind a call, laid out as that is."""
        call = self._call(site)
        layout = re.match(r"\s*", self._text(self._link(call)))
        return self._behind(call, (layout[0] if layout else "") + code)

    def offset(self, site: Site) -> int:
        """The first byte behind a call."""
        return self._span(self._call(site))[1]

    def text(self, site: Site) -> str:
        """A call as it is written, such as ``.hold(0.5)``."""
        return self._text(self._link(self._call(site))).strip()

    def _behind(self, call: ast.Call, text: str) -> Source:
        """With ``text`` behind a call; as a statement of its own where the line would be long."""
        (_, end), statement = self._link(call), self._statement(call)
        if text[:1] in "\r\n":
            end = self._tail(end)
        elif isinstance(statement, ast.Assign) and statement.value is call:
            (start, _), (target,) = self._span(statement), statement.targets
            first = self._starts[statement.lineno - 1]
            if isinstance(target, ast.Name) and end - first + len(text) > LONGEST_LINE:
                break_ = "\r\n" if b"\r\n" in self.data else "\n"
                text = f"{break_}{self._text((first, start))}{target.id} = {target.id}{text}"
                end = self._tail(end)
        return self._replaced((end, end), text, end + len(text.encode()))

    def swap(self, site: Site, step: int) -> Source:
        """With a call exchanged for the one before (-1) or after it (1) in its chain."""
        call = self._call(site)
        other = self._receiver(call) if step < 0 else self._next(call)
        if not (isinstance(other, ast.Call) and isinstance(other.func, ast.Attribute)):
            where = "first" if step < 0 else "last"
            raise StudioError(f"{self._name(call)}() is the {where} call of its chain")
        links = sorted([self._link(call), self._link(other)])
        if all(self._text(link)[0] in "\r\n" for link in links):  # their comments go with them
            first, second = ((start, self._tail(end)) for start, end in links)
        else:  # a comment would swallow what came behind it: layout and comments stay
            first, second = links = [(self._dot(start), end) for start, end in links]
        middle = self._text((first[1], second[0]))
        (_, one), (_, other_end) = links
        # Where the two end then, their comments left out.
        moved = second[1] - (first[1] - one) if step > 0 else first[0] + other_end - second[0]
        return self._replaced(
            (first[0], second[1]), self._text(second) + middle + self._text(first), moved
        )

    def append(self, motion: str, code: str) -> Source:
        """With ``code``, such as ``.scale_time(1.2)``, behind what a motion returns.

        Raises:
            StudioError: for a motion that returns in several places, or is not in this file.
        """
        returns = [
            node.value
            for function in self._tree.body
            if isinstance(function, ast.FunctionDef) and function.name == motion
            for node in ast.walk(function)
            if isinstance(node, ast.Return) and node.value is not None
        ]
        if len(returns) != 1:
            raise StudioError(f"{motion} returns in {len(returns)} places: append {code} by hand")
        start, end = self._span(returns[0])
        if isinstance(returns[0], ast.Call | ast.Name | ast.Attribute):
            return self._replaced((end, end), code)
        return self._replaced((start, end), f"({self._text((start, end))}){code}")

    def argument(self, name: str, value: float | str) -> str:
        """An argument as text, such as ``yaw=deg(10.0)``; in radians where ``deg`` is unknown."""
        return f"{name}={self.value(name, value)}"

    def value(self, name: str, value: float | str) -> str:
        """The value of an argument of this name as text."""
        if name not in ANGLES or isinstance(value, str):
            return written(value)
        if any(isinstance(node, ast.alias) and node.name == DEGREES for node in self._nodes):
            return f"{DEGREES}({written(value)})"
        return written(math.radians(value))

    # --- where things are -----------------------------------------------------------------

    def _call(self, site: Site) -> ast.Call:
        for node in self._nodes:
            if isinstance(node, ast.Call) and (node.end_lineno, node.end_col_offset) == site:
                return node
        raise StudioError(f"no call ends in line {site[0]}: the file has changed")

    @cached_property
    def _nodes(self) -> list[ast.AST]:
        return list(ast.walk(self._tree))

    @cached_property
    def _parents(self) -> dict[ast.AST, ast.AST]:
        return {child: node for node in self._nodes for child in ast.iter_child_nodes(node)}

    def _next(self, call: ast.Call) -> ast.AST | None:
        above = self._parents[call]
        return self._parents[above] if isinstance(above, ast.Attribute) else None

    def _receiver(self, call: ast.Call) -> ast.expr:
        if not isinstance(call.func, ast.Attribute):
            raise StudioError(f"{self._node(call)} is not called on a timeline")
        return call.func.value

    def _link(self, call: ast.Call) -> Span:
        """The part of a chain that is a call, with the white space before it."""
        _, start = self._span(self._receiver(call))
        _, end = self._span(call)
        before = self.data[start : self._name_start(call)]
        other = list(re.finditer(rb"#[^\r\n]*|\)", before))  # a bracket around the rest
        return start + (other[-1].end() if other else 0), end

    def _dot(self, start: int) -> int:
        """Where a link of a chain begins, behind the white space."""
        return start + len(self.data[start:]) - len(self.data[start:].lstrip())

    def _tail(self, end: int) -> int:
        """The end of the comment on the line that ends in ``end``."""
        match = re.compile(rb"[ \t]*#[^\r\n]*").match(self.data, end)
        return match.end() if match else end

    def _name_start(self, call: ast.Call) -> int:
        return self._span(call.func)[1] - len(self._name(call).encode())

    def _name(self, call: ast.Call) -> str:
        return call.func.attr if isinstance(call.func, ast.Attribute) else self._node(call.func)

    def _span(self, node: ast.expr | ast.stmt) -> Span:
        start = self._starts[node.lineno - 1] + node.col_offset
        return start, self._starts[(node.end_lineno or 1) - 1] + (node.end_col_offset or 0)

    def _text(self, span: Span) -> str:
        return self.data[slice(*span)].decode()

    def _node(self, node: ast.expr) -> str:
        return self._text(self._span(node))

    def _statement(self, node: ast.AST) -> ast.stmt:
        while not isinstance(node, ast.stmt):
            node = self._parents[node]
        return node

    def _replaced(self, span: Span, text: str, end: int | None = None) -> Source:
        return Source(self.data[: span[0]] + text.encode() + self.data[span[1] :], end)

    def _without_statement(self, statement: ast.stmt) -> Source:
        above = self._parents[statement]
        body = next(
            block
            for name in ("body", "orelse", "finalbody")
            if statement in (block := getattr(above, name, []))
        )
        span = self._span(statement)
        if len(body) == 1:
            return self._replaced(span, "pass")
        start, end = self._starts[statement.lineno - 1], statement.end_lineno or 0
        stop = self._starts[end] if end < len(self._starts) else len(self.data)
        if self.data[start : span[0]].strip() or self.data[span[1] : stop].strip():
            return self._replaced(span, "pass")  # others share its line
        return self._replaced((start, stop), "")

    # --- arguments ------------------------------------------------------------------------

    def _arguments(self, call: ast.Call) -> Iterator[tuple[str, ast.expr]]:
        for name, node in zip(parameters(self._name(call)), call.args, strict=False):
            if isinstance(node, ast.Starred):
                return
            yield name, node
        yield from ((word.arg, word.value) for word in call.keywords if word.arg is not None)

    def _slot(self, call: ast.Call, name: str, node: ast.expr, number: int) -> Slot:
        code = self._node(node)
        try:
            literal, is_angle, place = self._literal(node, call, number)
        except StudioError as error:
            return Slot(name, code, why=str(error))
        return Slot(name, code, self._span(literal), _value(literal), is_angle, place)

    def _literal(
        self, node: ast.expr, call: ast.AST, number: int, depth: int = 4
    ) -> tuple[ast.expr, bool, str]:
        """The one literal that an argument's value hangs on, whether it is in degrees, and where.

        Raises:
            StudioError: if there is none, or there are several.
        """
        if _value(node) is not None:
            return node, False, ""
        if isinstance(node, ast.Call) and len(node.args) == 1 and self._name(node) == DEGREES:
            literal, _, place = self._literal(node.args[0], call, number, depth)
            return literal, True, place
        if isinstance(node, ast.Name) and depth:
            bound, where = self._bound(node, call, number)
            literal, is_angle, _ = self._literal(bound, where, number, depth - 1)
            return literal, is_angle, f"{node.id}, line {bound.lineno}"
        if isinstance(node, ast.BinOp | ast.UnaryOp):
            sides = [node.operand] if isinstance(node, ast.UnaryOp) else [node.left, node.right]
            found = [side for side in sides if not isinstance(side, ast.Name)] or sides
            if len(found) == 1:
                literal, is_angle, place = self._literal(found[0], call, number, depth)
                return literal, is_angle, place or f"in {self._node(node)}"
        raise StudioError("it is computed: change it in the file")

    def _bound(self, name: ast.Name, call: ast.AST, number: int) -> tuple[ast.expr, ast.AST]:
        """What a name stands for, and where: its only value, a default, an element of a loop."""
        scopes: list[ast.AST] = [self._tree]
        node: ast.AST = call
        while (node := self._parents.get(node, self._tree)) is not self._tree:
            if isinstance(node, ast.FunctionDef):
                scopes.insert(len(scopes) - 1, node)
        for scope in scopes:
            found = list(self._bindings(scope, name.id, number))
            if len(found) == 1 and found[0] is not None:
                return found[0], scope if scope is self._tree else call
            if found:
                raise StudioError(f"{name.id} has more than one value: change it in the file")
        raise StudioError(f"{name.id} is not set in this file")

    def _bindings(self, scope: ast.AST, name: str, number: int) -> Iterator[ast.expr | None]:
        if isinstance(scope, ast.FunctionDef):
            given = scope.args
            every = [*given.posonlyargs, *given.args]
            defaults = [None] * (len(every) - len(given.defaults)) + list(given.defaults)
            pairs = [*zip(every, defaults, strict=True)]
            pairs += zip(given.kwonlyargs, given.kw_defaults, strict=True)
            yield from (default for item, default in pairs if item.arg == name)
        is_module = scope is self._tree
        for node in ast.walk(scope):
            if not isinstance(node, ast.Name) or (node.id, type(node.ctx)) != (name, ast.Store):
                continue
            if not is_module or self._parents[self._statement(node)] is scope:
                yield self._assigned(node, number)

    def _assigned(self, name: ast.Name, number: int) -> ast.expr | None:
        """What is assigned to a name: a value, its part of a tuple, or a loop's ``number``-th."""
        target, above = self._parents[name], self._parents
        index = target.elts.index(name) if isinstance(target, ast.Tuple) else None
        around = target if index is None else above[target]
        if isinstance(around, ast.Assign | ast.AnnAssign):
            value = around.value
        elif isinstance(around, ast.For) and (parts := self._parts(around.iter)):
            value = parts[number % len(parts)]
        else:
            return None
        if index is None or value is None:
            return value
        parts = self._parts(value)
        return parts[index] if index < len(parts) else None

    def _parts(self, node: ast.expr) -> list[ast.expr]:
        """The elements of a tuple or list that is written out, or has a name; none of another."""
        if isinstance(node, ast.Name):
            found = list(self._bindings(self._tree, node.id, 0))
            node = found[0] if len(found) == 1 and found[0] is not None else node
        return node.elts if isinstance(node, ast.Tuple | ast.List) else []

    def _added(self, site: Site, name: str, value: float | str) -> Source:
        call = self._call(site)
        takes = parameters(self._name(call))
        if name not in takes:
            raise StudioError(f"{self._name(call)}(): {unknown_name('argument', name, takes)}")
        at = max([self._span(node)[1] for _, node in self._arguments(call)], default=0)
        text = f", {self.argument(name, value)}" if at else self.argument(name, value)
        at = at or self.data.index(b"(", self._name_start(call)) + 1
        return self._replaced((at, at), text, self._span(call)[1] + len(text.encode()))


def first_parameters(name: str) -> list[str]:
    """Those that are given by their places: the ones that a call needs, if they may be."""
    given = inspect.signature(getattr(Timeline, name)).parameters.values()
    needed = (one for one in given if one.default is one.empty)
    return [one.name for one in needed if one.kind is one.POSITIONAL_OR_KEYWORD]


def parameters(name: str) -> list[str]:
    """The parameters of a call of a timeline; none for another function."""
    method = getattr(Timeline, name, None)
    return list(inspect.signature(method).parameters)[1:] if callable(method) else []


def written(value: float | str, before: str = "") -> str:
    """A value as Python text, in the quotes, or as whole, as ``before``."""
    if isinstance(value, str):
        quote = before[:1] if before[:1] in ("'", '"') else '"'
        if re.fullmatch(r"[\w .-]*", value) is None:
            raise StudioError(f"{value!r} is not a word of letters, digits, dots and spaces")
        return f"{quote}{value}{quote}"
    if before and re.fullmatch(r"[-+]?\d+", before) and float(value).is_integer():
        return str(int(value))
    return str(round(float(value), _DIGITS) + 0.0)


def _value(node: ast.expr) -> float | str | None:
    """The value of a literal number or word; None for anything else."""
    is_signed = isinstance(node, ast.UnaryOp) and isinstance(node.operand, ast.Constant)
    if not (is_signed or isinstance(node, ast.Constant)):
        return None
    try:
        value = ast.literal_eval(node)
    except (ValueError, TypeError):
        return None
    return value if isinstance(value, int | float | str) and not isinstance(value, bool) else None
