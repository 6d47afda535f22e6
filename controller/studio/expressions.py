"""What single parts of a tree say by themselves, whatever names stand for."""

from __future__ import annotations

import ast

from controller.studio.syntax import value_of

ARRAYS = frozenset({"array", "asarray", "list", "tuple"})
"""Functions that have the elements which they are given."""


def numbers_of(node: ast.expr) -> range | None:
    """The numbers of ``range(...)`` with literals."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
        return None
    values = [value_of(one) for one in node.args]
    if node.func.id != "range" or not values or not all(type(value) is int for value in values):
        return None
    return range(*values)  # type: ignore[arg-type]


def terms(node: ast.expr) -> list[ast.expr]:
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


def is_only_of(node: ast.expr, name: str) -> bool:
    """Whether an expression has no value of its own, but turns round that of ``name``."""
    names = {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}
    return names == {name} and not isinstance(node, ast.Name)


def function_of(kind: ast.ClassDef, name: str) -> ast.FunctionDef | None:
    """A method of a class."""
    found = [one for one in kind.body if isinstance(one, ast.FunctionDef) and one.name == name]
    return found[0] if found else None


def values_of(kind: ast.ClassDef) -> list[tuple[str, ast.expr | None]]:
    """The fields of a class in their order, with their defaults."""
    found = list[tuple[str, ast.expr | None]]()
    for one in kind.body:
        target = one.target if isinstance(one, ast.AnnAssign) else None
        target = one.targets[0] if isinstance(one, ast.Assign) else target
        if isinstance(one, ast.Assign | ast.AnnAssign) and isinstance(target, ast.Name):
            value = one.value
            if isinstance(value, ast.Call):  # field(default=...)
                value = {word.arg: word.value for word in value.keywords}.get("default", value)
            found.append((target.id, value))
    return found


def is_set_to(node: ast.AST, name: str) -> bool:
    """Whether a statement is ``self.name = ...``."""
    targets = node.targets if isinstance(node, ast.Assign) else []
    targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
    return any(isinstance(one, ast.Attribute) and one.attr == name for one in targets)


def constant_of(value: float | str) -> ast.Constant:
    """A literal that stands nowhere."""
    return ast.Constant(value, lineno=0, col_offset=0)


def tuple_of(*elements: ast.expr | None) -> ast.expr:
    """A tuple that stands nowhere, of what does."""
    given = [one for one in elements if one is not None]
    return ast.Tuple(given, ast.Load(), lineno=0, col_offset=0)


def named(node: ast.expr) -> ast.expr:
    """What its value is called by."""
    return node.target if isinstance(node, ast.NamedExpr) else node


def written_out(node: ast.expr) -> ast.expr:
    """``np.array([...])`` as its list, and ``dict(x=...)`` as a dictionary."""
    if not isinstance(node, ast.Call):
        return node
    name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
    if name in ARRAYS and len(node.args) == 1:
        return node.args[0]
    words = [word.arg for word in node.keywords if word.arg]
    if name == "dict" and not node.args and len(words) == len(node.keywords):
        keys: list[ast.expr | None] = [constant_of(word) for word in words]
        return ast.Dict(keys, [word.value for word in node.keywords], lineno=0, col_offset=0)
    return node
