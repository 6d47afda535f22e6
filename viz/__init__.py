"""The eyes: live preview, offline 3D page, rendered animation, stills and plots."""

from __future__ import annotations

from viz.content import Annotation, MarginCurve, ReplayContent, Verdict
from viz.render.animation import ANIMATION_SUFFIXES, export_animation
from viz.render.margin_plot import PLOT_SUFFIXES, export_plot
from viz.render.still import export_filmstrip
from viz.replay.html_page import HTML_SUFFIXES, export_html

__all__ = [
    "ANIMATION_SUFFIXES",
    "HTML_SUFFIXES",
    "PLOT_SUFFIXES",
    "Annotation",
    "MarginCurve",
    "ReplayContent",
    "Verdict",
    "export_animation",
    "export_filmstrip",
    "export_html",
    "export_plot",
]
