"""Writes a recording or a plan as one web page that needs nothing else: no server, no network."""

from __future__ import annotations

import html
from importlib import resources
from pathlib import Path

import meshcat

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording
from viz.content import ReplayContent, checked_content
from viz.replay.packing import compressed_text
from viz.replay.page_data import content_text, scene_text

HTML_SUFFIXES = (".html", ".htm")
PAGE_LIMIT = 4_000_000  #: Largest page [bytes]
_SCRIPTS = "data stage scene ghost steps flags charts trust verdict sound app"
"""Of the assets, in the order in which they need one another; a live page has another one."""


@typed()
def export_html(shown: Recording | ReplayContent, path: Path, *, title: str) -> Path:
    """Write an interactive 3D replay as one self-contained page; gives its absolute path.

    Args:
        shown: what happened, or a plan, with what there is to say about it.
        path: file to write, ``.html``.
        title: heading and window title; any text.

    Raises:
        ConfigError: for a path that cannot be written, a recording that cannot be drawn, or one
            so large that the page would exceed ``PAGE_LIMIT``.
        DescriptionError: if the robot's files are missing.
    """
    target = checked_output(path, HTML_SUFFIXES)
    return write_atomically(target, replay_html(shown, title=title).encode())


def replay_html(shown: Recording | ReplayContent, *, title: str) -> str:
    """The page of ``export_html`` as text; raises as it does, but for the path."""
    content = checked_content(shown)
    page = page_text(title, scene_text(content.recording), content_text(content, title))
    if (size := len(page.encode())) > PAGE_LIMIT:
        raise ConfigError(
            f"the page would have {size} bytes, limit {PAGE_LIMIT}; record a shorter run"
        )
    return page


def page_text(title: str, scene: str, data: str, *, is_live: bool = False) -> str:
    """The page of a packed scene and what happens in it; a live one listens to its server."""
    scripts = f"{_SCRIPTS} live" if is_live else _SCRIPTS
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    parts = {
        "TITLE": html.escape(title),
        "STYLE": _asset("replay.css"),
        "SCRIPT": "\n".join(_asset(f"replay_{name}.js") for name in scripts.split()),
        "MESHCAT": compressed_text(bundle.read_bytes()),
        "SCENE": scene,
        "DATA": data,
    }
    pieces = _asset("replay.html").split("@")
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def _asset(name: str) -> str:
    return resources.files("viz.replay").joinpath("assets", name).read_text(encoding="utf-8")
