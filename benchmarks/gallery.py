"""``python -m benchmarks gallery``: the pictures of the documentation, all of runs in MuJoCo.

Writes ``gallery.md`` and ``images/gallery/NAME.avif``, loops of the motions as they were measured:
AVIF takes a quarter of a WebP that moves (Pillow 11.3 or later). With ``--film`` it writes
``images/demo.webp`` instead: the README's film, the demo from the first steps on; and
``images/sight.avif``, the same over its course by sight.
"""

import io
from pathlib import Path
from typing import Annotated

import numpy as np
from PIL import Image, ImageSequence

from controller.cli.common import ExitCode
from controller.demo import DEMO_STEPS, run_demo
from controller.demo.steps import TERRAINS, terrain_steps
from controller.go2_controller import GO2Controller
from controller.studio.library import COLUMNS, PICTURE_SIZE, SHEET
from go2_wbc.errors import ConfigError, MotionError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.plant import MujocoPlant
from go2_wbc.recording import Recording
from motions import Motion, Timeline, find_motion, motion_names
from viz.render.frame_renderer import FrameRenderer, ShotStyle
from viz.render.pictures import encoded_webp, frame_times

LONG, FAST = 15.0, 2.0  # Length [s] from which on a motion is long, and is shown this much faster
RATE = 25.0  # Samples of the recording a second [Hz]
LOOP_RATE = 10.0  # Pictures in a second of a loop
QUALITY, EFFORT = 50, 6  # Of AVIF: 0 to 100; 10 to 0
STYLE = ShotStyle(
    size=(320, 240),
    azimuth=np.deg2rad(-42.0),
    elevation=np.deg2rad(20.0),
    sway=0.0,
    smoothing=1.5,
    turn_smoothing=20.0,
    distance=1.5,
    detail=0.003,
    samples=2,
)
"""A camera that nearly stands still, so that what moves is the robot."""
SHEET_QUALITY = 60  # Of WebP: 0 to 100
SIZE_LIMIT = 400_000  # Largest loop [bytes]
FILM_SPEED, FILM_RATE = 2.0, 10.0
"""Seconds of the run in a second of the film, and pictures in a second of it."""
LEAD = 0.6  #: How long [s] the robot stands in the film before its first step
_STILL = 1e6  # [s] a path that is smoothed over so long is its mean
FILM_STYLE = ShotStyle(
    size=(640, 400),
    azimuth=np.deg2rad(15.0),
    sway=0.0,
    smoothing=_STILL,
    turn_smoothing=_STILL,
    distance=1.8,
    detail=0.004,
)
"""A camera that sees the robot from the left at first, and its face after the turn."""
FILM_SIZE_LIMIT = 700_000  # Largest film [bytes]
HEAD = """# Gallery

<!-- written by `python -m benchmarks gallery docs`, not by hand -->

Every motion of the library, as it was measured in MuJoCo under `GO2Controller.play`. An orange
arrow is the normal force of a foot, 2 mm a newton. `go2-wbc list` prints the parameters,
`go2-wbc run NAME --html FILE` writes a run as a page that can be turned in 3D. How to write such a
motion: the [tutorial](tutorial.md).

Over a course by sight, `go2-wbc demo --terrain course`: the ground is drawn as the robot's lidar
has seen it ([how](how-to/worlds.md#by-sight)).

![Stairs, a block, stepping stones and a gap](images/sight.avif)
"""


def run(
    folder: Annotated[Path, "FOLDER", "of the page"],
    names: Annotated[tuple[str, ...], "MOTION", "default: all"] = (),
    *,
    film: Annotated[bool, "write the two films of the demo instead"] = False,
) -> int:
    """Play the motions of the library in MuJoCo; write a page with pictures of them.

    Examples:
    python -m benchmarks gallery docs              the page and all pictures
    python -m benchmarks gallery docs bow wave     the page and these pictures
    python -m benchmarks gallery docs --film         the films of the pages
    """
    if film:
        _write(folder / "images" / "demo.webp", film_of(from_first_step(demo())))
        _write(folder / "images" / "sight.avif", loop(from_first_step(demo("course"))))
        return ExitCode.OK
    target = checked_output(folder / "gallery.md", (".md",))
    timelines = [find_motion(name)() for name in names or motion_names()]
    with GO2Controller() as robot:
        robot.stand()
        for line in timelines:
            recording = played(line, robot)
            _write(folder / "images" / "gallery" / f"{line.name}.avif", loop(recording))
    write_atomically(SHEET, sheet(folder / "images" / "gallery"))
    write_atomically(target, page().encode())
    return ExitCode.OK


