"""``python -m benchmarks gallery``: every motion of the library, moments of it in a picture.

Writes ``gallery.md`` and ``images/gallery/NAME.webp``: the start, and the moments in which the
robot, as measured, is farthest from it and from each other.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont

from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.go2_controller import GO2Controller
from go2_wbc.errors import MotionError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.plant import MujocoPlant
from go2_wbc.recording import Recording
from motions import Motion, Timeline, find_motion, motion_names
from viz.palette import INK
from viz.render.frame_renderer import FrameRenderer, ShotStyle
from viz.render.posed_robot import PosedRobot
from viz.render.robot_meshes import load_robot_visuals

MOMENTS = 3
"""Panels in a line; a long motion has two lines of them."""
LONG = 15.0
"""Length [s] from which on a motion is long."""
FAR = 0.3
"""Share of the greatest deviation from the start that a pose must have to be shown."""
RATE = 25.0
"""Samples of the recording a second [Hz]."""
PANEL = (400, 300)
"""Width and height [px] of a panel."""
GAP = 6
"""Width [px] of the gap between panels."""
STYLE = ShotStyle(
    size=PANEL,
    azimuth=np.deg2rad(-42.0),
    elevation=np.deg2rad(20.0),
    sway=0.0,
    smoothing=1.5,
    turn_smoothing=20.0,
    distance=1.5,
    detail=0.003,
    samples=3,
)
"""A camera that nearly stands still, so that what differs between the panels is the robot."""
QUALITIES = (88, 80, 72, 64, 56)
"""Of the compression: the first that keeps a picture small enough."""
SIZE_LIMIT = 60_000
"""Largest picture [bytes]."""
TRUNK_POINTS = np.array([[0.35, 0.0, 0.0], [-0.25, 0.0, 0.0], [0.0, 0.0, 0.15]])
"""Nose, tail, and a point [m] above the trunk, in its frame: they tell attitudes apart."""

HEAD = """# Gallery

<!-- written by `python -m benchmarks gallery docs`, not by hand -->

Every motion of the library. A picture shows the start and the most telling moments of one run in
MuJoCo under `GO2Controller.play`, with the time since the start of the motion. An orange arrow is
the measured normal force of a foot, 2 mm a newton. `go2-wbc list` prints the parameters,
`go2-wbc run NAME --html FILE` writes a run as a page that can be turned in 3D. How to write such a
motion: the [tutorial](tutorial.md).
"""


EXAMPLES = """
python -m benchmarks gallery docs              the page and all pictures
python -m benchmarks gallery docs bow wave     the page and these pictures
"""


def register(subparsers: Subparsers) -> None:
    """Add the arguments of ``gallery``."""
    parser = add_parser(
        subparsers,
        "gallery",
        "Play the motions of the library in MuJoCo; write a page with pictures of them.",
        examples=EXAMPLES,
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="of the page")
    parser.add_argument("names", metavar="MOTION", nargs="*", help="default: all")


def run(args: argparse.Namespace) -> int:
    """Write the page, and the pictures of the motions that were named."""
    target = checked_output(args.folder / "gallery.md", (".md",))
    timelines = [find_motion(name)() for name in args.names or motion_names()]
    with GO2Controller(plant=MujocoPlant()) as robot:
        robot.stand()
        for line in timelines:
            recording = played(line, robot)
            name = args.folder / "images" / "gallery" / f"{line.name}.webp"
            file = write_atomically(
                checked_output(name, (".webp",)), picture(recording, telling_rows(recording))
            )
            print(f"{line.name:<14}{file.stat().st_size:>7} bytes")
    write_atomically(target, page().encode())
    return ExitCode.OK


def page() -> str:
    """The gallery's text: a section for every motion of the library."""
    found = [find_motion(name) for name in motion_names()]
    index = " · ".join(f"[{motion.name}](#{motion.name})" for motion in found)
    return "\n".join([HEAD, index, "", *(_section(motion) for motion in found)])


def _section(motion: Motion) -> str:
    lines = [
        f"## {motion.name}",
        "",
        motion.summary,
        "",
        f"![{motion.summary.split(':')[0]}](images/gallery/{motion.name}.webp)",
        "",
        f"`go2-wbc run {motion.name}`, {motion().end:.1f} s.",
    ]
    if motion.parameters:
        lines += ["", "| parameter | default | valid |", "|---|---|---|"]
    for item in motion.parameters:
        default = f"{item.default:.3g}" if isinstance(item.default, float) else item.default
        lines.append(f"| `{item.name}` | {default} | {item.valid} |")
    return "\n".join([*lines, ""])


def played(motion: Timeline, robot: GO2Controller) -> Recording:
    """What was measured while a standing ``robot`` did ``motion``.

    Raises:
        MotionError: if it was not done.
    """
    if not robot.play(motion):
        raise MotionError(f"{motion.name} was not done: {robot.last_outcome.reason}")
    whole = robot.recording(rate=RATE)
    rows = np.flatnonzero(np.array(whole.labels) == motion.name)
    return whole.part(rows)


def telling_rows(recording: Recording) -> list[int]:
    """Rows, in order: the start, the pose farthest from it, the one farthest from these, ...

    Farthest-point sampling (Gonzalez 1985) on the places of nose, tail, feet and a point above the
    trunk, among the rows that are at least ``FAR`` of the way from the start.
    """
    robot = PosedRobot(load_robot_visuals())
    points = np.array([_points(q, robot) for q in recording.q])
    away = np.linalg.norm(points - points[0], axis=1)
    distance = np.where(away >= FAR * away.max(), away, -1.0)
    chosen = [0]
    while len(chosen) < (MOMENTS if recording.duration < LONG else 2 * MOMENTS):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return sorted(chosen)


def picture(recording: Recording, rows: Sequence[int]) -> bytes:
    """The moments, ``MOMENTS`` in a line, as one WebP of at most ``SIZE_LIMIT`` bytes."""
    frame_renderer = FrameRenderer(recording, STYLE)
    width, height = PANEL
    lines = -(-len(rows) // MOMENTS)
    size = (MOMENTS * (width + GAP) - GAP, lines * (height + GAP) - GAP)
    sheet = Image.new("RGB", size, "white")
    font = ImageFont.load_default(15)
    for place, row in enumerate(rows):
        time = float(recording.time[row] - recording.time[0])
        panel = Image.fromarray(frame_renderer.shoot(time))
        corner = (width - 12, height - 10)
        ImageDraw.Draw(panel).text(corner, f"{time:.1f} s", INK, font, anchor="rs")
        line, column = divmod(place, MOMENTS)
        sheet.paste(panel, (column * (width + GAP), line * (height + GAP)))
    content = b""
    for quality in QUALITIES:
        stream = io.BytesIO()
        sheet.save(stream, "WEBP", quality=quality, method=6)
        content = stream.getvalue()
        if len(content) <= SIZE_LIMIT:
            break
    return content


def _points(q: Float[np.ndarray, "19"], robot: PosedRobot) -> Float[np.ndarray, " k"]:
    """Places [m] in the world that tell poses apart."""
    return np.vstack([robot.feet(q), robot.on_trunk(TRUNK_POINTS)]).ravel()
