"""Pictures of a recording at chosen times: camera that follows, force arrows, captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from viz.content import Annotation
from viz.render.camera import Camera, camera_path, heading_path, nearest_rows
from viz.render.ground import Relief
from viz.render.mesh import Surface, arrow
from viz.render.renderer import render
from viz.render.robot_meshes import PosedRobot, visuals_of
from viz.style import ACCENT, ALARM, FORCE, INK, LEG_COLORS, MUTED, TRACK, rgb

_INSTANT = 0.04  # [s] a limit that is broken for an instant is told for this long around it
_SWAY_PERIOD = 26.0  # [s]
_METRES_PER_NEWTON = 0.002  # length of the force arrows
_LEAST_FORCE = 4.0  # [N] weaker forces draw no arrow
_SUPERSAMPLING = 3  # Pillow draws shapes without antialiasing: draw larger, then shrink


@dataclass(frozen=True, slots=True)
class ShotStyle:
    """How pictures of a recording are taken.

    Attributes:
        size: width and height [px].
        azimuth: mean direction of the camera seen from the robot, 0 is ahead of it [rad].
        sway: the azimuth swings by this much [rad] around its mean; a still camera looks dead.
        elevation: camera angle above the floor [rad].
        distance: from the camera to the robot [m].
        smoothing: standard deviation [s] of the low-pass filter on where the camera looks.
        turn_smoothing: the same for its turning with the robot.
        detail: size of the smallest feature kept of the meshes [m].
        samples: edge of the sample grid in each pixel.
    """

    size: tuple[int, int] = (640, 400)
    azimuth: float = np.deg2rad(-52.0)
    sway: float = np.deg2rad(14.0)
    elevation: float = np.deg2rad(17.0)
    distance: float = 1.62
    smoothing: float = 0.6
    turn_smoothing: float = 1.5
    detail: float = 0.006
    samples: int = 2


@final
class FrameRenderer:
    """Takes pictures of a recording."""

    def __init__(
        self, recording: Recording, style: ShotStyle, annotations: Sequence[Annotation] = ()
    ) -> None:
        """Prepare the meshes and the path of the camera.

        Args:
            recording: what happened.
            style: how pictures are taken.
            annotations: broken limits take the label's place in captions while they are broken.
        """
        self._recording = recording
        self._broken = [annotation for annotation in annotations if annotation.is_broken]
        self._style = style
        visuals = visuals_of(recording)
        self._robot, self._foot_radius = (
            PosedRobot(visuals.simplified(style.detail)),
            visuals.foot_radius,
        )
        self._path = camera_path(recording, self._robot, smoothing=style.smoothing)
        self._ground = Relief(recording.ground) if len(recording.ground) else None
        self._heading = heading_path(recording, smoothing=style.turn_smoothing)

    def shoot(self, time: float) -> UInt8[np.ndarray, "h w 3"]:
        """The picture at ``time`` seconds after the start of the recording."""
        style, k = self._style, self._row(time)
        camera, robot = self._camera(time), self._robot.at(self._recording.q[k])
        turn = camera.azimuth - style.azimuth
        arrows, look = self._arrows(k), {"samples": style.samples, "turn": turn}
        return render(camera, robot, arrows, ground=self._ground, **look)

    def shoot_captioned(
        self, time: float, *, speed: float | int = 1.0, with_progress: bool = True
    ) -> UInt8[np.ndarray, "h w 3"]:
        """The picture at ``time`` with its caption along the lower edge.

        The caption says what the robot does, or which limit it breaks, the time, the ``speed`` of
        the playback if it is not 1, which feet touch the floor, and how much has passed.
        """
        image = Image.fromarray(self.shoot(time))
        width, height = image.size
        unit = height / 400
        band = round(52 * unit)
        strip = image.crop((0, height - band, width, height))
        fine = (width * _SUPERSAMPLING, band * _SUPERSAMPLING)
        strip = strip.resize(fine, Image.Resampling.BICUBIC)
        self._draw_label(strip, time, speed, unit * _SUPERSAMPLING)
        self._draw_feet(strip, time, unit * _SUPERSAMPLING)
        if with_progress:
            self._draw_progress(strip, time, unit * _SUPERSAMPLING)
        image.paste(strip.resize((width, band), Image.Resampling.BOX), (0, height - band))
        return np.asarray(image)

    def _draw_label(self, strip: Image.Image, time: float, speed: float, unit: float) -> None:
        """What the robot does, or what it breaks, in red; and the time."""
        broken = self._broken_at(time)
        label = self._recording.labels[self._row(time)]
        if broken is not None:
            label = f"{broken.limit}: {broken.subject}"
        words = label.replace("_", " ").strip()
        text = words[:1].upper() + words[1:]
        clock = f"{time:.1f} s" + (f"   {speed:g}x" if speed != 1.0 else "")
        draw, middle = ImageDraw.Draw(strip), strip.height - 28 * unit
        font, small = ImageFont.load_default(15 * unit), ImageFont.load_default(11.5 * unit)
        left, pad, half = 14 * unit, 11 * unit, 13 * unit
        right = left + draw.textlength(text, font) + 2 * pad
        back = INK if broken is None else ALARM
        draw.rounded_rectangle((left, middle - half, right, middle + half), half, fill=back)
        draw.text((left + pad, middle), text, "white", font, anchor="lm")
        draw.text((right + 10 * unit, middle), clock, MUTED, small, anchor="lm")

    def _draw_feet(self, strip: Image.Image, time: float, unit: float) -> None:
        """A box for each foot, coloured while it touches the floor."""
        draw, middle = ImageDraw.Draw(strip), strip.height - 28 * unit
        font = ImageFont.load_default(11.5 * unit)
        contacts = self._recording.foot_forces[self._row(time)] > _LEAST_FORCE
        for leg, color, touches in zip(LEGS, LEG_COLORS, contacts, strict=True):
            x = strip.width - (14 + 34 * (len(LEGS) - 1 - leg) + 14) * unit
            box = (x - 14 * unit, middle - 10 * unit, x + 14 * unit, middle + 10 * unit)
            draw.rounded_rectangle(box, 6 * unit, fill=color if touches else TRACK)
            draw.text((x, middle), leg.name, "white" if touches else MUTED, font, anchor="mm")

    def _draw_progress(self, strip: Image.Image, time: float, unit: float) -> None:
        draw, top = ImageDraw.Draw(strip), strip.height - 4 * unit
        share = time / max(self._recording.duration, 1e-9)
        draw.rectangle((0, top, strip.width, strip.height), fill=TRACK)
        draw.rectangle((0, top, strip.width * share, strip.height), fill=ACCENT)

    def _row(self, time: float) -> int:
        return int(nearest_rows(self._recording, np.array([time]))[0])

    def _broken_at(self, time: float) -> Annotation | None:
        for annotation in self._broken:
            if any(start - _INSTANT <= time <= end + _INSTANT for start, end in annotation.spans):
                return annotation
        return None

    def _camera(self, time: float) -> Camera:
        style = self._style
        times, points = self._path
        target = np.array([np.interp(time, times, points[:, axis]) for axis in range(3)])
        heading = np.interp(self._recording.time[0] + time, self._recording.time, self._heading)
        sway = style.sway * np.sin(2 * np.pi * time / _SWAY_PERIOD)
        azimuth = style.azimuth + heading + sway
        return Camera(target, float(azimuth), style.elevation, style.distance, style.size)

    def _arrows(self, k: int) -> list[Surface]:
        recording = self._recording
        feet = self._robot.feet(recording.q[k]) - [0.0, 0.0, self._foot_radius]
        return [
            arrow(foot, float(force) * _METRES_PER_NEWTON, 0.006, rgb(FORCE))
            for foot, force in zip(feet, recording.foot_forces[k], strict=True)
            if force > _LEAST_FORCE
        ]
