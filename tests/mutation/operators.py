"""One small change of the source at a time, found by ``ast``.

The operators are those that Offutt et al., *An experimental determination of sufficient mutant
operators*, ACM TOSEM 5(2), 1996, found to be enough (arithmetic, relational, logical, sign), and
the usual ones of today's tools: constants, calls of opposite meaning, ``return``, ``break``.
What only talks is left alone: annotations, decorators, f-strings, raised errors and log lines; so
is the open length of a ``reshape``.
"""

import ast
import copy
from collections import Counter
from collections.abc import Iterable, Iterator
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
    weight: float
    start: int
    end: int
    after: str

    def applied(self, source: bytes) -> bytes:
        """``source`` with the change."""
        return source[: self.start] + self.after.encode() + source[self.end :]


def mutants_of(source: bytes, path: str) -> list[Mutant]:
    """Every mutant of a module's functions; those of a function weigh as much as it has lines."""
    starts = np.cumsum([0, *(len(line) for line in source.splitlines(keepends=True))]).tolist()
    mutants, names = [], Counter[str]()
    for function_name, function in _functions(ast.parse(source), ""):
        sites = [(node, new) for node in _sites(function) for new in _changes(node, function)]
        for node, new in sites:
            start = starts[node.lineno - 1] + node.col_offset
            end = starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
            before = " ".join(source[start:end].decode().split())
            after = ast.unparse(new) if isinstance(new, ast.stmt) else f"({ast.unparse(new)})"
            name = f"{path} {function_name}: {before} -> {after}"
            names[name] += 1
            name += f" #{names[name]}" if names[name] > 1 else ""
            weight = ((function.end_lineno or 0) - function.lineno + 1) / len(sites)
            mutants.append(Mutant(name, path, weight, start, end, after))
    return mutants


def apart(mutants: Iterable[Mutant]) -> list[list[Mutant]]:
    """Groups of which each can be applied as a whole: no two change the same place."""
    groups: list[list[Mutant]] = []
    for m in mutants:
        free = (g for g in groups if not any(m.path == o.path and _meet(m, o) for o in g))
        if (group := next(free, None)) is None:
            groups.append([m])
        else:
            group.append(m)
    return groups


def _meet(one: Mutant, other: Mutant) -> bool:
    return one.start < other.end and other.start < one.end


def draw(mutants: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """``count`` of the mutants by their weights, none twice."""
    weights = np.array([mutant.weight for mutant in mutants])
    rng, size = np.random.default_rng(seed), min(count, len(mutants))
    chosen = rng.choice(len(mutants), size, replace=False, p=weights / weights.sum())
    return [mutants[index] for index in chosen]


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
            if _is_reshape(node) and isinstance(child, ast.UnaryOp):
                continue  # -1: numpy takes any negative length for the one that is left open
            if isinstance(child, ast.expr | ast.stmt):
                yield child
            yield from _sites(child)


def _is_reshape(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "reshape"


def _is_talk(node: ast.AST) -> bool:
    match node:
        case ast.Raise() | ast.JoinedStr() | ast.Assert():
            return True
        case ast.keyword(arg="strict"):  # of ``zip``: an assertion
            return True
        case ast.Call(func=ast.Attribute(value=ast.Name(id=name))):
            return name in _LOGGERS
    return False


def _changes(node: ast.expr | ast.stmt, function: ast.FunctionDef) -> Iterator[ast.expr | ast.stmt]:
    yield from _other_operators(node)
    yield from _other_meanings(node, function)


def _other_operators(node: ast.expr | ast.stmt) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) | ast.BoolOp(op=op):
            if type(op) in SWAPPED and not _is_text(node):  # joining strings has no opposite
                yield _with(node, op=SWAPPED[type(op)]())
        case ast.Compare(ops=ops):
            for index, op in enumerate(ops):
                yield _with(node, ops=[*ops[:index], SWAPPED[type(op)](), *ops[index + 1 :]])
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield operand
        case ast.UnaryOp(op=ast.USub(), operand=operand) if not isinstance(operand, ast.Constant):
            yield operand  # the sign of a number is changed with the number


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
        case ast.Return(value=ast.expr() as value) if _may_be_none(value, function):
            yield ast.Return(ast.Constant(None))
        case ast.Break() | ast.Continue():
            yield SWAPPED[type(node)]()  # type: ignore[misc]


def _may_be_none(value: ast.expr, function: ast.FunctionDef) -> bool:
    """Whether only a test, and no check of types, can tell this value from None."""
    returns = ast.unparse(function.returns) if function.returns else "None"
    return "None" in returns and ast.unparse(value) != "None"


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
