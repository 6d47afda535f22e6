"""Where the value of an argument is written: literals in the call, or what its names stand for.

A name is followed to its only value, to the default of a parameter or what a helper's caller gives
for it, and to the element of a literal that a loop is at. An expression hangs on the literals in
it, or on those of its names. What hangs on none is computed.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType

from controller.studio.expressions import (
    constant_of,
    function_of,
    is_only_of,
    is_set_to,
    named,
    numbers_of,
    terms,
    tuple_of,
    values_of,
    written_out,
)
from controller.studio.syntax import Site, Syntax, value_of
from go2_wbc.curves import Ease
from go2_wbc.errors import StudioError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture

RADIANS = frozenset({"deg", "radians", "deg2rad"})  #: Functions that take degrees
MEMBERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "Posture": tuple(one.name for one in Posture),
        "Ease": tuple(one.name for one in Ease),
        "Leg": tuple(leg.name for leg in LEGS),
    }
)
"""Words that are written as members, such as ``Posture.SIT``."""
DEEPEST = 6  #: Names of names that are followed
MOST_STEPS = 100  #: from name to name, of one argument: a field may stand for itself
COMPUTED = "it is computed: change it in the file"


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
    is_choice: bool = False  #: whether it is one of the two of ``a if x else b``

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
    """What ``node`` stands for if that is a tuple, a list or a dictionary; else itself."""
    whole = _Finder(syntax).end_of(node, call, run).node
    return whole if isinstance(whole, ast.Tuple | ast.List | ast.Dict) else node


def elements(syntax: Syntax, node: ast.expr, call: ast.AST, run: Run) -> Sequence[ast.expr]:
    """What a loop goes through, where that is written out; some of it may stand nowhere."""
    return _Finder(syntax).parts(node, call, run)


@dataclass(frozen=True, slots=True)
class _Bound:
    """What a name stands for, and for which run of which call."""

    node: ast.expr
    call: ast.AST
    run: Run
    is_of_loop: bool = False


class _Finder:
    def __init__(self, syntax: Syntax) -> None:
        self._syntax, self._steps = syntax, 0

    def found(self, node: ast.expr, call: ast.AST, run: Run, depth: int) -> list[Literal]:
        """See ``literals``."""
        if (value_of(node) is not None and node.lineno) or _is_member(node):
            return [Literal(node)]
        there = self.followed(node, call, run) if depth else None
        if there is not None:
            return [
                replace(
                    one,
                    place=f"{self._syntax.node(named(node))}, line {one.node.lineno}",
                    depth=one.depth + 1,
                    is_of_loop=one.is_of_loop or there.is_of_loop,
                )
                for one in self.found(there.node, there.call, there.run, depth - 1)
            ]
        is_angle = isinstance(node, ast.Call) and self._syntax.name(node) in RADIANS
        every = [one for part in terms(node) for one in self._of_part(node, part, call, run, depth)]
        if not every:
            raise StudioError(COMPUTED)
        is_choice = isinstance(node, ast.IfExp)
        nearest = [one for one in every if one.depth == 0 or is_choice] or every
        where = "" if is_angle else f"in {self._syntax.node(node)}"
        nearest = [
            replace(
                one,
                is_angle=one.is_angle or is_angle,
                place=one.place or where,
                is_choice=one.is_choice or is_choice,
            )
            for one in nearest
        ]
        return sorted(nearest, key=lambda one: one.is_of_loop)

    def _of_part(
        self, node: ast.expr, part: ast.expr, call: ast.AST, run: Run, depth: int
    ) -> list[Literal]:
        try:
            every = self.found(part, call, run, depth)
        except StudioError:
            return []
        is_choice = isinstance(node, ast.IfExp)
        return [one for one in every if is_choice or not isinstance(value_of(one.node), str)]

    def followed(self, node: ast.expr, call: ast.AST, run: Run) -> _Bound | None:
        """What a name, an element, a field, or a value with a name stands for; None for another.

        Raises:
            StudioError: if that cannot be told; says why.
        """
        self._steps += isinstance(node, ast.Name | ast.Subscript | ast.Attribute)
        if self._steps > MOST_STEPS:
            raise StudioError(COMPUTED)
        if isinstance(node, ast.Name):
            return self.bound(node, call, run)
        if isinstance(node, ast.NamedExpr):
            return _Bound(node.value, call, run)
        if isinstance(node, ast.Subscript):
            return self._item(node, call, run)
        if isinstance(node, ast.Attribute):
            return self._field(node, call, run)
        return None

    def end_of(self, node: ast.expr, call: ast.AST, run: Run) -> _Bound:
        """What names, elements and fields lead to."""
        there = _Bound(node, call, run)
        with suppress(StudioError):
            while (further := self.followed(there.node, there.call, there.run)) is not None:
                there = further
        return replace(there, node=written_out(there.node))

    def _item(self, node: ast.Subscript, call: ast.AST, run: Run) -> _Bound | None:
        """An element of a tuple, a list or a dictionary."""
        there, key = self.end_of(node.value, call, run), self._key(node.slice, call, run)
        if isinstance(there.node, ast.Dict):
            for own, value in zip(there.node.keys, there.node.values, strict=True):
                if own is not None and key is not None and value_of(own) == key:
                    return replace(there, node=value)
        parts = self.parts(node.value, call, run)
        if type(key) is int and -len(parts) <= key < len(parts):
            return replace(there, node=parts[key])
        return None

    def _key(self, node: ast.expr, call: ast.AST, run: Run) -> float | str | None:
        return value_of(self.end_of(node, call, run).node)

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
            raise StudioError(self._why_unknown(name.id, call))
        return replace(_only(name.id, found), call=syntax.tree)

    def _why_unknown(self, name: str, call: ast.AST) -> str:
        for node in self._syntax.around(call):
            if isinstance(node, ast.Lambda) and name in [one.arg for one in node.args.args]:
                return f"{name} is what the lambda in line {node.lineno} is called with"
            if isinstance(node, ast.match_case):
                names = [one for one in ast.walk(node.pattern) if isinstance(one, ast.MatchAs)]
                if name in [one.name for one in names]:
                    return f"{name} is taken out of what is matched in line {node.pattern.lineno}"
        return f"{name} is not set in this file"

    def _field(self, node: ast.Attribute, call: ast.AST, run: Run) -> _Bound | None:
        """What a field of an object or of a class of the file stands for; None of another."""
        if node.attr == "value" and isinstance(node.value, ast.Attribute):  # of an enumeration
            return self._field(node.value, call, run)
        owner = self._owner(node.value, call, run)
        if owner is None:
            return None
        kind = self._class(owner.node)
        values = [] if kind is None else values_of(kind)
        if isinstance(owner.node, ast.Call):
            words = {word.arg: word.value for word in owner.node.keywords}
            fields = [name for name, _ in values]
            given = dict(zip(fields, owner.node.args, strict=False)) if kind is not None else {}
            init = None if kind is None else function_of(kind, "__init__")
            if init is not None:
                set_in = [one for one in ast.walk(init) if is_set_to(one, node.attr)]
                site = self._syntax.site(self._syntax.span(owner.node)[1])
                inside = Run(0, ((site, owner.run.number), *owner.run.callers))
                if len(set_in) == 1 and (value := getattr(set_in[0], "value", None)) is not None:
                    return _Bound(value, set_in[0], inside)
            elif node.attr in words or node.attr in given:
                return replace(owner, node=words.get(node.attr) or given[node.attr])
            elif kind is None and owner.node.args:  # replace(OTHER, ...)
                other = ast.copy_location(ast.Attribute(owner.node.args[0], node.attr), node)
                return self._field(other, owner.call, owner.run)
        value = dict(values).get(node.attr)
        return None if value is None else _Bound(value, self._syntax.tree, Run())

    def _owner(self, node: ast.expr, call: ast.AST, run: Run) -> _Bound | None:
        """The call that has made an object, or the name of a class; None where that is unknown."""
        if isinstance(node, ast.Name):
            functions = [
                one for one in self._syntax.around(call) if isinstance(one, ast.FunctionDef)
            ]
            own = functions[0].args.args[:1] if functions else []
            is_method = own and isinstance(self._syntax.parents[functions[0]], ast.ClassDef)
            if is_method and own[0].arg == node.id:
                return self._owner_of_self(run)
            if self._class(node) is not None:
                return _Bound(node, call, run)
        if isinstance(node, ast.Call):
            is_known = self._class(node) is not None or self._syntax.name(node) == "replace"
            return _Bound(node, call, run) if is_known else None
        there = self.followed(node, call, run)
        return None if there is None else self._owner(there.node, there.call, there.run)

    def _owner_of_self(self, run: Run) -> _Bound | None:
        """What a method was called on, be it in a chain of methods that return it."""
        if not run.callers:
            return None
        (site, number), *others = run.callers
        outer = self._syntax.call(site)
        node: ast.expr = outer
        while isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            node = node.func.value
        return None if node is outer else self._owner(node, outer, Run(number, tuple(others)))

    def _class(self, node: ast.expr) -> ast.ClassDef | None:
        """The class of the file that is named, or called."""
        name = node.func if isinstance(node, ast.Call) else node
        for one in self._syntax.tree.body:
            if isinstance(one, ast.ClassDef) and isinstance(name, ast.Name) and one.name == name.id:
                return one
        return None

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
            above, name_of = self._syntax.parents[function], self._syntax.name(outer)
            is_made = isinstance(above, ast.ClassDef) and name_of == above.name
            if name_of == function.name or (is_made and function.name == "__init__"):
                names = [item.arg for item in every][isinstance(above, ast.ClassDef) :]
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
        for node in self._syntax.stored(scope).get(name, ()):
            if is_module and self._syntax.parents[self._syntax.statement(node)] is not scope:
                continue
            value = self._assigned(node, call, run)
            if value is None:
                raise StudioError(f"{name} is computed in line {node.lineno}")
            if not is_only_of(value.node, name):  # what turns round a value is no other one
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
            parts = self.parts(value, call, run) if value is not None else []
            value = parts[index] if index < len(parts) else None
        return None if value is None else _Bound(value, call, run, is_of_loop)

    def _element(self, loop: ast.For, call: ast.AST, run: Run) -> ast.expr | None:
        """What a loop is at when the call runs."""
        parts, rounds = self.parts(loop.iter, call, run), 1
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
        return len(self.parts(loop.iter, call, run)) or None

    def parts(self, node: ast.expr, call: ast.AST, run: Run) -> Sequence[ast.expr]:
        """The elements of what is written out, or has a name; none of another.

        Those of ``zip``, ``enumerate`` and ``items`` are made here, and stand nowhere.
        """
        whole = self.end_of(node, call, run).node
        if isinstance(whole, ast.Dict):
            return [] if None in whole.keys else [key for key in whole.keys if key is not None]
        if isinstance(whole, ast.Tuple | ast.List):
            return [] if any(isinstance(one, ast.Starred) for one in whole.elts) else whole.elts
        if not isinstance(whole, ast.Call):
            return []
        name, given = self._syntax.name(whole), whole.args
        if name in ("items", "values") and isinstance(whole.func, ast.Attribute):
            items = self.end_of(whole.func.value, call, run).node
            if not isinstance(items, ast.Dict) or None in items.keys:
                return []
            pairs = zip(items.keys, items.values, strict=True)
            return items.values if name == "values" else [tuple_of(*pair) for pair in pairs]
        rows = [self.parts(one, call, run) for one in given]
        if name == "zip":
            return [tuple_of(*row) for row in zip(*rows, strict=False)]
        if name == "enumerate" and len(rows) == 1 and not whole.keywords:
            return [tuple_of(constant_of(k), one) for k, one in enumerate(rows[0])]
        if name == "reversed" and rows:
            return rows[0][::-1]
        if name in RADIANS and rows:
            return [ast.Call(whole.func, [one], [], lineno=0, col_offset=0) for one in rows[0]]
        return []


def _only(name: str, found: Sequence[_Bound]) -> _Bound:
    if len(found) != 1:
        raise StudioError(f"{name} has more than one value: change it in the file")
    return found[0]


def _is_member(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.attr in MEMBERS.get(node.value.id, ())
    )
