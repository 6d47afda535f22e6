"""An author's file as text in which calls and their arguments have places that can be replaced.

Places are spans of bytes, so that what is not edited stays as it is: comments, layout, line ends.
A call is known by where it ends (see ``motions.language.tracing``).
"""

from __future__ import annotations

import ast
import functools
import inspect
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

from controller.studio.layout import placed, tail
from controller.studio.literals import MEMBERS, Literal, Run, literals, resolved
from controller.studio.syntax import Site, Span, syntax_of, value_of
from go2_wbc.errors import StudioError, unknown_name
from motions import Timeline

DEGREES = "deg"  #: the function of the language that takes them
ANGLES = frozenset({"roll", "pitch", "yaw", "angle", "turn"})
"""Arguments that are added in degrees; the joints of a leg stay in radians."""
MOTIONS = frozenset({"others", "other"})  #: Arguments that are motions: their calls are bars
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
    of: str = ""  #: the parameter that it is of, or in
    is_member: bool = False  #: whether the word is written as a member, such as ``Posture.SIT``
    is_choice: bool = False  #: whether it is one of the two of ``a if x else b``
    plays: bool | None = None  #: whether that one is it in this run; None where that is not known


@final
class Source:
    """The text of a file.

    Attributes:
        data: its bytes.
        syntax: its tree.
        site: of the call that an edit has changed or made; None where it has gone.
    """

    def __init__(self, data: bytes, end: int | None = None) -> None:
        """Read it; the call of ``site`` ends before byte ``end``.

        Raises:
            StudioError: if it is not Python; says the line.
        """
        self.data, self.syntax = data, syntax_of(data)
        self.site = None if end is None else self.syntax.site(end)

    def slots(self, site: Site, run: Run | None = None) -> list[Slot]:
        """The arguments that are written in a call, in order; by default when it first runs.

        Raises:
            StudioError: if no call ends there.
        """
        call, run = self._call(site), run or Run()
        return [
            slot
            for name, node in self._arguments(call, run)
            for slot in self._slots(call, name, name, node, run)
        ]

    def set(self, site: Site, name: str, value: float | str, run: Run | None = None) -> Source:
        """With an argument's literal replaced, or the argument added; what is no number is quoted.

        Args:
            site: of the call.
            name: of a slot of it, or of a parameter.
            value: in degrees where a literal in ``deg`` is replaced, or an angle added as one.
            run: that is meant, of a call in a loop or in a helper.

        Raises:
            StudioError: for an argument that is computed, or one that the call does not take.
        """
        for slot in self.slots(site, run):
            if slot.name == name:
                if slot.span is None:
                    raise StudioError(f"{name} is {slot.code}: {slot.why}")
                text = self._member(slot, value) or written(value, self._text(slot.span))
                _, end = self._span(self._call(site))
                longer = len(text.encode()) - (slot.span[1] - slot.span[0])
                return self.replaced(slot.span, text, end + longer * (slot.span[0] < end))
        return self._added(site, name, value)

    def _member(self, slot: Slot, value: float | str) -> str:
        """The word if the slot is a member's; empty if it is not."""
        for words in MEMBERS.values() if slot.is_member else ():
            if slot.value in words:
                if value not in words:
                    raise StudioError(unknown_name(slot.name, str(value), words))
                return str(value)
        return ""

    def delete(self, site: Site) -> Source:
        """Without a call; its statement goes too if nothing is left of it."""
        call = self._call(site)
        start, end = self._link(call)
        statement = self._statement(call)
        if isinstance(statement, ast.Assign) and statement.value is call:
            (target,), rest = statement.targets, self._receiver(call)
            if isinstance(target, ast.Name) and self._node(rest) == self._node(target):
                return self._without_statement(statement)
        return self.replaced((start, tail(self.data, end)), "")

    def duplicate(self, site: Site) -> Source:
        """With a call made twice, one after the other."""
        return self._behind(self._call(site), self._text(self._link(self._call(site))))

    def insert(self, site: Site, code: str) -> Source:
        """With ``code``, such as ``.hold(0.5)``, behind a call, laid out as that is."""
        call = self._call(site)
        layout = re.match(r"\s*", self._text(self._link(call)))
        return self._behind(call, (layout[0] if layout else "") + code)

    def parted(self, site: Site, first: str, second: str) -> Source:
        """With two calls in the place of one; the second is laid out as that."""
        start, end = self._link(self._call(site))
        start = self._dot(start)
        source = self.replaced((start, end), first, start + len(first.encode()))
        return source.insert(source.site or site, second)

    def arguments(self, site: Site) -> list[tuple[str, str, bool]]:
        """Those of a call as they are written: name, text, and whether the name stands there.

        Raises:
            StudioError: for a call of ``*`` or ``**``.
        """
        call = self._call(site)
        if any(isinstance(node, ast.Starred) for node in call.args):
            raise StudioError(f"{self._name(call)}() is called with what a * stands for")
        takes = parameters(self._name(call))
        found = [(n, self._whole(one), False) for n, one in zip(takes, call.args, strict=False)]
        for word in call.keywords:
            if word.arg is None:
                raise StudioError(f"{self._name(call)}() is called with what ** stands for")
            found.append((word.arg, self._whole(word.value), True))
        return found

    def _whole(self, node: ast.expr) -> str:
        """Its text, with the brackets that it needs."""
        return f"({self._node(node)})" if isinstance(node, ast.NamedExpr) else self._node(node)

    def offset(self, site: Site) -> int:
        """The first byte behind a call."""
        return self._span(self._call(site))[1]

    def text(self, site: Site) -> str:
        """A call as it is written, such as ``.hold(0.5)``."""
        return self._text(self._link(self._call(site))).strip()

    def _behind(self, call: ast.Call, text: str) -> Source:
        """With ``text`` behind a call; where the line would be long, on one of its own."""
        return self.replaced(*placed(self.syntax, call, self._link(call)[1], text))

    def swap(self, site: Site, step: int) -> Source:
        """With a call exchanged for the one before (-1) or after it (1) in its chain."""
        call = self._call(site)
        other = self._receiver(call) if step < 0 else self._next(call)
        if not (isinstance(other, ast.Call) and isinstance(other.func, ast.Attribute)):
            where = "first" if step < 0 else "last"
            raise StudioError(f"{self._name(call)}() is the {where} call of its chain")
        links = sorted([self._link(call), self._link(other)])
        first, second = ((start, tail(self.data, end)) for start, end in links)
        is_last = self.data[second[1] : second[1] + 1] in (b"", b"\r", b"\n")  # of its line
        if not is_last or any(self._text(link)[0] not in "\r\n" for link in links):
            # a comment would swallow what came behind it: layout and comments stay
            first, second = links = [(self._dot(start), end) for start, end in links]
        middle = self._text((first[1], second[0]))
        (_, one), (_, other_end) = links
        # Where the two end then, their comments left out.
        moved = second[1] - (first[1] - one) if step > 0 else first[0] + other_end - second[0]
        return self.replaced(
            (first[0], second[1]), self._text(second) + middle + self._text(first), moved
        )

    def noted(self, comment: str) -> Source:
        """With a comment in the line where the call of ``site`` ends, if that may have one."""
        if self.site is None or not comment:
            return self
        line = re.compile(rb"[^\r\n]*").match(self.data, self.syntax.starts[self.site[0] - 1])
        end, at = line.end() if line else 0, self.offset(self.site)
        try:
            noted = self.replaced((end, end), f"  {comment}", at)
        except StudioError:  # behind a backslash
            return self
        is_same = ast.dump(noted.syntax.tree) == ast.dump(self.syntax.tree)
        return noted if is_same else self  # in a text it would be a part of it

    def append(self, motion: str, code: str) -> Source:
        """With ``code``, such as ``.scale_time(1.2)``, behind what a motion returns.

        Raises:
            StudioError: for a motion that returns in several places, or is not in this file.
        """
        returns = [
            node.value
            for function in self.syntax.tree.body
            if isinstance(function, ast.FunctionDef) and function.name == motion
            for node in ast.walk(function)
            if isinstance(node, ast.Return) and node.value is not None
        ]
        if len(returns) != 1:
            raise StudioError(f"{motion} returns in {len(returns)} places: append {code} by hand")
        node, (start, end) = returns[0], self._span(returns[0])
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            return Source(self.insert(self.syntax.site(end), code).data)
        if isinstance(node, ast.Call | ast.Name | ast.Attribute):
            return self.replaced((end, end), code)
        return self.replaced((start, end), f"({self._text((start, end))}){code}")

    def argument(self, name: str, value: float | str) -> str:
        """An argument as text, such as ``yaw=deg(10.0)``; in radians where ``deg`` is unknown."""
        return f"{name}={self.value(name, value)}"

    def value(self, name: str, value: float | str) -> str:
        """The value of an argument of this name as text."""
        if name not in ANGLES or isinstance(value, str):
            return written(value)
        degrees = self.syntax.called(DEGREES)
        return f"{degrees}({written(value)})" if degrees else written(math.radians(value))

    # --- where things are -----------------------------------------------------------------

    def _call(self, site: Site) -> ast.Call:
        return self.syntax.call(site)

    def _next(self, call: ast.Call) -> ast.AST | None:
        above = self.syntax.parents[call]
        return self.syntax.parents[above] if isinstance(above, ast.Attribute) else None

    def _receiver(self, call: ast.Call) -> ast.expr:
        if not isinstance(call.func, ast.Attribute):
            raise StudioError(f"{self._node(call)} has a name of its own: change it in the file")
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

    def _name_start(self, call: ast.Call) -> int:
        return self._span(call.func)[1] - len(self._name(call).encode())

    def _name(self, call: ast.Call) -> str:
        return self.syntax.name(call)

    def _span(self, node: ast.expr | ast.stmt) -> Span:
        return self.syntax.span(node)

    def _text(self, span: Span) -> str:
        return self.syntax.text(span)

    def _node(self, node: ast.expr) -> str:
        return self.syntax.node(node)

    def _statement(self, node: ast.AST) -> ast.stmt:
        return self.syntax.statement(node)

    def replaced(self, span: Span, text: str, end: int | None = None) -> Source:
        """With ``text`` in the place of a span; the call of ``site`` ends before byte ``end``."""
        return Source(self.data[: span[0]] + text.encode() + self.data[span[1] :], end)

    def _without_statement(self, statement: ast.stmt) -> Source:
        above = self.syntax.parents[statement]
        body = next(
            block
            for name in ("body", "orelse", "finalbody")
            if statement in (block := getattr(above, name, []))
        )
        span = self._span(statement)
        if len(body) == 1:
            return self.replaced(span, "pass")
        start, end = self.syntax.starts[statement.lineno - 1], statement.end_lineno or 0
        stop = self.syntax.starts[end] if end < len(self.syntax.starts) else len(self.data)
        if self.data[start : span[0]].strip() or self.data[span[1] : stop].strip():
            return self.replaced(span, "pass")  # others share its line
        return self.replaced((start, stop), "")

    # --- arguments ------------------------------------------------------------------------

    def _arguments(self, call: ast.Call, run: Run) -> Iterator[tuple[str, ast.expr]]:
        takes = parameters(self._name(call))
        for name, node in zip(takes, call.args, strict=False):
            if isinstance(node, ast.Starred):
                yield "*", node
                break
            yield name, node
        for word in call.keywords:
            several = None if word.arg else resolved(self.syntax, word.value, call, run)
            if isinstance(several, ast.Dict):
                yield from _items(several)
            else:
                yield word.arg or "**", word.value

    def _slots(
        self, call: ast.Call, of: str, name: str, node: ast.expr, run: Run
    ) -> Iterator[Slot]:
        """Those of an argument; of a tuple, a list or a dictionary those of its elements."""
        code = self._node(node)
        if of in MOTIONS:
            return
        whole = resolved(self.syntax, node, call, run)
        if isinstance(whole, ast.Tuple | ast.List) and whole.elts:
            for index, element in enumerate(whole.elts):
                yield from self._slots(call, of, f"{name}[{index}]", element, run)
            return
        if isinstance(whole, ast.Dict) and whole.keys:
            for key, element in _items(whole):
                yield from self._slots(call, of, f"{name}.{key}", element, run)
            return
        try:
            found = literals(self.syntax, node, call, run)
        except StudioError as error:
            yield Slot(name, code, why=str(error), of=of)
            return
        for number, literal in enumerate(found):
            own = name if number == 0 else f"{name}: {number + 1}. {literal.place}"
            yield self._slot(own, code, literal, of)

    def _slot(self, name: str, code: str, literal: Literal, of: str) -> Slot:
        span, value = self._span(literal.node), value_of(literal.node)
        if isinstance(literal.node, ast.Attribute):
            value = literal.node.attr
            span = span[1] - len(value), span[1]
        return Slot(
            name,
            code,
            span,
            value,
            literal.is_angle,
            literal.place,
            of=of,
            is_member=literal.is_member,
            is_choice=literal.is_choice,
        )

    def _added(self, site: Site, name: str, value: float | str) -> Source:
        call = self._call(site)
        takes = parameters(self._name(call))
        if name not in takes:
            raise StudioError(f"{self._name(call)}(): {unknown_name('argument', name, takes)}")
        given = [*call.args, *(word.value for word in call.keywords)]
        at = max([self._span(node)[1] for node in given], default=0)
        text = f", {self.argument(name, value)}" if at else self.argument(name, value)
        end = self._span(call)[1]
        own = re.compile(rb"(\s*\))*").match(self.data, at, end - 1)  # brackets round the last one
        at = own.end() if at and own else self.data.index(b"(", self._name_start(call)) + 1
        return self.replaced((at, at), text, end + len(text.encode()))


def first_parameters(name: str) -> list[str]:
    """Those that are given by their places: the ones that a call needs, if they may be."""
    given = inspect.signature(getattr(Timeline, name)).parameters.values()
    needed = (one for one in given if one.default is one.empty)
    return [one.name for one in needed if one.kind is one.POSITIONAL_OR_KEYWORD]


@functools.cache
def parameters(name: str) -> tuple[str, ...]:
    """The parameters of a call of a timeline; none for another function."""
    method = getattr(Timeline, name, None)
    return tuple(inspect.signature(method).parameters)[1:] if callable(method) else ()


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


def _items(node: ast.Dict) -> Iterator[tuple[str, ast.expr]]:
    """The values of a dictionary by their keys."""
    for key, value in zip(node.keys, node.values, strict=True):
        yield str(value_of(key)) if key is not None else "**", value
