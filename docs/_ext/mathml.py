"""Equations as MathML, which browsers draw by themselves: no script, no network.

Registers math-core, which turns LaTeX into MathML, as a maths renderer of Sphinx.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from math_core import LatexError, LatexToMathML
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

_log = getLogger(__name__)
_converter = LatexToMathML()


def converted(node: nodes.math | nodes.math_block, *, is_block: bool) -> str:
    """The equation as a MathML element; a warning and its source if it is not valid LaTeX."""
    source = node.astext()
    try:
        return _converter.convert_with_local_state(source, displaystyle=is_block)
    except LatexError as error:
        _log.warning("cannot convert %r to MathML: %s", source, error, location=node)
        return f"<code>{source}</code>"


def _visit_inline(writer: Any, node: nodes.math) -> None:  # noqa: ANN401
    writer.body.append(f'<span class="math">{converted(node, is_block=False)}</span>')
    raise nodes.SkipNode


def _visit_block(writer: Any, node: nodes.math_block) -> None:  # noqa: ANN401
    element = converted(node, is_block=True)
    writer.body.append(f'<div class="math-block" tabindex="0">{element}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
