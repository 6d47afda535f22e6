"""What pages and pictures share: colours, the look of figures, and how figures are written."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from go2_wbc.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#1f2937"
MUTED = "#666d7b"
TRACK = "#d8dee8"
ACCENT = "#2563eb"
GOOD = "#15803d"
TIGHT = "#b45309"
ALARM = "#dc2626"
BROKEN_FILL = "#f3a7a7"
FORCE = "#f97316"
LEG_COLORS = ("#2563eb", "#f59e0b", "#10b981", "#db2777")
"""One colour per leg, in the order of ``LEGS``."""

PLOT_SUFFIXES = (".svg", ".png", ".pdf")
STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 8.0,
    "svg.fonttype": "none",  # words stay words: they can be searched and copied
    "svg.hashsalt": "go2_wbc",  # the same figure gives the same file
    "axes.edgecolor": TRACK,
    "axes.labelcolor": MUTED,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
}
_UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {"Software": None}}


def rgb(color: str) -> tuple[float, float, float]:
    """``#rrggbb`` as red, green, blue in 0..1."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red / 255, green / 255, blue / 255


def png_of(figure: Figure) -> bytes:
    """A figure as a picture of 120 dots per inch."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=120)
    return stream.getvalue()


def save_figure(figure: Figure, target: Path) -> Path:
    """Write a figure; ``target`` is checked already, and its ending says the kind.

    Raises:
        ConfigError: if the disk refuses.
    """
    import matplotlib  # a page has no need of it

    kind, stream = target.suffix[1:].lower(), io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(stream, format=kind, dpi=160, metadata=_UNDATED[kind])
    return write_atomically(target, stream.getvalue())
