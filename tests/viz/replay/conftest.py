"""One browser for each module of tests that open pages, and no two in a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING

import pytest

import viz
from go2_wbc.recording import Recording
from tests.viz.replay.browsing import Tab, chromium
from viz.content import ReplayContent

if TYPE_CHECKING:
    from playwright.sync_api import Browser

OpenPage = Callable[[Recording | ReplayContent], AbstractContextManager[Tab]]


@pytest.fixture(scope="module")
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
