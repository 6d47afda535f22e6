"""Lets docstrings be plain text: a bar is a bar, a colon a colon, a block as it is written.

The docstrings follow Google's style and are read in the source most of the time, so they contain
norms as ``|x|`` and equations as indented lines. Sphinx would take both for its own markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring

_LITERAL = re.compile(r"(``.*?``)")
_SECTION = re.compile(r"[A-Z]\w*(?: \w+)?:$")
BEFORE_NAPOLEON = 400


def as_markup(lines: list[str]) -> list[str]:
    """The lines with bars escaped and indented blocks marked as literal."""
    return list(_mark_blocks([_without_bars(line) for line in lines]))


def _without_bars(line: str) -> str:
    parts = _LITERAL.split(line)
    return "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def _mark_blocks(lines: list[str]) -> Iterator[str]:
    """Put ``::`` before a block that is indented after an empty line; a block is kept verbatim."""
    last, after_blank, in_block = "", False, False
    for line in lines:
        is_indented = line.startswith("    ")
        if line.strip():
            starts = is_indented and after_blank and bool(last) and not last.startswith(" ")
            if starts and not (_SECTION.match(last) or last.startswith("- ")):
                in_block = True
                yield from ("::", "")
            in_block = in_block and is_indented
            last, after_blank = line, False
        else:
            after_blank = True
        yield line.replace(r"\|", "|") if in_block else line


def _process(
    app: Sphinx, kind: str, name: str, item: object, options: object, lines: list[str]
) -> None:
    lines[:] = as_markup(lines)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the step, before napoleon reads the sections; of a field it splits no type off."""
    GoogleDocstring._parse_attribute_docstring = GoogleDocstring._consume_to_end
    app.connect("autodoc-process-docstring", _process, priority=BEFORE_NAPOLEON)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
