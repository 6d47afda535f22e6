"""Pictures of a recording at chosen times: camera that follows, force arrows, captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import UInt8

from go2_wbc.recording import Recording
from go2_wbc.robot.model import FOOT_RADIUS
from viz.content import Annotation
from viz.palette import FORCE, rgb
from viz.render.camera import Camera
from viz.render.framing import camera_path, heading_path, nearest_rows
from viz.render.mesh import Surface
from viz.render.overlay import Caption, draw_caption
from viz.render.posed_robot import PosedRobot, arrow
from viz.render.renderer import render
from viz.render.robot_meshes import load_robot_visuals

_INSTANT = 0.04  # [s] a limit that is broken for an instant is told for this long around it
_SWAY_PERIOD = 26.0  # [s]
_METRES_PER_NEWTON = 0.002  # length of the force arrows
_LEAST_FORCE = 4.0  # [N] weaker forces draw no arrow


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
        self._robot = PosedRobot(load_robot_visuals().simplified(style.detail))
        self._path = camera_path(recording, self._robot, smoothing=style.smoothing)
        self._heading = heading_path(recording, smoothing=style.turn_smoothing)

    def shoot(self, time: float) -> UInt8[np.ndarray, "h w 3"]:
        """The picture at ``time`` seconds after the start of the recording."""
        style, k = self._style, self._row(time)
        camera, robot = self._camera(time), self._robot.at(self._recording.q[k])
        turn = camera.azimuth - style.azimuth
        return render(camera, robot, self._arrows(k), samples=style.samples, turn=turn)

    def shoot_captioned(
        self, time: float, *, speed: float | int = 1.0, with_progress: bool = True
    ) -> UInt8[np.ndarray, "h w 3"]:
        """The picture at ``time`` with its caption."""
        recording, k = self._recording, self._row(time)
        broken = self._broken_at(time)
        caption = Caption(
            label=recording.labels[k] if broken is None else f"{broken.limit}: {broken.subject}",
            time=time,
            progress=time / max(recording.duration, 1e-9) if with_progress else None,
            contacts=recording.foot_forces[k] > _LEAST_FORCE,
            speed=speed,
            is_alarm=broken is not None,
        )
        return draw_caption(self.shoot(time), caption)

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
        feet = self._robot.feet(recording.q[k]) - [0.0, 0.0, FOOT_RADIUS]
        return [
            arrow(foot, float(force) * _METRES_PER_NEWTON, 0.006, rgb(FORCE))
            for foot, force in zip(feet, recording.foot_forces[k], strict=True)
            if force > _LEAST_FORCE
        ]
