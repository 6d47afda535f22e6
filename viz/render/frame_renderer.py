"""Pictures of a recording at chosen times, in numpy and Pillow alone.

A camera that follows, the robot on its floor, force arrows, captions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image, ImageDraw, ImageFont

from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from go2_wbc.robot.rotations import yaw_rotation
from viz.content import Annotation
from viz.render.camera import Camera, camera_path, heading_path, nearest_rows
from viz.render.ground import Relief, paint_floor
from viz.render.mesh import Surface, arrow, plane_coefficients, rasterize
from viz.render.robot_meshes import PosedRobot, visuals_of
from viz.style import ACCENT, ALARM, FORCE, INK, LEG_COLORS, MUTED, TRACK, rgb

# Towards the key light and a weak fill light, world frame.
_LIGHTS = np.array([[0.35, -0.55, 0.95], [-0.8, -0.3, 0.35]])
_KEY_STRENGTH, _FILL_STRENGTH = 0.64, 0.16  # diffuse intensities
_SKY, _GROUND = 0.53, 0.30  # ambient intensities on faces that look up and down
_GLOSS, _SHININESS = 0.26, 28.0  # strength and exponent of the highlight (Blinn-Phong)
_EXTRAS_LEAD = 1.1  # extras count as nearer: an arrow shows in front of the leg that it stands in


def render(
    camera: Camera,
    robot: Surface,
    extras: Sequence[Surface] = (),
    *,
    ground: Relief | None = None,
    samples: int = 2,
    turn: float = 0.0,
) -> UInt8[np.ndarray, "h w 3"]:
    """One picture.

    Args:
        camera: view and picture size.
        robot: the robot's surface; throws the shadow.
        extras: more geometry, without shadow and in front, such as arrows.
        ground: the robot has seen.
        samples: edge of the sample grid in each pixel; 2 gives four samples.
        turn: of the lights about the vertical [rad], as when they move with the camera.
    """
    width, height = camera.size
    lights = towards_lights(turn)
    picture = paint_floor(camera, robot, lights[0])
    relief = [] if ground is None else [ground.seen_by(camera, robot, lights[0])]
    solids = Surface.joined([robot, *extras, *relief])
    finer = replace(camera, size=(samples * width, samples * height))
    projected = finer.project(solids.points)
    shown_through = sum(len(extra.points) for extra in extras)
    projected[len(robot.points) :, 2][:shown_through] *= _EXTRAS_LEAD
    brightness = _vertex_brightness(solids.normals, camera.R_camera_world[2], lights)
    color, coverage = _solids(solids, projected, brightness, camera.size, samples)
    picture *= 1 - coverage.reshape(height, width, 1)
    picture += color.reshape(height, width, 3)
    return np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def towards_lights(turn: float = 0.0) -> Float[np.ndarray, "2 3"]:
    """Unit vectors towards the key and the fill light, turned about the vertical [rad]."""
    lights = _LIGHTS @ yaw_rotation(turn).T
    return lights / np.linalg.norm(lights, axis=1, keepdims=True)


def _solids(
    solids: Surface,
    projected: Float[np.ndarray, "n 3"],
    brightness: Float[np.ndarray, "n 2"],
    size: tuple[int, int],
    samples: int,
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, " k"]]:
    """Colour (times coverage) and coverage of each pixel by solid geometry."""
    width, height = size
    sample, triangle = rasterize(projected, solids.triangles, (width * samples, height * samples))
    is_seen = np.bincount(triangle, minlength=len(solids.triangles)) > 0
    faces, slot = np.flatnonzero(is_seen), (np.cumsum(is_seen) - 1)[triangle]
    row, column = np.divmod(sample, width * samples)
    corners = solids.triangles[faces].T
    diffuse, highlight = _interpolated(projected, corners, brightness, (row, column, slot))
    pixel = (row // samples) * width + column // samples
    count = width * height
    share = 1 / samples**2
    color = np.empty((count, 3), dtype=np.float32)
    for channel in range(3):
        tint = solids.colors[faces, channel].astype(np.float32)[slot]
        value = np.minimum(tint * diffuse + highlight, 1)
        color[:, channel] = np.bincount(pixel, value, count) * share
    return color, (np.bincount(pixel, minlength=count) * share).astype(np.float32)


def _interpolated(
    projected: Float[np.ndarray, "n 3"],
    corners: Int[np.ndarray, "3 f"],
    values: Float[np.ndarray, "n c"],
    samples: tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"], Int[np.ndarray, " k"]],
) -> list[Float[np.ndarray, " k"]]:
    """Vertex values at samples, linear over each triangle and never beyond its corners.

    ``samples`` are row and column of each, and its column of ``corners``, the visible triangles.
    """
    row, column, slot = samples
    x, y = projected[:, 0][corners], projected[:, 1][corners]
    result = []
    for value in values.T[:, corners]:
        planes = plane_coefficients(x, y, value)
        step_x, step_y, start = (plane.astype(np.float32)[slot] for plane in planes)
        level = start + step_x * (column + np.float32(0.5)) + step_y * (row + np.float32(0.5))
        low, high = value.min(axis=0).astype(np.float32), value.max(axis=0).astype(np.float32)
        result.append(np.clip(level, low[slot], high[slot]))
    return result


def _vertex_brightness(
    normals: Float[np.ndarray, "n 3"],
    back: Float[np.ndarray, "3"],
    lights: Float[np.ndarray, "2 3"],
) -> Float[np.ndarray, "n 2"]:
    """Diffuse (times the material's colour) and white highlight, seen from the way ``back``."""
    key, fill = lights
    half = key + back
    half /= np.linalg.norm(half)
    upward = 0.5 + 0.5 * normals[:, 2]
    diffuse = _GROUND + (_SKY - _GROUND) * upward
    diffuse += _KEY_STRENGTH * np.maximum(normals @ key, 0)
    diffuse += _FILL_STRENGTH * np.maximum(normals @ fill, 0)
    highlight = _GLOSS * np.maximum(normals @ half, 0) ** _SHININESS
    return np.column_stack([diffuse, highlight])


_INSTANT = 0.04  # [s] a limit that is broken for an instant is told for this long around it
_SWAY_PERIOD = 26.0  # [s]
_METRES_PER_NEWTON = 0.002  # length of the force arrows
_LEAST_FORCE = 4.0  # [N] weaker forces draw no arrow
_SUPERSAMPLING = 3  # Pillow draws shapes without antialiasing: draw larger, then shrink


@dataclass(frozen=True, slots=True)
class ShotStyle:
    """How pictures of a recording are taken."""

    size: tuple[int, int] = (640, 400)  #: width and height [px]
    azimuth: float = np.deg2rad(-52.0)
    """Mean direction of the camera seen from the robot, 0 is ahead of it [rad]."""
    sway: float = np.deg2rad(14.0)
    """The azimuth swings by this much [rad] around its mean; a still camera looks dead."""
    elevation: float = np.deg2rad(17.0)  #: camera angle above the floor [rad]
    distance: float = 1.62  #: from the camera to the robot [m]
    smoothing: float = 0.6
    """Standard deviation [s] of the low-pass filter on where the camera looks."""
    turn_smoothing: float = 1.5  #: the same for its turning with the robot
    detail: float = 0.006  #: size of the smallest feature kept of the meshes [m]
    samples: int = 2  #: edge of the sample grid in each pixel


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
