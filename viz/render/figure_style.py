"""What all figures share: style, and how they are written."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from go2_wbc.files import write_atomically
from viz.palette import MUTED, TRACK

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


def save_figure(figure: Figure, target: Path) -> Path:
    """Write a figure; ``target`` is checked already, and its ending says the kind.

    Raises:
        ConfigError: if the disk refuses.
    """
    kind, stream = target.suffix[1:].lower(), io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(stream, format=kind, dpi=160, metadata=_UNDATED[kind])
    return write_atomically(target, stream.getvalue())
