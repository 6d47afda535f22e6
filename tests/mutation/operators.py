"""One small change of the source at a time, found by ``ast``.

The operators are those that Offutt et al., *An experimental determination of sufficient mutant
operators*, ACM TOSEM 5(2), 1996, found to be enough (arithmetic, relational, logical, sign), and
the usual ones of today's tools: constants, calls of opposite meaning, ``return``, ``break``.
What only talks is left alone: annotations, decorators, f-strings, raised errors and log lines.
"""

from __future__ import annotations

import ast
import copy
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

Node = TypeVar("Node", bound=ast.AST)
_OPERATORS = [
    *((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.BitAnd, ast.BitOr), (ast.And, ast.Or)),
    *((ast.Lt, ast.LtE), (ast.Gt, ast.GtE), (ast.Eq, ast.NotEq), (ast.In, ast.NotIn)),
    *((ast.Is, ast.IsNot), (ast.Break, ast.Continue)),
]
_CALLS = [
    *(("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("nanmin", "nanmax")),
    *(("any", "all"), ("floor", "ceil"), ("sin", "cos"), ("hstack", "vstack")),
]
SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    **dict(_OPERATORS),
    **{b: a for a, b in _OPERATORS},
    **dict.fromkeys((ast.FloorDiv, ast.Mod, ast.Pow), ast.Mult),
}
OPPOSITE = {**dict(_CALLS), **{b: a for a, b in _CALLS}}
_LOGGERS = frozenset({"_log", "_logger", "logging"})
_UNRUN_FIELDS = frozenset({"annotation", "returns", "decorator_list", "type_params"})


@dataclass(frozen=True, slots=True)
class Mutant:
    """A change of one place: what stands at the bytes ``start`` to ``end`` becomes ``after``."""

    name: str
    path: str
    line: int
    kind: str
    start: int
    end: int
    after: str

    def applied(self, source: bytes) -> bytes:
        """``source`` with the change."""
        return source[: self.start] + self.after.encode() + source[self.end :]


@dataclass(frozen=True, slots=True)
class Function:
    """A function's mutants, and its length, by which it is drawn."""

    lines: int
    mutants: list[Mutant]


def functions_of(source: bytes, path: str) -> list[Function]:
    """Every function and method of a module that can be mutated."""
    starts = np.cumsum([0, *(len(line) for line in source.splitlines(keepends=True))]).tolist()
    found, names = [], Counter[str]()
    for function_name, function in _functions(ast.parse(source), ""):
        mutants = []
        for node in _sites(function):
            begin = starts[node.lineno - 1] + node.col_offset
            end = starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
            before = " ".join(source[begin:end].decode().split())
            for new in (*_other_operators(node), *_other_meanings(node, function)):
                after = ast.unparse(new) if isinstance(new, ast.stmt) else f"({ast.unparse(new)})"
                name = f"{path} {function_name}: {before} -> {after}"
                names[name] += 1
                name += f" #{names[name]}" if names[name] > 1 else ""
                kind = type(node).__name__
                mutants.append(Mutant(name, path, node.lineno, kind, begin, end, after))
        if mutants:
            found.append(Function((function.end_lineno or 0) - function.lineno + 1, mutants))
    return found


def draw(functions: list[Function], count: int, seed: int) -> list[Mutant]:
    """``count`` different mutants: a function by its length, then one of its mutants evenly."""
    rng = np.random.default_rng(seed)
    left = [Function(function.lines, list(function.mutants)) for function in functions]
    drawn: list[Mutant] = []
    while left and len(drawn) < count:
        weights = np.array([function.lines for function in left], dtype=float)
        index = int(rng.choice(len(left), p=weights / weights.sum()))
        mutants = left[index].mutants
        drawn.append(mutants.pop(int(rng.integers(len(mutants)))))
        if not mutants:
            left.pop(index)
    return drawn


def _functions(node: ast.AST, prefix: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef):
            yield prefix + child.name, child
        elif isinstance(child, ast.ClassDef):
            yield from _functions(child, f"{prefix}{child.name}.")


def _sites(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """The statements and expressions of a function that run."""
    for field, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if field in _UNRUN_FIELDS or not isinstance(child, ast.AST) or _is_talk(child):
                continue
            if isinstance(child, ast.expr | ast.stmt):
                yield child
            match child:
                case ast.UnaryOp(op=ast.USub(), operand=ast.Constant()):
                    pass  # one number, one change of its sign
                case _:
                    yield from _sites(child)


def _is_talk(node: ast.AST) -> bool:
    match node:
        case ast.Raise() | ast.JoinedStr() | ast.Assert():
            return True
        case ast.Call(func=ast.Attribute(value=ast.Name(id=name))):
            return name in _LOGGERS
    return False


def _other_operators(node: ast.expr | ast.stmt) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) | ast.BoolOp(op=op):
            if type(op) in SWAPPED and not _is_text(node):  # joining strings has no opposite
                yield _with(node, op=SWAPPED[type(op)]())
        case ast.Compare(ops=ops):
            for index, op in enumerate(ops):
                yield _with(node, ops=[*ops[:index], SWAPPED[type(op)](), *ops[index + 1 :]])
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield operand


def _other_meanings(
    node: ast.expr | ast.stmt, function: ast.FunctionDef
) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(-value or 1.0)
        case ast.Call(func=ast.Name(id=name)) if name in OPPOSITE:
            yield _with(node, func=ast.Name(OPPOSITE[name]))
        case ast.Call(func=ast.Attribute(attr=name)) if name in OPPOSITE:
            yield _with(node, func=_with(node.func, attr=OPPOSITE[name]))
        case ast.Return(value=ast.expr()) if "None" in ast.unparse(function.returns or node):
            yield ast.Return(ast.Constant(None))  # else a check of types would notice
        case ast.Break() | ast.Continue():
            yield SWAPPED[type(node)]()  # type: ignore[misc]


def _is_text(node: ast.AST) -> bool:
    match node:
        case ast.BinOp(left=left, right=right):
            return _is_text(left) or _is_text(right)
        case ast.AugAssign(value=value):
            return _is_text(value)
        case ast.JoinedStr() | ast.Constant(value=str()):
            return True
    return False


def _with(node: Node, **fields: object) -> Node:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed
