"""Serves a live page on this machine only: what is published reaches open pages by itself.

Bound to the loopback address, so that no other machine reaches it; and requests whose ``Host`` is
not the loopback's are refused, so that no web site reaches it through a name of its own that it
points at this machine (DNS rebinding). A page that may do more than choose values needs a token,
which other users of this machine do not know.
"""

from __future__ import annotations

import hmac
import json
import logging
import threading
import uuid
from collections.abc import Callable, Mapping
from datetime import datetime
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, final
from urllib.parse import parse_qs, unquote, urlsplit

from go2_wbc.errors import ConfigError
from viz.content import ReplayContent, checked_content
from viz.replay.packing import Packed, compressed_text, message
from viz.replay.page_data import Prepared, page_text, prepared, scene_text

_log = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
LOOPBACK_NAMES = (LOOPBACK, "localhost", "[::1]")
_HEARTBEAT = 10.0
"""A page that hears nothing for so long [s] gets an empty line, which finds closed pages."""
_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".webp": "image/webp",
    ".mp4": "video/mp4",
    ".npz": "application/octet-stream",
    ".plan": "application/octet-stream",
}
"""Of files that pages may open; others are texts."""
_KEPT = 3  #: Versions that a page may have got last, of which it then gets the changes only
_MOST_SENT = 65_536  #: Longest text [bytes] that a page may send
TOKEN_HEADER = "X-Studio-Token"
Values = dict[str, float | str]  #: What was chosen for parameters, by their names
Action = Callable[[Mapping[str, object]], Mapping[str, object] | bytes]
"""Answers JSON with JSON, or with what ``PreviewServer.answer`` gives."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline' data: blob:",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@final
class PreviewServer(ThreadingHTTPServer):
    """A context manager that serves a page until its end.

    Binds without stealing the port of another program; ends without waiting for pages.

    Attributes:
        url: address of the page.
        on_values: who is told what was chosen.
        files: that pages may open, by their names.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(
        self,
        content: ReplayContent,
        title: str,
        port: int,
        on_values: Callable[[Values], None] | None = None,
        *,
        token: str = "",
        actions: Mapping[str, Action] | None = None,
    ) -> None:
        """Bind and serve in the background.

        Args:
            content: what the page shows at first.
            title: of the page.
            port: to listen on; 0 takes any that is free.
            on_values: called from a thread of the server with what was chosen on the page for the
                content's sliders; nothing about it has been checked but that it is names with
                numbers or words.
            token: what requests must bring, in the address or the header ``TOKEN_HEADER``.
            actions: by their paths, what else a page may ask for, which then edits; called from
                threads of the server.

        Raises:
            ConfigError: if the port is in use or out of range, or for a recording that cannot be
                drawn.
        """
        self._title, self.on_values = title, on_values
        self.token, self.actions = token, actions or {}
        self._scene = scene_text(content.recording)
        self._changed = threading.Condition()
        self.files, self._sent = dict[str, Path](), dict[str, Packed]()
        self._is_open, self._doing = True, dict[str, object]()
        self._pack(content)
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OverflowError as error:
            raise ConfigError(f"port {port} is not valid: 0 to 65535") from error
        except OSError as error:
            raise ConfigError(
                f"cannot listen on port {port} of {LOOPBACK}: {error.strerror or error}; choose"
                " another one, or 0 for any that is free"
            ) from error
        self.url = f"http://{LOOPBACK}:{self.server_port}/"
        self._thread = threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    @property
    def data(self) -> str:
        """What the page shows now, packed."""
        return compressed_text(self._shown.data)

    def changes(self, has: object) -> bytes:
        """What the page shows now, without what a page has that shows the version ``has``."""
        with self._changed:
            return message({}, self._shown, self._sent.get(str(has)))

    def answer(
        self, told: Mapping[str, object], content: ReplayContent | Prepared, title: str, has: object
    ) -> bytes:
        """Something else for the page that asks, with what it is ``told``; see ``changes``."""
        with self._changed:
            old = self._sent.get(str(has))
            return message(told, self._packed(prepared(content), title, uuid.uuid4().hex), old)

    def publish(self, content: ReplayContent | Prepared, title: str = "") -> None:
        """Show this from now on, under another title if there is one, and no error.

        Raises:
            ConfigError: for a recording that cannot be drawn.
        """
        with self._changed:
            self._title = title or self._title
            self._pack(content)
            self._changed.notify_all()

    def publish_error(self, message: str) -> None:
        """Say what is wrong, since when, and what is shown: the last version that compiled."""
        with self._changed:
            self._broken_since = self._broken_since or f"{datetime.now():%H:%M:%S}"
            self._error = message
            self._changed.notify_all()

    def publish_doing(self, doing: Mapping[str, object]) -> None:
        """Say what is being done meanwhile, and how far it is; nothing, once it is done."""
        with self._changed:
            if doing != self._doing:
                self._doing = dict(doing)
                self._changed.notify_all()

    def close(self) -> None:
        """End; open pages say so."""
        with self._changed:
            self._is_open = False
            self._changed.notify_all()
        self.shutdown()
        self._thread.join()
        self.server_close()

    def __exit__(self, *_: object) -> None:
        self.close()

    def page(self) -> str:
        """The page with what it shows now."""
        return page_text(
            self._title, self._scene, self.data, is_live=True, is_editor=bool(self.actions)
        )

    def next_state(self, seen: str | None) -> str | None:
        """Wait for another state than ``seen``; "" if there is none for long.

        Returns:
            Version, error, its title, what is being done, as JSON; ``None`` once the server ends.
        """
        with self._changed:
            self._changed.wait_for(lambda: not self._is_open or self._told() != seen, _HEARTBEAT)
            if not self._is_open:
                return None
            state = self._told()
        return "" if state == seen else state

    def _told(self) -> str:
        shown = "the last version that compiled"
        if not self._is_feasible:
            shown += ", which the robot cannot do"
        title = f"Broken since {self._broken_since}. What is shown is {shown}."
        error = {"error": self._error, "title": title if self._error else ""}
        return json.dumps({"version": self._version, "doing": self._doing, **error})

    def handle_error(self, request: object, client_address: object) -> None:
        """Log what went wrong in an answer; the page may have been closed meanwhile."""
        _log.info("no answer to %s", client_address, exc_info=True)

    def _pack(self, content: ReplayContent | Prepared) -> None:
        if isinstance(content, ReplayContent):
            content = prepared(checked_content(content))
        self._version, self._error, self._broken_since = uuid.uuid4().hex, None, ""
        self._shown = self._packed(content, self._title, self._version)
        self._is_feasible = content.is_feasible

    def _packed(self, content: Prepared, title: str, version: str) -> Packed:
        """It under a version of its own, by which it is known until ``_KEPT`` others are."""
        self._sent[version] = content.packed(title, version)
        for old in [*self._sent][:-_KEPT]:
            del self._sent[old]
        return self._sent[version]


