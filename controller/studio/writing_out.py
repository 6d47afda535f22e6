"""A computed part of a motion written out: as the calls that it has made, with their values.

What is replaced is as little as makes the same motion: the arguments of a call, the statement that
has made it, what is around that, or all that the motion does. Which of them do is tried: a text is
taken only if the motion that it makes is the one before, key for key.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from itertools import islice

from controller.studio.literal_calls import Chain, Writer, chains_of
from controller.studio.literals import Run
from controller.studio.making import Made, Maker
from controller.studio.orders import Order
from controller.studio.rewriting import changed, imported, motion_in
from controller.studio.source import Source, parameters
from controller.studio.syntax import Site, Span, lost_comments
from go2_wbc.errors import Go2WbcError, StudioError
from motions.language.timeline_data import TimelineData
from motions.language.tracing import Call, CallMark

SAME = 1e-9  #: s, m or rad by which keys may differ: numbers are written without their rounding
MOST_TRIED = 12  #: texts


def written_out(source: Source, maker: Maker, order: Order, made: Made, bar: int) -> Source:
    """With what has made the call of a bar written out.

    Args:
        source: the text.
        maker: runs it.
        order: to do so.
        made: what it makes.
        bar: its place among the calls.

    Raises:
        StudioError: if that cannot be done; says why.
    """
    path = str(order.path)
    why = "it is made outside of the motion's own function"
    for text in islice(_Parts(source, path, made, made.marks[bar]).texts(), MOST_TRIED):
        try:
            after = text()
            now = maker.make(replace(order, data=after.data))
        except Go2WbcError as error:
            why = str(error)
            continue
        if not _is_same(now.line, made.line):
            why = "the motion would be another one" if not made.notes else " ".join(made.notes)
        elif _is_editable(after, path, now.marks, bar, len(made.marks)):
            return after
        else:
            why = "a value of it would still be computed"
    raise StudioError(f"it cannot be written out: {why}")


def _is_same(one: object, other: object) -> bool:
    """Whether two timelines, or parts of them, are equal but for rounding and functions."""
    if isinstance(one, float) and isinstance(other, float | int):
        return abs(one - other) <= SAME
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        return len(one) == len(other) and all(map(_is_same, one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return {*one} == {*other} and all(_is_same(value, other[key]) for key, value in one.items())
    if is_dataclass(one) and type(one) is type(other):
        names = [item.name for item in fields(one)]
        return all(_is_same(getattr(one, name), getattr(other, name)) for name in names)
    return one == other or (callable(one) and callable(other))


def _is_editable(
    source: Source, path: str, marks: Sequence[CallMark], bar: int, count: int
) -> bool:
    if len(marks) != count or marks[bar].call.file != path:
        return False
    call = marks[bar].call
    return all(slot.span for slot in source.slots(call.site, Run(call.number, call.callers)))


class _Parts:
    """The parts of a motion's function in which a call was made, from the least on."""

    def __init__(self, source: Source, path: str, made: Made, mark: CallMark) -> None:
        self._source, self._syntax, self._path = source, source.syntax, path
        self._chains, self._call = [*chains_of(made.whole)], mark.call
        places = {(one.call.file, one.call.site, one.call.number) for one in made.marks}
        self._runs = sum(place[:2] == (mark.call.file, mark.call.site) for place in places)
        self._function = motion_in(source.syntax, made.motion.name)
        first, *others = self._function.body
        if others and ast.get_docstring(self._function) is not None:
            first, *others = others
        last = (first, *others)[-1]
        self._body = source.syntax.span(first)[0], source.syntax.span(last)[1]

    def texts(self) -> Iterator[Callable[[], Source]]:
        """What gives the text with each of them written out, or raises StudioError."""
        site = self._site(self._call)
        if site is not None:
            if self._call.file == self._path and site == self._call.site and self._runs == 1:
                yield partial(self._with_values, self._syntax.call(site))
            around = [
                one
                for one in ast.walk(self._function)
                if isinstance(one, ast.stmt) and self._is_in(site, self._syntax.span(one))
            ][:0:-1]
            loops = [row for row, one in enumerate(around) if isinstance(one, ast.For | ast.While)]
            for one in around[max(loops, default=0) :]:  # in a loop it would be done again
                yield from self._with_calls(one)
        if len(self._function.decorator_list) == 1:
            first = self._chains[0]
            yield partial(
                self._written, self._body, self._body[0], "return ", first.start, first.calls
            )

    def _site(self, call: Call) -> Site | None:
        """Where the motion's function makes a call, be it by a helper."""
        own = [call.site] if call.file == self._path else []
        for site in reversed([*own, *(site for site, _ in call.callers)]):
            if self._is_in(site, self._body):
                return site
        return None

    def _is_in(self, site: Site, span: Span) -> bool:
        return span[0] < self._syntax.starts[site[0] - 1] + site[1] <= span[1]

    def _with_values(self, call: ast.Call) -> Source:
        """With the values of the arguments that are computed."""
        writer, given = Writer(self._syntax), self._call.arguments
        slots = self._source.slots(self._call.site, Run(self._call.number, self._call.callers))
        computed = {slot.of for slot in slots if slot.span is None}
        start, end = self._syntax.span(call)
        left = self._left(start)
        if not computed:
            raise StudioError("nothing of it is computed")
        if computed & {"*", "**"}:
            start = self._syntax.data.index(b"(", self._syntax.span(call.func)[1]) + 1
            text = ", ".join(writer.arguments(self._call, left))
            return self._replaced((start, end - 1), text, writer, start)
        nodes = [*zip(parameters(self._call.name), call.args, strict=False)]
        nodes += [(word.arg, word.value) for word in call.keywords if word.arg]
        changes = [
            (self._syntax.span(node), self._lines(writer.value(name, given[name], left)))
            for name, node in nodes
            if name in computed
        ]
        return imported(changed(self._source, changes), writer.missing)

    def _with_calls(self, node: ast.stmt) -> Iterator[Callable[[], Source]]:
        """With the calls that were made in a statement, on each name that this may be on."""
        span = self._syntax.span(node)
        start, calls = next(
            filter(None, (self._made_in(one, span) for one in self._chains)), (None, ())
        )
        nodes = [*ast.walk(node)]
        names = [one for one in nodes if isinstance(one, ast.Name)]
        stored = dict.fromkeys(one.id for one in names if isinstance(one.ctx, ast.Store))
        loaded = dict.fromkeys(one.id for one in names if isinstance(one.ctx, ast.Load))
        if not calls:
            return
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.Return) and node.value is not None:
            for head in [start] if start else [*stored, *loaded]:
                value = self._syntax.span(node.value)
                yield partial(self._written, value, span[0], "", head, calls)
        elif not any(isinstance(one, ast.Return) for one in nodes):
            for name in stored:
                yield partial(self._written, span, span[0], f"{name} = ", start or name, calls)

    def _written(
        self, span: Span, at: int, before: str, head: TimelineData | str, calls: Sequence[Call]
    ) -> Source:
        """With calls on ``head`` in a part of the statement that begins at a byte."""
        writer, left = Writer(self._syntax), self._left(at)
        first = head if isinstance(head, str) else writer.start(head, left)
        return self._replaced(span, before + writer.chain(first, calls, left), writer, at)

    def _made_in(
        self, chain: Chain, span: Span
    ) -> tuple[TimelineData | None, Sequence[Call]] | None:
        """The calls of a chain that were made there, and what it begins with if they do."""
        sites = [self._site(call) for call in chain.calls]
        rows = [row for row, site in enumerate(sites) if site and self._is_in(site, span)]
        if not rows or rows[-1] - rows[0] >= len(rows):
            return None
        return None if rows[0] else chain.start, chain.calls[rows[0] : rows[-1] + 1]

    def _replaced(self, span: Span, text: str, writer: Writer, statement: int) -> Source:
        """With ``text`` there; comments that are lost go above the statement."""
        after = self._source.replaced(span, self._lines(text))
        lost = lost_comments(self._source.data, after.data)
        left = self._left(statement)
        line = self._syntax.starts[self._syntax.site(statement)[0] - 1]
        if lost and line + len(left) == statement:
            after = after.replaced((line, line), self._lines(f"{left}{lost}\n"))
        return imported(after, writer.missing)

    def _lines(self, text: str) -> str:
        return text.replace("\n", self._syntax.line_end)

    def _left(self, at: int) -> str:
        """The white space at the start of the line of a byte."""
        start = self._syntax.starts[self._syntax.site(at)[0] - 1]
        text = self._syntax.text((start, at))
        return text[: len(text) - len(text.lstrip())]
