"""Equations as MathML, which browsers draw by themselves: no script, no network.

Docutils turns LaTeX into MathML; this registers it as a maths renderer of Sphinx.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError


def converted(source: str, *, is_block: bool) -> str:
    """LaTeX as a MathML element.

    Raises:
        ExtensionError: if docutils does not know a command of it.
    """
    try:
        return tex2mathml(source, as_block=is_block)
    except Exception as error:
        raise ExtensionError(f"cannot convert {source!r} to MathML: {error}") from error


def _visit_inline(writer: Any, node: nodes.math) -> None:  # noqa: ANN401
    writer.body.append(f'<span class="math">{converted(node.astext(), is_block=False)}</span>')
    raise nodes.SkipNode


def _visit_block(writer: Any, node: nodes.math_block) -> None:  # noqa: ANN401
    element = converted(node.astext(), is_block=True)
    writer.body.append(f'<div class="math-block" tabindex="0">{element}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
