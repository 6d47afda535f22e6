"""A page in the system's Chromium, headless, driven by Playwright."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn, final

import numpy as np
import pytest
from jaxtyping import Float
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Browser, ConsoleMessage, Page, Request

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER_VARIABLE = "GO2_WBC_CHROMIUM"
"""Environment variable with the path of the browser to test with."""
IS_REQUIRED = os.environ.get("GO2_WBC_REQUIRE_BROWSER") == "1"
"""What is missing is then a failure, not a test that is skipped."""
DRAWN = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""A promise of two frames of the page; the 3D view is drawn in ``Tab.draw`` only."""
_DRAW_WHEN_LOOKED_AT = """(() => {
    let shown;
    Object.defineProperty(window, "replay", { get: () => shown, set: (player) => {
        const {viewer} = (shown = player).scene, draw = viewer.render.bind(viewer);
        viewer.render = () => { if (window.isLookedAt) draw(); };
    } });
})()"""
"""From the first frame on; what is not drawn stays marked as to be drawn. In software a frame takes
0.4 s of processor, the first one 1 s."""
STAGE = (20, 60, 955, 440)
"""Left, top, right, bottom [px] of the 3D view without its buttons, in a window of 1280 by 720."""
SIZE = (1280, 720)  #: Width and height [px] of the window as it is opened
_SOFTWARE_GL = [
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # else the page around the 3D view is drawn through it as well
]
_PATIENCE = 60_000.0  # [ms] software rendering on a busy machine is slow


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser; without one the test is skipped, or has failed where it is required."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        absent("Playwright is not installed: pip install playwright")
    path = os.environ.get(BROWSER_VARIABLE) or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        absent(f"no Chromium on this machine: apt-get install chromium, or set {BROWSER_VARIABLE}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=_SOFTWARE_GL)
        yield browser
        browser.close()


def absent(reason: str) -> NoReturn:
    """End the test: as failed where the browser is required, else as skipped."""
    if IS_REQUIRED:
        pytest.fail(reason)
    pytest.skip(reason)


@final
class Tab:
    """One page of a browser that asks for little motion: a replay waits until it is played.

    Attributes:
        page: Playwright's page.
        complaints: errors on its console, and exceptions.
        requested: addresses that it asked for, without those inside itself.
    """

    def __init__(self, browser: Browser, *, offline: bool = False) -> None:
        self._context = browser.new_context(
            viewport={"width": SIZE[0], "height": SIZE[1]},
            offline=offline,
            reduced_motion="reduce",  # drawing each frame in software would cost most of the time
        )
        self._context.set_default_timeout(_PATIENCE)
        self._context.add_init_script(_DRAW_WHEN_LOOKED_AT)
        self.page: Page = self._context.new_page()
        self.complaints: list[str] = []
        self.requested: list[str] = []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", self._on_console)
        self.page.on("request", self._on_request)

    def _on_console(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.complaints.append(message.text)

    def _on_request(self, request: Request) -> None:
        if not request.url.startswith(("data:", "blob:")):
            self.requested.append(request.url)

    def open(self, url: str) -> None:
        """Go to a replay page and wait until it shows something."""
        self.page.goto(url)
        self.wait_for("window.replay")

    def evaluate(self, expression: str) -> Any:  # noqa: ANN401 - whatever the page holds
        """Value of a JavaScript expression; promises are awaited."""
        return self.page.evaluate(expression)

    def wait_for(self, expression: str) -> None:
        """Wait until a JavaScript expression is true.

        Playwright's ``wait_for_function`` calls ``eval`` in the page, which a live page forbids.
        """
        self.evaluate(
            f"new Promise((done, fail) => {{ setTimeout(() => fail({expression!r}), {_PATIENCE});"
            f" const look = () => ({expression}) ? done() : setTimeout(look, 20); look(); }})"
        )

    def text(self, selector: str) -> str:
        """Words of the first element that a CSS selector finds."""
        return self.evaluate(f"document.querySelector('{selector}').textContent")

    def click(self, selector: str) -> None:
        """Click the first element that a CSS selector finds, also one that is covered."""
        self.evaluate(f"document.querySelector('{selector}').click()")

    def is_shown(self, selector: str) -> bool:
        """Whether the page displays the first element that a CSS selector finds."""
        shown = f"getComputedStyle(document.querySelector('{selector}')).display !== 'none'"
        return self.evaluate(shown)

    def resize(self, width: int, height: int) -> None:
        """Give the window another size [px], and lay the page out in it."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.evaluate(DRAWN)

    def draw(self) -> None:
        """Draw the 3D view, if anything in it has changed."""
        self.evaluate(
            "isLookedAt = true; if (replay.scene.viewer.needs_render) replay.scene.viewer.render();"
            f" {DRAWN}.then(() => {{ isLookedAt = false; }})"
        )

    def stage(self) -> Float[np.ndarray, "h w 3"]:
        """The 3D view now."""
        self.draw()
        left, top, right, bottom = STAGE
        picture = self.page.screenshot(
            clip={"x": left, "y": top, "width": right - left, "height": bottom - top}
        )
        with Image.open(io.BytesIO(picture)) as image:
            return np.asarray(image.convert("RGB"), dtype=float)

    def __enter__(self) -> Tab:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.close()
