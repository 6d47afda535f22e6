"""Two sheets to draw the same lines, areas and words on: SVG by hand, PNG by Pillow."""

from __future__ import annotations

import html
import io
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import final

from PIL import Image, ImageDraw, ImageFont

Point = tuple[float, float]

_FONT = "Inter, system-ui, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif"
_ANCHORS = {"l": "start", "m": "middle", "r": "end"}
_SUPERSAMPLING = 3  # Pillow draws without antialiasing: draw larger, then shrink
_PNG_SCALE = 2  # pixels per unit of the finished PNG


class Sheet(ABC):
    """Something to draw on; lengths in units from the upper left corner."""

    @abstractmethod
    def line(self, points: Sequence[Point], color: str, width: float, *, dashed: bool) -> None:
        """Join two or more points."""

    @abstractmethod
    def area(self, points: Sequence[Point], color: str) -> None:
        """Fill a polygon."""

    @abstractmethod
    def dot(self, center: Point, radius: float, color: str) -> None:
        """Fill a circle."""

    @abstractmethod
    def text(self, at: Point, words: str, color: str, size: float, anchor: str) -> None:
        """Write; ``at`` is on the base line, left (l), in the middle (m) or right (r) of it."""

    @abstractmethod
    def content(self) -> bytes:
        """The file."""


@final
class SvgSheet(Sheet):
    """Scalable, and its words can be searched."""

    def __init__(self, width: float, height: float) -> None:
        """A white sheet."""
        self._parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
            f'width="{width:g}" height="{height:g}" font-family="{_FONT}">',
            '<rect width="100%" height="100%" fill="#ffffff"/>',
        ]

    def line(self, points: Sequence[Point], color: str, width: float, *, dashed: bool) -> None:
        """See ``Sheet``."""
        dash = ' stroke-dasharray="4 3"' if dashed else ""
        self._parts.append(
            f'<polyline points="{_svg_points(points)}" fill="none" stroke="{color}" '
            f'stroke-width="{width:g}" stroke-linejoin="round"{dash}/>'
        )

    def area(self, points: Sequence[Point], color: str) -> None:
        """See ``Sheet``."""
        self._parts.append(f'<polygon points="{_svg_points(points)}" fill="{color}"/>')

    def dot(self, center: Point, radius: float, color: str) -> None:
        """See ``Sheet``."""
        x, y = center
        self._parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" fill="{color}"/>')

    def text(self, at: Point, words: str, color: str, size: float, anchor: str) -> None:
        """See ``Sheet``."""
        x, y = at
        self._parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" font-size="{size:g}" '
            f'text-anchor="{_ANCHORS[anchor]}">{html.escape(words)}</text>'
        )

    def content(self) -> bytes:
        """See ``Sheet``."""
        return "\n".join([*self._parts, "</svg>\n"]).encode()


@final
class PngSheet(Sheet):
    """Pixels, for where SVG is not shown."""

    def __init__(self, width: float, height: float) -> None:
        """A white sheet."""
        self._size = (round(width * _PNG_SCALE), round(height * _PNG_SCALE))
        self._scale = _PNG_SCALE * _SUPERSAMPLING
        large = (self._size[0] * _SUPERSAMPLING, self._size[1] * _SUPERSAMPLING)
        self._image = Image.new("RGB", large, "#ffffff")
        self._draw = ImageDraw.Draw(self._image)

    def line(self, points: Sequence[Point], color: str, width: float, *, dashed: bool) -> None:
        """See ``Sheet``."""
        stroke = max(1, round(width * self._scale))
        for part in _dashes(points[0], points[-1]) if dashed else [points]:
            self._draw.line([self._px(p) for p in part], color, stroke, joint="curve")

    def area(self, points: Sequence[Point], color: str) -> None:
        """See ``Sheet``."""
        self._draw.polygon([self._px(p) for p in points], fill=color)

    def dot(self, center: Point, radius: float, color: str) -> None:
        """See ``Sheet``."""
        (x, y), r = self._px(center), radius * self._scale
        self._draw.ellipse((x - r, y - r, x + r, y + r), fill=color)

    def text(self, at: Point, words: str, color: str, size: float, anchor: str) -> None:
        """See ``Sheet``."""
        font = ImageFont.load_default(size * self._scale)
        self._draw.text(self._px(at), words, color, font, anchor=f"{anchor}s")

    def content(self) -> bytes:
        """See ``Sheet``."""
        stream = io.BytesIO()
        small = self._image.resize(self._size, Image.Resampling.BOX)
        small.save(stream, "PNG", optimize=True)
        return stream.getvalue()

    def _px(self, point: Point) -> Point:
        return point[0] * self._scale, point[1] * self._scale


def _svg_points(points: Sequence[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _dashes(start: Point, end: Point) -> list[list[Point]]:
    """A straight line as dashes of 4 units with gaps of 3."""
    length = ((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2) ** 0.5
    dashes = []
    for k in range(int(length / 7) + 1):
        shares = (7 * k / length, min((7 * k + 4) / length, 1.0))
        dashes.append(
            [
                (start[0] + s * (end[0] - start[0]), start[1] + s * (end[1] - start[1]))
                for s in shares
            ]
        )
    return dashes
