"""Drawing and pages: live preview, offline 3D page, rendered animation, stills and plots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from viz.content import Annotation, MarginCurve, ReplayContent, Verdict
    from viz.render.pictures import ANIMATION_SUFFIXES, export_animation, export_filmstrip
    from viz.render.plots import (
        Relation,
        export_distributions,
        export_plot,
        export_relations,
        margin_figure,
    )
    from viz.replay.page_data import HTML_SUFFIXES, export_html
    from viz.style import PLOT_SUFFIXES

__all__ = [
    "ANIMATION_SUFFIXES",
    "HTML_SUFFIXES",
    "PLOT_SUFFIXES",
    "Annotation",
    "MarginCurve",
    "Relation",
    "ReplayContent",
    "Verdict",
    "export_animation",
    "export_distributions",
    "export_filmstrip",
    "export_html",
    "export_plot",
    "export_relations",
    "margin_figure",
]

__getattr__ = lazy_exports(__name__)
