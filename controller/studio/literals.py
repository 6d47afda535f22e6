"""Where the value of an argument is written: literals in the call, or what its names stand for.

A name is followed to its only value, to the default of a parameter or what a helper's caller gives
for it, and to the element of a literal that a loop is at. An expression hangs on the literals in
it, or on those of its names. What hangs on none is computed.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from controller.studio.syntax import Site, Syntax, value_of
from go2_wbc.curves import Ease
from go2_wbc.errors import StudioError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture

RADIANS = frozenset({"deg", "radians"})  #: Functions that take degrees
MEMBERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "Posture": tuple(one.name for one in Posture),
        "Ease": tuple(one.name for one in Ease),
        "Leg": tuple(leg.name for leg in LEGS),
    }
)
"""Words that are written as members, such as ``Posture.SIT``."""
DEEPEST = 6  #: Names of names that are followed
COMPUTED = "it is computed: change it in the file"
_SCOPES = (ast.FunctionDef, ast.Lambda, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


@dataclass(frozen=True, slots=True)
class Run:
    """Which run of a call is meant."""

    number: int = 0  #: how often the call had run before
    callers: tuple[tuple[Site, int], ...] = ()
    """Calls of helpers that it runs in, the innermost first, and how often they had run."""


@dataclass(frozen=True, slots=True)
class Literal:
    """A literal that a value hangs on."""

    node: ast.expr
    is_angle: bool = False  #: whether it is in degrees
    place: str = ""  #: where it stands, if not in the call itself: "HEIGHT, line 12"
    depth: int = 0  #: how many names lead to it
    is_of_loop: bool = False  #: whether it is another one in each round

    @property
    def is_member(self) -> bool:
        """Whether it is the last word of ``Posture.SIT``."""
        return isinstance(self.node, ast.Attribute)


def literals(syntax: Syntax, node: ast.expr, call: ast.AST, run: Run) -> list[Literal]:
    """The literals that the value of ``node`` hangs on, the most direct one first.

    Args:
        syntax: of the file.
        node: an argument of ``call``, or a part of it.
        call: that is looked at.
        run: of it.

    Raises:
        StudioError: if there is none; says why.
    """
    return _Finder(syntax).found(node, call, run, DEEPEST)


def resolved(syntax: Syntax, node: ast.expr, call: ast.AST, run: Run) -> ast.expr:
    """What ``node`` stands for if it is a name of a tuple, a list or a dictionary; else itself."""
    finder, depth = _Finder(syntax), DEEPEST
    while isinstance(node, ast.Name) and depth:
        try:
            there = finder.bound(node, call, run)
        except StudioError:
            return node
        node, call, run, depth = there.node, there.call, there.run, depth - 1
    return node


@dataclass(frozen=True, slots=True)
class _Bound:
    """What a name stands for, and for which run of which call."""

    node: ast.expr
    call: ast.AST
    run: Run
    is_of_loop: bool = False


class _Finder:
    def __init__(self, syntax: Syntax) -> None:
        self._syntax = syntax

    def found(self, node: ast.expr, call: ast.AST, run: Run, depth: int) -> list[Literal]:
        """See ``literals``."""
        if value_of(node) is not None or _is_member(node):
            return [Literal(node)]
        if isinstance(node, ast.Name):
            if not depth:
                raise StudioError(COMPUTED)
            there = self.bound(node, call, run)
            place = f"{node.id}, line {there.node.lineno}"
            return [
                replace(
                    one,
                    place=place,
                    depth=one.depth + 1,
                    is_of_loop=one.is_of_loop or there.is_of_loop,
                )
                for one in self.found(there.node, there.call, there.run, depth - 1)
            ]
        is_angle = isinstance(node, ast.Call) and self._syntax.name(node) in RADIANS
        every = [one for part in _terms(node) for one in self._of_part(part, call, run, depth)]
        if not every:
            raise StudioError(COMPUTED)
        least = min(one.depth for one in every)
        nearest = [one for one in every if one.depth == 0] if least == 0 else every
        where = "" if is_angle else f"in {self._syntax.node(node)}"
        nearest = [
            replace(one, is_angle=one.is_angle or is_angle, place=one.place or where)
            for one in nearest
        ]
        return sorted(nearest, key=lambda one: one.is_of_loop)

    def _of_part(self, part: ast.expr, call: ast.AST, run: Run, depth: int) -> list[Literal]:
        try:
            every = self.found(part, call, run, depth)
        except StudioError:
            return []
        return [one for one in every if not isinstance(value_of(one.node), str)]

    def bound(self, name: ast.Name, call: ast.AST, run: Run) -> _Bound:
        """What a name stands for: its only value, a parameter's, an element of a loop."""
        syntax = self._syntax
        functions = [one for one in syntax.around(call) if isinstance(one, ast.FunctionDef)]
        for number, function in enumerate(functions):
            own = run if number == 0 else Run()
            found = self._bindings(function, name.id, call, own)
            parameter = self._parameter(function, name.id, call, own)
            if parameter is not None:
                found.append(parameter)
            if found:
                return _only(name.id, found)
        found = self._bindings(syntax.tree, name.id, call, run)
        if not found:
            raise StudioError(f"{name.id} is not set in this file")
        return replace(_only(name.id, found), call=syntax.tree)

    def _parameter(
        self, function: ast.FunctionDef, name: str, call: ast.AST, run: Run
    ) -> _Bound | None:
        """What the caller gives, if that is known, or the default."""
        given = function.args
        every = [*given.posonlyargs, *given.args]
        defaults = [None] * (len(every) - len(given.defaults)) + list(given.defaults)
        known = {item.arg: value for item, value in zip(every, defaults, strict=True)}
        known |= {
            item.arg: value for item, value in zip(given.kwonlyargs, given.kw_defaults, strict=True)
        }
        if name not in known:
            return None
        if run.callers:
            (site, number), *others = run.callers
            outer = self._syntax.call(site)
            if self._syntax.name(outer) == function.name:
                names = [item.arg for item in every]
                words = dict(zip(names, outer.args, strict=False))
                words |= {word.arg: word.value for word in outer.keywords if word.arg}
                if name in words:
                    return _Bound(words[name], outer, Run(number, tuple(others)))
        default = known[name]
        if default is None:
            raise StudioError(f"{name} is what {function.name}() is called with")
        return _Bound(default, call, run)

    def _bindings(self, scope: ast.AST, name: str, call: ast.AST, run: Run) -> list[_Bound]:
        is_module, found = scope is self._syntax.tree, list[_Bound]()
        for node in _within(scope):
            if not isinstance(node, ast.Name) or (node.id, type(node.ctx)) != (name, ast.Store):
                continue
            if is_module and self._syntax.parents[self._syntax.statement(node)] is not scope:
                continue
            value = self._assigned(node, call, run)
            if value is None:
                raise StudioError(f"{name} is computed in line {node.lineno}")
            if not _is_only_of(value.node, name):  # what turns round a value is no other one
                found.append(value)
        return found

    def _assigned(self, name: ast.Name, call: ast.AST, run: Run) -> _Bound | None:
        """What is assigned to a name: a value, its part of a tuple, or what a loop is at."""
        path, target, above = list[int](), self._syntax.parents[name], self._syntax.parents
        inner: ast.AST = name
        while isinstance(target, ast.Tuple | ast.List):
            path.insert(0, target.elts.index(inner))
            inner, target = target, above[target]
        is_of_loop = isinstance(target, ast.For)
        if isinstance(target, ast.Assign | ast.AnnAssign | ast.NamedExpr):
            value = target.value
        elif isinstance(target, ast.For) and target.target is inner:
            value = self._element(target, call, run)
        else:
            return None
        for index in path:
            parts = self._parts(value, call, run)
            value = parts[index] if index < len(parts) else None
        return None if value is None else _Bound(value, call, run, is_of_loop)

    def _element(self, loop: ast.For, call: ast.AST, run: Run) -> ast.expr | None:
        """What a loop is at when the call runs."""
        parts, rounds = self._parts(loop.iter, call, run), 1
        for around in self._syntax.around(call):
            if around is loop:
                return parts[run.number // rounds % len(parts)] if parts else None
            if isinstance(around, ast.For):
                count = self.rounds(around, call, run)
                if count is None:
                    return None
                rounds *= count
        return parts[-1] if parts else None  # behind the loop

    def rounds(self, loop: ast.For, call: ast.AST, run: Run) -> int | None:
        """How often a loop goes round; None if that is computed."""
        numbers = numbers_of(loop.iter)
        if numbers is not None:
            return len(numbers)
        return len(self._parts(loop.iter, call, run)) or None

    def _parts(self, node: ast.expr | None, call: ast.AST, run: Run) -> Sequence[ast.expr]:
        """The elements of a tuple or list that is written out, or has a name; none of another."""
        if isinstance(node, ast.Name):
            node = resolved(self._syntax, node, call, run)
        if isinstance(node, ast.Tuple | ast.List):
            return [] if any(isinstance(one, ast.Starred) for one in node.elts) else node.elts
        return []


def numbers_of(node: ast.expr) -> range | None:
    """The numbers of ``range(...)`` with literals."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
        return None
    values = [value_of(one) for one in node.args]
    if node.func.id != "range" or not values or not all(type(value) is int for value in values):
        return None
    return range(*values)  # type: ignore[arg-type]


def _only(name: str, found: Sequence[_Bound]) -> _Bound:
    if len(found) != 1:
        raise StudioError(f"{name} has more than one value: change it in the file")
    return found[0]


def _terms(node: ast.expr) -> list[ast.expr]:
    """What an expression is made of."""
    if isinstance(node, ast.UnaryOp):
        return [node.operand]
    if isinstance(node, ast.BinOp):
        return [node.left, node.right]
    if isinstance(node, ast.IfExp):
        return [node.body, node.orelse]
    if isinstance(node, ast.Call):
        return [*node.args, *(word.value for word in node.keywords)]
    return []


def _is_member(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.attr in MEMBERS.get(node.value.id, ())
    )


def _is_only_of(node: ast.expr, name: str) -> bool:
    """Whether an expression has no value of its own, but turns round that of ``name``."""
    names = {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}
    return names == {name} and not isinstance(node, ast.Name)


def _within(scope: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a scope, without those of the scopes in it."""
    for child in ast.iter_child_nodes(scope):
        yield child
        if not isinstance(child, _SCOPES):
            yield from _within(child)
