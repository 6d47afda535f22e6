"""Flat things on a rendered picture: what the robot does, the time, who touches the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, UInt8
from PIL import Image, ImageDraw, ImageFont

from go2_wbc.legs import LEGS
from viz.palette import ACCENT, ALARM, INK, LEG_COLORS, MUTED, TRACK

_SUPERSAMPLING = 3  # Pillow draws shapes without antialiasing: draw larger, then shrink


@dataclass(frozen=True, slots=True)
class Caption:
    """What the overlay says.

    Attributes:
        label: the present behaviour.
        time: seconds since the start of the recording.
        progress: share of the recording that has passed, 0..1; ``None`` draws no bar.
        contacts: which feet touch the floor.
        speed: playback speed, shown if not 1.
        is_alarm: the label says what is wrong, and is red.
    """

    label: str
    time: float
    progress: float | None
    contacts: Bool[np.ndarray, "4"]
    speed: float | int = 1.0
    is_alarm: bool = False


def readable(label: str) -> str:
    """``high_five`` as ``High five``."""
    words = label.replace("_", " ").strip()
    return words[:1].upper() + words[1:]


def draw_caption(
    picture: UInt8[np.ndarray, "h w 3"], caption: Caption
) -> UInt8[np.ndarray, "h w 3"]:
    """A copy of the picture with the caption along its lower edge."""
    image = Image.fromarray(picture)
    width, height = image.size
    unit = height / 400
    band = round(52 * unit)
    strip = image.crop((0, height - band, width, height))
    strip = strip.resize((width * _SUPERSAMPLING, band * _SUPERSAMPLING), Image.Resampling.BICUBIC)
    _draw_strip(ImageDraw.Draw(strip), caption, strip.size, unit * _SUPERSAMPLING)
    image.paste(strip.resize((width, band), Image.Resampling.BOX), (0, height - band))
    return np.asarray(image)


def _draw_strip(
    draw: ImageDraw.ImageDraw, caption: Caption, size: tuple[int, int], unit: float
) -> None:
    width, height = size
    middle = height - 28 * unit
    font, small = ImageFont.load_default(15 * unit), ImageFont.load_default(11.5 * unit)
    text = readable(caption.label)
    back = ALARM if caption.is_alarm else INK
    left, pad, half = 14 * unit, 11 * unit, 13 * unit
    right = left + draw.textlength(text, font) + 2 * pad
    draw.rounded_rectangle((left, middle - half, right, middle + half), half, fill=back)
    draw.text((left + pad, middle), text, "white", font, anchor="lm")
    clock = f"{caption.time:.1f} s"
    if caption.speed != 1.0:
        clock += f"   {caption.speed:g}x"
    draw.text((right + 10 * unit, middle), clock, MUTED, small, anchor="lm")
    for leg, color, touches in zip(LEGS, LEG_COLORS, caption.contacts, strict=True):
        x = width - (14 + 34 * (len(LEGS) - 1 - leg) + 14) * unit
        box = (x - 14 * unit, middle - 10 * unit, x + 14 * unit, middle + 10 * unit)
        draw.rounded_rectangle(box, 6 * unit, fill=color if touches else TRACK)
        draw.text((x, middle), leg.name, "white" if touches else MUTED, small, anchor="mm")
    if caption.progress is not None:
        top = height - 4 * unit
        draw.rectangle((0, top, width, height), fill=TRACK)
        draw.rectangle((0, top, width * caption.progress, height), fill=ACCENT)
