"""Rewriting what is computed, when asked to: a loop as its rounds, a number as a parameter.

Each is one replaced span of the text: the same motion as before, written so that single moves, or
the one number, can be changed.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

from controller.studio.expressions import numbers_of
from controller.studio.literals import Run, elements
from controller.studio.source import Slot, Source
from controller.studio.syntax import Site, Span, Syntax
from go2_wbc.errors import StudioError

MOST_ROUNDS = 100  #: A loop of more is not written out
UNITS: Mapping[str, str] = {
    "x": "m", "y": "m", "z": "m", "height": "m", "over": "s", "seconds": "s",
}  # fmt: skip
ROOM = 0.5  #: Share of a number by which its parameter may be smaller or greater
SMALL, SMALL_ANGLE = 0.05, 10.0  #: The same of 0: m or s, and degrees
Change = tuple[Span, str]


def unrolled(source: Source, site: Site, run: Run) -> Source:
    """With the innermost loop around a call written out, round by round.

    Raises:
        StudioError: if no loop is around it, or one that cannot be: says why.
    """
    syntax = source.syntax
    call = syntax.call(site)
    loops = [one for one in syntax.around(call) if isinstance(one, ast.For)]
    if not loops:
        raise StudioError("it is in no loop that could be written out")
    loop = loops[0]
    rounds = _rounds(syntax, loop, call, run)
    names = _targets(loop.target)
    _require_plain(syntax, loop, names)
    body = _body(syntax, loop)
    texts = [_with(syntax, body, loop, dict(zip(names, row, strict=True))) for row in rounds]
    first, last = syntax.starts[loop.lineno - 1], body[1]
    return source.replaced((first, last), "".join(texts))


def _rounds(syntax: Syntax, loop: ast.For, call: ast.AST, run: Run) -> list[list[str]]:
    """What the targets are in each round, as text."""
    numbers = numbers_of(loop.iter)
    if numbers is not None:
        rows = [[str(number)] for number in numbers]
    else:
        parts = elements(syntax, loop.iter, call, run)
        if not parts:
            code = syntax.node(loop.iter)
            raise StudioError(f"it goes round as {code} says: written out, it would not follow it")
        rows = [_texts(syntax, loop.target, one) for one in parts]
    if not 0 < len(rows) <= MOST_ROUNDS:
        raise StudioError(f"it goes round {len(rows)} times")
    return rows


def _texts(syntax: Syntax, target: ast.expr, value: ast.expr) -> list[str]:
    if isinstance(target, ast.Tuple | ast.List):
        if not isinstance(value, ast.Tuple | ast.List) or len(value.elts) != len(target.elts):
            raise StudioError(f"{syntax.node(value)} cannot be taken apart")
        pairs = zip(target.elts, value.elts, strict=True)
        return [text for one, part in pairs for text in _texts(syntax, one, part)]
    if isinstance(value, ast.Starred):
        raise StudioError(f"{syntax.node(value)} cannot be written out")
    text = syntax.node(value)
    return [text if isinstance(value, ast.Constant | ast.Name) else f"({text})"]


def _targets(target: ast.expr) -> list[str]:
    if isinstance(target, ast.Name):
        return [target.id]
    if isinstance(target, ast.Tuple | ast.List):
        return [name for one in target.elts for name in _targets(one)]
    raise StudioError("what it counts with is no name")


def _require_plain(syntax: Syntax, loop: ast.For, names: Sequence[str]) -> None:
    """Raise StudioError for a loop whose rounds are more than its lines, one after the other."""
    if loop.orelse:
        raise StudioError("the loop has an else")
    inside = [node for statement in loop.body for node in ast.walk(statement)]
    if any(isinstance(node, ast.Break | ast.Continue) for node in inside):
        raise StudioError("the loop is left, or a round is cut short")
    for node in inside:
        is_word = isinstance(node, ast.Constant | ast.JoinedStr)
        if is_word and node.end_lineno != node.lineno:
            raise StudioError("a text in the loop goes over several lines")
        is_text = isinstance(node, ast.JoinedStr | ast.Lambda | ast.FunctionDef)
        if is_text and {one.id for one in ast.walk(node) if isinstance(one, ast.Name)} & {*names}:
            raise StudioError(f"{' and '.join(names)} stands in a text or in a function")
    own = {id(node) for node in ast.walk(loop)}
    for node in syntax.nodes:
        if not isinstance(node, ast.Name) or node.id not in names:
            continue
        is_set = isinstance(node.ctx, ast.Store)
        if id(node) in own and is_set and node in inside:
            raise StudioError(f"{node.id} is set in the loop")
        if id(node) not in own and not is_set and _is_after(syntax, node, loop):
            raise StudioError(f"{node.id} is used after the loop, line {node.lineno}")


def _is_after(syntax: Syntax, node: ast.Name, loop: ast.For) -> bool:
    """Whether a use of a loop's name may be what the loop has left; not in a loop of its own."""
    scopes = [one for one in syntax.around(loop) if isinstance(one, ast.FunctionDef)]
    around = list(syntax.around(node))
    if (scopes and scopes[0] not in around) or node.lineno < loop.lineno:
        return False
    return not any(isinstance(one, ast.For) and node.id in _targets(one.target) for one in around)


