"""Colours shared by the page and the pictures."""

from __future__ import annotations

INK = "#1f2937"
MUTED = "#6b7280"
TRACK = "#d8dee8"
ACCENT = "#2563eb"
GOOD = "#15803d"
TIGHT = "#b45309"
ALARM = "#dc2626"
BROKEN_FILL = "#f3a7a7"
FORCE = "#f97316"
LEG_COLORS = ("#2563eb", "#f59e0b", "#10b981", "#db2777")
"""One colour per leg, in the order of ``LEGS``."""


def rgb(color: str) -> tuple[float, float, float]:
    """``#rrggbb`` as red, green, blue in 0..1."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red / 255, green / 255, blue / 255
