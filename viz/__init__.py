"""The eyes: live preview, offline 3D page, rendered animation, stills and plots."""

from __future__ import annotations

from viz.animation import ANIMATION_SUFFIXES, export_animation
from viz.html_page import HTML_SUFFIXES, export_html
from viz.margin_plot import PLOT_SUFFIXES, export_plot
from viz.screening import MarginCurve, Remark, Screening, Verdict
from viz.still import export_filmstrip

__all__ = [
    "ANIMATION_SUFFIXES",
    "HTML_SUFFIXES",
    "PLOT_SUFFIXES",
    "MarginCurve",
    "Remark",
    "Screening",
    "Verdict",
    "export_animation",
    "export_filmstrip",
    "export_html",
    "export_plot",
]
