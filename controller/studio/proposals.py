"""What a page shows before anything is written: the lines that would change, and other files."""

from __future__ import annotations

import ast
from collections import Counter
from difflib import unified_diff
from pathlib import Path

from controller.studio.orders import Bar
from controller.studio.rewriting import motion_in
from controller.studio.source import Source
from go2_wbc.errors import StudioError

AROUND = 2  #: Lines that are shown before and behind those that change


def proposal(before: Source, after: Source, motion: str) -> dict[str, object]:
    """The ``diff`` between two texts, and the parameters of a motion that are ``fixed`` by it."""
    was, would_be = (source.data.decode("utf-8-sig").splitlines() for source in (before, after))
    rows = [*unified_diff(was, would_be, lineterm="", n=AROUND)][2:]
    used, still = _uses(before, motion), _uses(after, motion)
    return {"diff": rows, "fixed": [name for name in used if still[name] < used[name]]}


def _uses(source: Source, motion: str) -> Counter[str]:
    """How often each parameter of a motion stands in it."""
    try:
        function = motion_in(source.syntax, motion)
    except StudioError:
        return Counter()
    nodes = [one for one in ast.walk(function) if isinstance(one, ast.Name | ast.arg)]
    own = {one.arg for one in nodes if isinstance(one, ast.arg)}
    return Counter(one.id for one in nodes if isinstance(one, ast.Name) and one.id in own)


def read(bar: Bar) -> dict[str, object]:
    """The text of the other file that a bar is written in.

    Raises:
        StudioError: if it is of none, or that cannot be read.
    """
    try:
        text = Path(bar.file).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise StudioError(f"cannot read {bar.file or 'another file'}: {error.strerror}") from error
    return {"text": text.splitlines(), "line": bar.line, "file": bar.file}
