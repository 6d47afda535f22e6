"""The eyes: offline 3D replay, rendered animation and stills of a recorded run."""

from __future__ import annotations

from viz.animation import export_animation
from viz.html_page import export_html
from viz.still import export_filmstrip

__all__ = ["export_animation", "export_filmstrip", "export_html"]
