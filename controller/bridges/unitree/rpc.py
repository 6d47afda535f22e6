"""Unitree's remote procedure calls over two topics: a server, and a client of our own."""

from __future__ import annotations

import json
import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Final, final

from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.messages import Reply, Request, Response, decode_call, encode_call
from controller.bridges.unitree.sport_api import API_VERSION, LEASE_TERM, Api, Code
from go2_wbc.errors import CommandError

_log = logging.getLogger(__name__)

PATROL: Final = 0.02  #: Time [s] after which a server without requests looks after what is pending
QUEUE: Final = 64  #: Requests that are kept for a server that is busy; of more, the oldest are lost
TRIES: Final = 3  #: How often a question is asked before silence is taken for an answer


@final
class Server:
    """Serves one service in a thread of its own."""

    def __init__(
        self,
        bus: Bus,
        service: str,
        handle: Callable[[Request, Reply], None],
        patrol: Callable[[], None] = lambda: None,
    ) -> None:
        """Hand requests to ``handle``; call ``patrol`` in between, every ``PATROL`` seconds."""
        self._name, self._handle, self._patrol = service, handle, patrol
        self._reader = bus.reader(f"rt/api/{service}/request", depth=QUEUE, reliable=True)
        self._writer = bus.writer(f"rt/api/{service}/response")
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"rpc-{service}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop serving; idempotent."""
        self._stopping.set()
        if self._thread is not threading.current_thread():
            self._thread.join(1.0)

    def _serve(self) -> None:
        while not self._stopping.is_set():
            self._reader.wait(PATROL)
            try:
                for data in self._reader.take():
                    self._serve_one(data)
                self._patrol()
            except Exception:
                _log.exception("%s: the service goes on after an error", self._name)

    def _serve_one(self, data: bytes) -> None:
        try:
            request = decode_call(Request, data)
        except CommandError as error:
            _log.warning("%s: ignored what is no request: %s", self._name, error)
            return
        reply = partial(self._reply, request)
        try:
            if request.api_id == Api.VERSION:
                reply(Code.OK, API_VERSION)
            else:
                self._handle(request, reply)
        except CommandError as error:
            _log.warning("%s: request %d refused: %s", self._name, request.api_id, error)
            reply(Code.BAD_PARAMETER, "")
        except Exception:
            _log.exception("%s: request %d failed", self._name, request.api_id)
            reply(Code.INTERNAL, "")

    def _reply(self, request: Request, code: int, data: str) -> None:
        if not request.is_one_way:
            answer = Response(request.id, request.api_id, int(code), data)
            self._writer.write(encode_call(answer))


@final
class Lease:
    """Gives one client at a time the sole control of a service, as Unitree's servers do."""

    def __init__(self) -> None:
        self._id, self._renewed = 0, -math.inf

    def allows(self, request: Request) -> bool:
        """Whether the client of ``request`` may control the service now."""
        return self._is_expired() or request.lease_id == self._id

    def _is_expired(self) -> bool:
        return time.monotonic() > self._renewed + LEASE_TERM

    def handle(self, request: Request, reply: Reply) -> None:
        """Answer a request for a lease."""
        code, data = Code.OK, ""
        if request.api_id == Api.LEASE_APPLY and self._is_expired():
            self._id, self._renewed = time.time_ns() // 1000, time.monotonic()
            data = json.dumps({"id": self._id, "term": round(1e6 * LEASE_TERM)})
        elif request.api_id == Api.LEASE_APPLY:
            code = Code.LEASE_EXIST
        elif request.api_id != Api.LEASE_RENEWAL:
            code = Code.NOT_SUPPORTED
        elif self._id != request.lease_id or self._is_expired():
            code = Code.LEASE_NOT_EXIST
        else:
            self._renewed = time.monotonic()
        reply(code, data)


@final
class Client:
    """Calls one service; one call at a time."""

    def __init__(self, bus: Bus, service: str) -> None:
        self._writer = bus.writer(f"rt/api/{service}/request")
        self._reader = bus.reader(f"rt/api/{service}/response", depth=QUEUE, reliable=True)

    def wait_for_server(self, seconds: float) -> bool:
        """Wait until a server has been discovered, for ``seconds`` at most."""
        deadline = time.monotonic() + seconds
        while not (self._writer.readers and self._reader.writers):
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True

    def call(self, api_id: int, parameter: str = "{}", timeout: float = 1.0) -> Response:
        """Call and wait for the answer; code 3104 (``API_TIMEOUT``) if none comes."""
        request = Request(time.time_ns(), api_id, parameter=parameter)
        self._writer.write(encode_call(request))
        deadline = time.monotonic() + timeout
        while (remaining := deadline - time.monotonic()) > 0.0:
            self._reader.wait(remaining)
            for data in self._reader.take():
                response = decode_call(Response, data)
                if response.id == request.id:
                    return response
        return Response(request.id, api_id, Code.API_TIMEOUT)

    def ask(self, api_id: int, parameter: str = "{}") -> Response:
        """Call what may be repeated: an answer gets lost until the server has discovered us."""
        response = self.call(api_id, parameter)
        for _ in range(TRIES - 1):
            if response.code == Code.API_TIMEOUT:
                response = self.call(api_id, parameter)
        return response

    def send(self, api_id: int, parameter: str = "{}") -> None:
        """Call without an answer."""
        request = Request(time.time_ns(), api_id, is_one_way=True, parameter=parameter)
        self._writer.write(encode_call(request))
