"""The studio's page in a browser, with the file that it edits."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from controller.cli.motion_preview import POLL_PERIOD
from controller.studio.session import Studio
from tests.viz.replay.browsing import Tab

SETTLED = "!studio.isBusy && !studio.waiting"


@contextmanager
def served(file: Path) -> Iterator[str]:
    """The address of a studio in this process, where the robot is loaded; it looks at its file."""
    is_over = threading.Event()
    with Studio(file, None, 0) as studio:

        def look() -> None:
            while not is_over.wait(POLL_PERIOD):
                studio.look()

        looking = threading.Thread(target=look)
        looking.start()
        try:
            yield studio.url
        finally:
            is_over.set()
            looking.join()


@contextmanager
def studio_tab(url: str, tab: Tab) -> Iterator[Tab]:
    """The page as it is opened first; it must not complain, nor ask another server."""
    tab.complaints.clear()
    tab.requested.clear()
    tab.open(url)
    tab.wait_for("window.studio && replay.version")
    yield tab
    assert tab.complaints == []
    assert all(one.startswith(url.partition("?")[0]) for one in tab.requested)
    tab.page.goto("about:blank")  # its server ends


def do(tab: Tab, gesture: str) -> None:
    """Have the page do something, and wait until it is done."""
    tab.evaluate(gesture)
    tab.wait_for(SETTLED)


def undo_all(tab: Tab, file: Path, first: str) -> None:
    """Undone, the file is as it was at first."""
    while tab.evaluate("studio.editor.undo"):
        do(tab, "studio.act('undo')")
    assert file.read_text(encoding="utf-8") == first