def _write(name: Path, content: bytes) -> None:
    write_atomically(checked_output(name, (".webp", ".avif")), content)
    print(f"{name.stem:<14}{len(content):>7} bytes")


def page() -> str:
    """The gallery's text: a section for every motion of the library."""
    found = [find_motion(name) for name in motion_names()]
    index = " · ".join(f"[{motion.name}](#{motion.name})" for motion in found)
    return "\n".join([HEAD, index, "", *(_section(motion) for motion in found)])


def sheet(folder: Path) -> bytes:
    """The motions as the studio offers them: of each loop the picture that is least like its start.

    In the order of ``motion_names()``, in rows.
    """
    names, (width, height) = motion_names(), PICTURE_SIZE
    whole = Image.new("RGB", (width * COLUMNS, height * -(-len(names) // COLUMNS)))
    for number, name in enumerate(names):
        with Image.open(folder / f"{name}.avif") as loop_of_it:
            pictures = [
                picture.convert("RGB").resize(PICTURE_SIZE, Image.Resampling.LANCZOS)
                for picture in ImageSequence.Iterator(loop_of_it)
            ]
        values = np.array([np.asarray(picture, dtype=float) for picture in pictures])
        unlike = np.abs(values - values[0]).mean(axis=(1, 2, 3))
        place = width * (number % COLUMNS), height * (number // COLUMNS)
        whole.paste(pictures[int(np.argmax(unlike))], place)
    stream = io.BytesIO()
    whole.save(stream, "WEBP", quality=SHEET_QUALITY, method=6)
    return stream.getvalue()


def _section(motion: Motion) -> str:
    length = motion().end
    pace = f", here {FAST:g} times as fast" if speed_of(length) > 1.0 else ""
    lines = [
        f"## {motion.name}",
        "",
        motion.summary,
        "",
        f"![{motion.summary.split(':')[0]}](images/gallery/{motion.name}.avif)",
        "",
        f"`go2-wbc run {motion.name}`, {length:.1f} s{pace}.",
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


def loop(recording: Recording) -> bytes:
    """The run as a looping AVIF of at most ``SIZE_LIMIT`` bytes.

    Raises:
        ConfigError: if it is larger.
    """
    frame_renderer, stream = FrameRenderer(recording, STYLE), io.BytesIO()
    times = frame_times(recording, speed=speed_of(recording.duration), fps=LOOP_RATE)
    first, *rest = (Image.fromarray(frame_renderer.shoot(time)) for time in times)
    film = {"save_all": True, "append_images": rest, "duration": round(1000 / LOOP_RATE)}
    first.save(stream, "AVIF", quality=QUALITY, speed=EFFORT, **film)
    if stream.tell() > SIZE_LIMIT:
        raise ConfigError(f"the loop would have {stream.tell()} bytes, limit {SIZE_LIMIT}")
    return stream.getvalue()


def speed_of(length: float) -> float:
    """How much faster than it is a motion of this length [s] is shown."""
    return FAST if length >= LONG else 1.0


def demo(terrain: str | None = None) -> Recording:
    """A run of the demo, or of that over a terrain by sight.

    Raises:
        MotionError: if it was not done.
    """
    plant, steps = None, DEMO_STEPS
    if terrain is not None:
        ground = TERRAINS[terrain]
        plant, steps = MujocoPlant(terrain=ground, lidar=True, sensors="imu"), terrain_steps(ground)
    with GO2Controller(plant=plant) as go2:
        if not run_demo(go2, steps=steps).ok:
            raise MotionError("the demo was not done: no film of it")
        return go2.recording()


def from_first_step(run: Recording) -> Recording:
    """The run from a moment before it first walks."""
    start = run.time[run.labels.index("walk")] - LEAD
    return run.part(slice(int(np.searchsorted(run.time, start)), None))


def film_of(recording: Recording) -> bytes:
    """The run as a looping WebP of at most ``FILM_SIZE_LIMIT`` bytes.

    Raises:
        ConfigError: if it is too long for that.
    """
    frame_renderer = FrameRenderer(recording, FILM_STYLE)
    frames = [
        Image.fromarray(frame_renderer.shoot_captioned(time, speed=FILM_SPEED))
        for time in frame_times(recording, speed=FILM_SPEED, fps=FILM_RATE)
    ]
    return encoded_webp(frames, round(1000 / FILM_RATE), FILM_SIZE_LIMIT)
