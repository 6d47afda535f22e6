"""One browser for all tests here that open pages, and no two in a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import viz
from go2_wbc.recording import Recording
from tests.viz.replay.browsing import Tab, chromium
from tests.viz.replay.studio_tab import served, studio_tab, undo_all
from viz.content import ReplayContent

if TYPE_CHECKING:
    from playwright.sync_api import Browser

OpenPage = Callable[[Recording | ReplayContent], AbstractContextManager[Tab]]


@pytest.fixture(scope="package")
def chromium_browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def open_page(chromium_browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> OpenPage:
    """Opens an exported page from its file, without a network."""

    @contextmanager
    def opened(shown: Recording | ReplayContent) -> Iterator[Tab]:
        page = viz.export_html(shown, tmp_path_factory.mktemp("page") / "page.html", title="A walk")
        with Tab(chromium_browser, offline=True) as tab:
            tab.open(page.as_uri())
            yield tab

    return opened


@pytest.fixture(scope="package")
def studio_page(chromium_browser: Browser) -> Iterator[Tab]:
    """One for all studios: the next one opens in half the time where one was open before."""
    with Tab(chromium_browser) as tab:
        yield tab


@pytest.fixture(scope="module")
def studio(file: Path, studio_page: Tab) -> Iterator[Tab]:
    """The studio's page with the ``file`` of the module, by one who needs no tour."""
    with served(file) as url, studio_tab(url, studio_page) as tab:
        tab.page.get_by_role("button", name="Skip the tour").click()
        yield tab


@pytest.fixture
def tab(studio: Tab, file: Path) -> Iterator[Tab]:
    """The studio's page, its file as it was at first; undone, it is so again."""
    first = file.read_text(encoding="utf-8")
    yield studio
    undo_all(studio, file, first)
