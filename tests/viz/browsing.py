"""What the browser tests share: pictures of the 3D view, and what a page must not do."""

from __future__ import annotations

import io

import numpy as np
from jaxtyping import Float
from PIL import Image

from tests.viz.chromium import Chromium

DRAWN = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
STAGE = (20, 60, 955, 440)
"""Left, top, right, bottom [px] of the 3D view without its buttons, in a window of 1280 by 720."""


def stage(browser: Chromium) -> Float[np.ndarray, "h w 3"]:
    """The 3D view now."""
    browser.evaluate(DRAWN)
    with Image.open(io.BytesIO(browser.screenshot())) as image:
        return np.asarray(image.convert("RGB").crop(STAGE), dtype=float)


def complaints(browser: Chromium) -> list[object]:
    """Errors on the console, and exceptions."""
    return [
        *browser.seen("Runtime.exceptionThrown"),
        *browser.seen("Log.entryAdded", lambda p: p["entry"]["level"] == "error"),
        *browser.seen("Runtime.consoleAPICalled", lambda p: p["type"] == "error"),
    ]


def requested(browser: Chromium) -> list[str]:
    """Addresses that the page asked for, without those inside itself."""
    urls = [event["request"]["url"] for event in browser.seen("Network.requestWillBeSent")]
    return [url for url in urls if not url.startswith(("data:", "blob:"))]