@final
class _Handler(BaseHTTPRequestHandler):
    """Answers GET of ``/``, ``/data``, ``/events``, POST of ``/parameters``, and nothing else."""

    server: PreviewServer  # type: ignore[reportIncompatibleVariableOverride]

    def do_GET(self) -> None:
        """Answer one request."""
        path, query = urlsplit(self.path).path, parse_qs(urlsplit(self.path).query)
        if not self._is_allowed():
            pass
        elif path == "/":
            self._answer(self.server.page(), "text/html")
        elif path == "/data":
            self._answer_bytes(self.server.changes(query.get("has", [""])[0]))
        elif path == "/events":
            self._stream()
        elif (file := self.server.files.get(unquote(path.removeprefix("/files/")))) is not None:
            self._answer_file(file)
        else:
            self._refuse("not here", HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Take values for the parameters, or an order, from a page of this server only."""
        path, on_values = urlsplit(self.path).path, self.server.on_values
        origin = self.headers.get("Origin", "").removeprefix("http://")
        if not self._is_allowed(is_from_page=self._is_own(origin)):
            pass
        elif path in self.server.actions:
            if isinstance(order := self._sent(), dict):
                answer = self.server.actions[path](order)
                if isinstance(answer, bytes):
                    self._answer_bytes(answer)
                else:
                    self._answer(json.dumps(answer), "application/json")
            else:
                self._refuse("needs an object, as JSON", HTTPStatus.BAD_REQUEST)
        elif path != "/parameters" or on_values is None:
            self._refuse("not here", HTTPStatus.NOT_FOUND)
        elif (values := self._values()) is None:
            self._refuse("needs names with numbers or words, as JSON", HTTPStatus.BAD_REQUEST)
        else:
            on_values(values)
            self._answer("", "text/plain")

    def _is_allowed(self, *, is_from_page: bool = True) -> bool:
        """Whether the request comes from this machine, and brings the token; else it is refused."""
        if not (self._is_own(self.headers.get("Host", "")) and is_from_page):
            self._refuse("only for this machine", HTTPStatus.FORBIDDEN)
            return False
        given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
        token = self.headers.get(TOKEN_HEADER, given)
        if not hmac.compare_digest(token.encode(), self.server.token.encode()):
            self._refuse("open the address that the terminal shows", HTTPStatus.FORBIDDEN)
            return False
        return True

    def _is_own(self, host: str) -> bool:
        return host in {f"{name}:{self.server.server_port}" for name in LOOPBACK_NAMES}

    def _refuse(self, why: str, status: HTTPStatus) -> None:
        self._answer(f"{why}\n", "text/plain", status)

    def _sent(self) -> Any:  # noqa: ANN401 - whatever JSON holds
        """What was sent as JSON; None for anything else."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _MOST_SENT:
            return None
        try:
            return json.loads(self.rfile.read(int(length)))
        except ValueError:
            return None

    def _values(self) -> Values | None:
        """What was sent, if it is values."""
        values = self._sent()
        is_one = isinstance(values, dict) and all(
            isinstance(value, int | float | str) and not isinstance(value, bool)
            for value in values.values()
        )
        return values if is_one else None

    def _answer_file(self, file: Path) -> None:
        try:
            content = file.read_bytes()
        except OSError as error:
            return self._refuse(f"{file.name}: {error.strerror}", HTTPStatus.NOT_FOUND)
        return self._answer_bytes(content, _KINDS.get(file.suffix, "text/plain; charset=utf-8"))

    def _answer(self, text: str, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._answer_bytes(text.encode(), f"{kind}; charset=utf-8", status)

    def _answer_bytes(
        self,
        content: bytes,
        kind: str = "application/octet-stream",
        status: HTTPStatus = HTTPStatus.OK,
    ) -> None:
        self._begin(status, kind, {"Content-Length": str(len(content))})
        self.wfile.write(content)

    def _stream(self) -> None:
        """Server-sent events until the page or the server ends."""
        self._begin(HTTPStatus.OK, "text/event-stream; charset=utf-8", {})
        seen: str | None = None
        try:
            while (state := self.server.next_state(seen)) is not None:
                self.wfile.write(f"data: {state}\n\n".encode() if state else b":\n\n")
                seen = state or seen
        except OSError:
            return  # the page was closed

    def _begin(self, status: HTTPStatus, kind: str, more: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, **more}.items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing: the terminal shows the verdicts."""
