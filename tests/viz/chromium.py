"""Drives a headless Chromium through its debugging pipe: standard library only.

The DevTools protocol over ``--remote-debugging-pipe``: the browser reads JSON messages from file
descriptor 3 and writes them to 4, each ended by a zero byte. No port, no driver, no package.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, final

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER_VARIABLE = "GO2_WBC_CHROMIUM"
"""Environment variable with the path of the browser to test with."""
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe",
)
_BROWSER_READS, _BROWSER_WRITES = 3, 4  # file descriptors, fixed by the browser
_ANSWER_LIMIT = 60.0  # [s] software rendering on a busy machine is slow
_CHUNK = 1 << 16


def find_chromium() -> str | None:
    """Path of a Chromium or Chrome on this machine."""
    named = os.environ.get(BROWSER_VARIABLE)
    return named or next((path for name in NAMES if (path := shutil.which(name))), None)


class BrowserError(Exception):
    """The browser refused a command, died, or did not answer in time."""


@final
class Chromium:
    """One headless browser with one page; a context manager."""

    def __init__(self, executable: str, profile: Path, size: tuple[int, int]) -> None:
        """Start the browser with an empty profile folder.

        Args:
            executable: see ``find_chromium``.
            profile: empty folder for the browser's own files.
            size: width and height of the window [px].
        """
        self.events: list[dict[str, Any]] = []
        self._buffer = b""
        self._count = 0
        browser_in, self._out = os.pipe()
        self._in, browser_out = os.pipe()

        def connect() -> None:
            # Copies first: a pipe end may itself sit on 3 or 4.
            reader, writer = os.dup(browser_in), os.dup(browser_out)
            os.dup2(reader, _BROWSER_READS)
            os.dup2(writer, _BROWSER_WRITES)

        self._process = subprocess.Popen(
            [
                executable,
                *_FLAGS,
                f"--user-data-dir={profile}",
                f"--window-size={size[0]},{size[1]}",
                "about:blank",
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            close_fds=False,
            preexec_fn=connect,
        )
        os.close(browser_in)
        os.close(browser_out)
        self._session: str | None = None
        self._attach(size)

    def _attach(self, size: tuple[int, int]) -> None:
        pages = self.command("Target.getTargets")["targetInfos"]
        target = next(page["targetId"] for page in pages if page["type"] == "page")
        answer = self.command("Target.attachToTarget", targetId=target, flatten=True)
        self._session = answer["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.command(f"{domain}.enable")
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=size[0],
            height=size[1],
            deviceScaleFactor=1,
            mobile=False,
        )

    def command(self, method: str, **parameters: object) -> dict[str, Any]:
        """Send one protocol command and wait for its answer.

        Raises:
            BrowserError: if the browser refuses or does not answer.
        """
        self._count += 1
        message: dict[str, object] = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + _ANSWER_LIMIT
        while True:
            answer = self._receive(deadline, method)
            if answer.get("id") == self._count:
                break
            self.events.append(answer)
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error']}")
        return answer["result"]

    def open(self, url: str) -> None:
        """Go to a page; returns when it has begun to load."""
        self.command("Page.navigate", url=url)

    def evaluate(self, expression: str) -> Any:  # noqa: ANN401 - whatever the page holds
        """Value of a JavaScript expression; promises are awaited.

        Raises:
            BrowserError: if the expression throws.
        """
        answer = self.command(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise BrowserError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def wait_for(self, expression: str) -> None:
        """Ask until a JavaScript expression is true.

        Raises:
            BrowserError: if it does not become true in time.
        """
        deadline = time.monotonic() + _ANSWER_LIMIT
        while not self.evaluate(f"Boolean({expression})"):
            if time.monotonic() > deadline:
                raise BrowserError(f"not true within {_ANSWER_LIMIT:g} s: {expression}")

    def key(self, key: str, code: str, *, text: str = "") -> None:
        """Press and release a key of the keyboard."""
        self.command("Input.dispatchKeyEvent", type="keyDown", key=key, code=code, text=text)
        self.command("Input.dispatchKeyEvent", type="keyUp", key=key, code=code)

    def click(self, x: float, y: float) -> None:
        """Click with the left mouse button at a place of the page [px]."""
        for kind in ("mousePressed", "mouseReleased"):
            self.command(
                "Input.dispatchMouseEvent",
                type=kind,
                x=x,
                y=y,
                button="left",
                buttons=1 if kind == "mousePressed" else 0,
                clickCount=1,
            )

    def screenshot(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self.command("Page.captureScreenshot", format="png")["data"])

    def seen(
        self, method: str, keep: Callable[[Mapping[str, Any]], bool] = bool
    ) -> list[dict[str, Any]]:
        """Parameters of all events of one kind so far that pass a test."""
        found = [event["params"] for event in self.events if event.get("method") == method]
        return [parameters for parameters in found if keep(parameters)]

    def _receive(self, deadline: float, method: str) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._in], [], [], max(deadline - time.monotonic(), 0))
            chunk = os.read(self._in, _CHUNK) if ready else b""
            if not chunk:
                state = "did not answer" if not ready else "closed its pipe"
                raise BrowserError(f"the browser {state} on {method}")
            self._buffer += chunk
        message, self._buffer = self._buffer.split(b"\0", 1)
        return json.loads(message)

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._in)
        os.close(self._out)

    def __enter__(self) -> Chromium:
        """The browser itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the browser."""
        self.close()