def _body(syntax: Syntax, loop: ast.For) -> Span:
    """The lines of a loop's body, or its statements in the line of the loop."""
    last = loop.body[-1].end_lineno or loop.lineno
    end = syntax.starts[last] if last < len(syntax.starts) else len(syntax.data)
    header = syntax.span(loop.iter)[1]
    colon = syntax.data.index(b":", header) + 1
    is_in_line = loop.body[0].lineno == syntax.site(colon)[0]
    start = syntax.span(loop.body[0])[0] if is_in_line else syntax.starts[syntax.site(colon)[0]]
    return start, end


def _with(syntax: Syntax, body: Span, loop: ast.For, values: Mapping[str, str]) -> str:
    """The body as it is in one round, as far to the left as the loop."""
    text, changes = syntax.data[slice(*body)], list[Change]()
    for statement in loop.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and node.id in values:
                start, end = syntax.span(node)
                changes.append(((start - body[0], end - body[0]), values[node.id]))
    for (start, end), new in sorted(changes, reverse=True):
        text = text[:start] + new.encode() + text[end:]
    start = syntax.starts[loop.lineno - 1]
    left = syntax.data[start : syntax.span(loop)[0]]
    if left.strip():
        raise StudioError("something else stands before the loop in its line")
    first = loop.body[0]
    own = syntax.data[syntax.starts[first.lineno - 1] : syntax.span(first)[0]]
    if own.strip():  # in the line of the loop
        return (left + text).decode()
    lines = text.splitlines(keepends=True)
    moved = [left + line[len(own) :] if line.startswith(own) else line for line in lines]
    whole = b"".join(moved)
    return (whole if whole.endswith((b"\n", b"\r")) else whole + syntax.line_end.encode()).decode()


def parametrised(source: Source, motion: str, site: Site, name: str, run: Run) -> Source:
    """With the number of an argument as a parameter of the motion, so that it has a slider.

    Raises:
        StudioError: if it is none, or does not stand in the motion itself: says why.
    """
    syntax = source.syntax
    slot = next((one for one in source.slots(site, run) if one.name == name), None)
    if slot is None or slot.span is None or isinstance(slot.value, str | None):
        raise StudioError(f"{name} is no number that stands in the file")
    function = motion_in(syntax, motion)
    if len(function.decorator_list) > 1:
        raise StudioError(f"{motion} is more than a motion: something else is written over it")
    start, end = syntax.span(function)
    if not start <= slot.span[0] < end or slot.span[0] < syntax.span(function.body[0])[0]:
        raise StudioError(f"{name} stands outside of {motion}(): {slot.place}")
    new = _free_name(function, slot, syntax.name(syntax.call(site)))
    changes: list[Change] = [
        (slot.span, new),
        _in_signature(syntax, function, _declared(new, slot)),
    ]
    changes += _imports(syntax, {"Annotated": "typing", "Range": "motions"})
    return changed(source, changes)


def motion_in(syntax: Syntax, motion: str) -> ast.FunctionDef:
    """The function of a motion; raises StudioError if it is not in the file."""
    for node in syntax.tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == motion and node.decorator_list:
            return node
    raise StudioError(f"{motion} is not written in this file")


def _free_name(function: ast.FunctionDef, slot: Slot, call: str) -> str:
    taken = {node.id for node in ast.walk(function) if isinstance(node, ast.Name)}
    taken |= {node.arg for node in ast.walk(function) if isinstance(node, ast.arg)}
    names = [slot.of, f"{call}_{slot.of}", *(f"{call}_{slot.of}_{k}" for k in range(2, 1000))]
    return next(name for name in names if name not in taken)


