"""What the studio writes beside the file, and what is done with it then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Final

import viz
from controller.studio.songs import songs_beside, sound_of
from go2_wbc.errors import Go2WbcError, unknown_name
from go2_wbc.files import checked_output, write_atomically
from viz.content import ReplayContent
from viz.replay.page_data import Prepared

EXPORTS: Final[Mapping[str, str]] = {
    "html": "Offline page",
    "webp": "Film (WebP)",
    "mp4": "MP4 film",
    "csv": "CSV trajectory",
    "npz": "NumPy trajectory",
    "json": "JSON motion",
    "plan": "Plan",
    "ros2": "ROS 2 plan",
    "unitree": "Unitree plan",
    "test": "Test for pytest",
}
"""What each kind is called on the page; its first letter is the key that chooses it in the list."""
PICTURES: Final = ("html", "webp", "mp4")  #: Kinds that are made of what the page shows
FPS: Final = {".webp": 12.5, ".mp4": 25.0}
"""Pictures a second: a WebP of more is too large, or too coarse."""
_THEN: Final = {
    "json": "go2-wbc run {0}",
    "plan": "go2-wbc run {0}",
    "ros2": "go2-wbc ros2 --realtime --motions .",
    "unitree": "go2-wbc unitree-drive --interface lo --domain 1 --i-have-the-remote-in-hand"
    " --steps stand {0} lie_down",
    "test": "pytest {0}",
}
_BRIDGES: Final = {  # what else is told of a plan that a bridge plays
    "ros2": ", which play() of GO2ControllerNode then plays by its name",
    "unitree": ", for go2-wbc unitree-sim; of a robot the interface is another, and the domain 0",
}
_TEST: Final = '''"""Can the robot do ``{motion}``? Run: pytest test_{motion}.py"""

from pathlib import Path

from motions import load_file


def test_the_robot_can_do_{motion}(check_motion):
    """If not, this tells which limit is broken, when, and by how much."""
    check_motion(load_file(Path(__file__).with_name({file!r}))[{motion!r}])
'''


def exported(
    file: Path,
    motion: str,
    order: Mapping[str, object],
    content: Callable[[], ReplayContent],
    write: Callable[[Path], object],
) -> tuple[dict[str, object], Path | None]:
    """Write a motion beside its file; what the page is told, and the file that was written.

    A file that is there is written over only ``again``; "exists" asks for that. A test that is
    there is kept.

    Args:
        file: of the motion.
        motion: its name.
        order: ``kind`` is one of ``EXPORTS``; a page has the ``song`` that is named.
        content: what a page or film shows.
        write: writes anything else.
    """
    kind = order.get("kind")
    if not isinstance(kind, str) or kind not in EXPORTS:
        return {"error": unknown_name("kind", str(kind), EXPORTS)}, None
    path, is_new = beside(file, motion, kind), True
    if kind != "test" and path.exists() and order.get("again") is not True:
        return {"exists": path.name}, None
    try:
        if kind == "test":
            is_new = write_test(path, file, motion)
        elif kind in PICTURES:
            write_pictures(content(), path, file, motion, order.get("song"))
        else:
            write(path)
    except Go2WbcError as error:
        return {"error": str(error)}, None
    return answer(path, kind, is_new=is_new), path


def beside(file: Path, motion: str, kind: str) -> Path:
    """Where an export of a motion lies."""
    ending = f"{kind}.plan" if kind in _BRIDGES else kind
    return file.with_name(f"test_{motion}.py" if kind == "test" else f"{motion}.{ending}")


def answer(path: Path, kind: str, *, is_new: bool = True) -> dict[str, object]:
    """What the page tells of a file, with the command ``then`` that takes it, if there is one."""
    told = f"wrote {path.name}" if is_new else f"{path.name} is there already, and stays"
    told += _BRIDGES.get(kind, "")
    then = {"then": _THEN[kind].format(quote(path.name))} if kind in _THEN else {}
    return {"told": told, "file": path.name, "folder": str(path.resolve().parent), **then}


def write_test(path: Path, file: Path, motion: str) -> bool:
    """Write a test of a motion of ``file``; whether it was not there, since others are kept.

    Raises:
        ConfigError: where it cannot be written.
    """
    if path.exists():
        return False
    text = _TEST.format(motion=motion, file=file.name)
    write_atomically(checked_output(path, [".py"]), text.encode())
    return True


def write_pictures(
    content: ReplayContent, path: Path, file: Path, title: str, song: object
) -> None:
    """Write an offline page, with the ``song`` that lies beside ``file``, or a film.

    Raises:
        ConfigError: where it cannot be written, or is too long for a WebP.
        MissingDependency: for an MP4, without the extra.
    """
    if path.suffix == ".html":
        if song in songs_beside(file):
            content = replace(content, sound=sound_of(file.with_name(str(song))))
        viz.export_html(content, path, title=title)
    else:
        viz.export_animation(content, path, speed=1.0, fps=FPS[path.suffix])


def whole(content: ReplayContent | Prepared) -> ReplayContent:
    """What was asked for as a whole.

    Raises:
        TypeError: if it is only what a page needs.
    """
    if isinstance(content, Prepared):
        raise TypeError("only what a page needs")
    return content
