"""The film at the top of the README: the demo's run from the first steps on.

    python -m benchmarks.film docs/images/demo.webp

runs the demo in MuJoCo and writes the film. The camera stands still.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from controller.demo import run_demo
from controller.go2_controller import GO2Controller
from go2_wbc.errors import MotionError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording
from viz.render.animation import encoded_webp, frame_times
from viz.render.frame_renderer import FrameRenderer, ShotStyle

SPEED, RATE = 2.0, 10.0
"""Seconds of the run in a second of the film, and pictures in a second of it."""
LEAD = 0.6
"""How long [s] the robot stands before its first step."""
_STILL = 1e6  # [s] a path that is smoothed over so long is its mean
STYLE = ShotStyle(
    size=(640, 400),
    azimuth=np.deg2rad(15.0),
    sway=0.0,
    smoothing=_STILL,
    turn_smoothing=_STILL,
    distance=1.8,
    detail=0.004,
)
"""From where the robot is seen from the left at first, and shows its face after the turn."""
SIZE_LIMIT = 700_000
"""Largest film [bytes]."""


def film(recording: Recording) -> bytes:
    """The run as a looping WebP of at most ``SIZE_LIMIT`` bytes.

    Raises:
        ConfigError: if it is too long for that.
    """
    frame_renderer = FrameRenderer(recording, STYLE)
    frames = [
        Image.fromarray(frame_renderer.shoot_captioned(time, speed=SPEED))
        for time in frame_times(recording, speed=SPEED, fps=RATE)
    ]
    return encoded_webp(frames, round(1000 / RATE), SIZE_LIMIT)


def from_first_step(run: Recording) -> Recording:
    """The run from a moment before it first walks."""
    start = run.time[run.labels.index("walk")] - LEAD
    return run.part(slice(int(np.searchsorted(run.time, start)), None))


def main(argv: Sequence[str]) -> None:
    """Run the demo and write the film to ``argv[0]``."""
    target = checked_output(Path(argv[0]), (".webp",))
    with GO2Controller() as go2:
        report = run_demo(go2)
        run = go2.recording()
    if not report.ok:
        raise MotionError("the demo was not done: no film of it")
    write_atomically(target, film(from_first_step(run)))
    print(f"{target.name}: {target.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