def _declared(name: str, slot: Slot) -> str:
    value = float(slot.value or 0.0)
    small = SMALL_ANGLE if slot.is_angle else SMALL
    low, high = value - ROOM * abs(value or small / ROOM), value + ROOM * abs(value or small / ROOM)
    unit = "deg" if slot.is_angle else UNITS.get(slot.of, "")
    if isinstance(slot.value, int) and slot.of not in UNITS and not slot.is_angle:
        ends = f"{int(low)}, {max(int(high), int(value) + 1)}"
        return f"{name}: Annotated[int, Range({ends})] = {slot.value}"
    ends = f"{round(low, 4)}, {round(high, 4)}" + (f', "{unit}"' if unit else "")
    return f"{name}: Annotated[float, Range({ends})] = {value}"


def _in_signature(syntax: Syntax, function: ast.FunctionDef, text: str) -> Change:
    given = function.args
    if given.vararg or given.kwarg:
        raise StudioError(f"{function.name}() takes any arguments")
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, *given.defaults]
    every += [value for value in given.kw_defaults if value is not None]
    if every:
        ends = [(one.end_lineno or 0, one.end_col_offset or 0) for one in every]
        line, column = max(ends)
        at = syntax.starts[line - 1] + column
        return (at, at), f", {text}"
    at = syntax.data.index(b"(", syntax.span(function)[0]) + 1
    return (at, at), text


def imported(source: Source, wanted: Mapping[str, str]) -> Source:
    """With names of modules, where the file does not have them; the call that was made is known."""
    changes = _imports(source.syntax, wanted)
    if not changes:
        return source
    after = changed(source, changes)
    end = None if source.site is None else source.offset(source.site)
    return Source(after.data, end and end + len(after.data) - len(source.data))


def _imports(syntax: Syntax, wanted: Mapping[str, str]) -> list[Change]:
    """Names of modules, where the file does not have them."""
    known, changes = set[str](), list[Change]()
    imports = [one for one in syntax.tree.body if isinstance(one, ast.Import | ast.ImportFrom)]
    for one in imports:
        known |= {alias.asname or alias.name for alias in one.names}
    later = [one for one in imports if getattr(one, "module", "") != "__future__"]
    whole = {getattr(one, "module", "") for one in imports if one.names[0].name == "*"}
    missing = {
        name: module for name, module in wanted.items() if name not in known and module not in whole
    }
    if missing and not later:
        raise StudioError(f"the file imports nothing: import {' and '.join(missing)} in it")
    for name, module in missing.items():
        own = next((one for one in later if getattr(one, "module", "") == module), None)
        if own is None:
            at = syntax.starts[later[0].lineno - 1]
            changes.append(((at, at), f"from {module} import {name}{syntax.line_end}"))
        else:
            last = own.names[-1]
            end = syntax.starts[(last.end_lineno or 1) - 1] + (last.end_col_offset or 0)
            changes.append(((end, end), f", {name}"))
    return changes


def changed(source: Source, changes: Sequence[Change]) -> Source:
    """Several changes as one span."""
    in_order = sorted(changes, key=lambda change: change[0])
    first, last = in_order[0][0][0], in_order[-1][0][1]
    texts, at = list[str](), first
    for (start, end), text in in_order:
        texts += [source.syntax.text((at, start)), text]
        at = end
    return source.replaced((first, last), "".join(texts))


def begun(source: Source, motion: str, code: str) -> Source:
    """With ``code`` as the first call of a motion that has none yet.

    Raises:
        StudioError: if there is no ``Timeline()`` in it.
    """
    syntax = source.syntax
    for node in ast.walk(motion_in(syntax, motion)):
        if isinstance(node, ast.Call) and syntax.name(node) == "Timeline":
            end = syntax.span(node)[1]
            return source.replaced((end, end), code, end + len(code.encode()))
    raise StudioError(f"{motion} has no Timeline() that could be gone on with")


def offers(source: Source, motion: str, site: Site, run: Run) -> list[dict[str, str]]:
    """What a page may offer for a bar: each an order for ``Studio.edit``, with its title."""
    written_out = {"op": "write_out", "title": "Write it out, with the values that it has now"}
    if not site[0]:  # of another file
        return [written_out]
    found = list[dict[str, str]]()
    try:
        unrolled(source, site, run)
        found.append({"op": "unroll", "title": "Write the loop out, round by round"})
    except StudioError:
        pass
    slots = source.slots(site, run)
    if any(slot.span is None for slot in slots):
        found.append(written_out)
    for slot in slots:
        try:
            parametrised(source, motion, site, slot.name, run)
        except StudioError:
            continue
        title = f"Make {slot.name} a parameter of {motion}, with a slider"
        found.append({"op": "parameter", "name": slot.name, "title": title})
    try:
        source.append(motion, ".scale_time(1.0)")
        found.append({"op": "pace", "title": "Change the pace of the whole: add .scale_time()"})
    except StudioError:
        pass
    return found
