"""The studio's page in a browser, with the file that it edits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tests.live_preview import LivePreview
from tests.viz.replay.browsing import Tab

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SETTLED = "!studio.isBusy && !studio.waiting"


@contextmanager
def studio_tab(file: Path, browser: Browser) -> Iterator[Tab]:
    """The page as it is opened first; it must not complain, nor ask another server."""
    with LivePreview(str(file), command="studio") as opened, Tab(browser) as tab:
        tab.open(opened.url)
        tab.wait_for("window.studio && replay.version")
        yield tab
        assert tab.complaints == []
        assert all(url.startswith(opened.url.partition("?")[0]) for url in tab.requested)


def do(tab: Tab, gesture: str) -> None:
    """Have the page do something, and wait until it is done."""
    tab.evaluate(gesture)
    tab.wait_for(SETTLED)


def undo_all(tab: Tab, file: Path, first: str) -> None:
    """Undone, the file is as it was at first."""
    while tab.evaluate("studio.editor.undo"):
        do(tab, "studio.act('undo')")
    assert file.read_text(encoding="utf-8") == first
