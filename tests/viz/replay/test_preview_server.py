"""The live page's server: only for this machine, only three answers."""

import http.client
import json
import re
import socket
import sys
import threading
from collections.abc import Iterator, Mapping
from urllib.parse import urlsplit

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from tests.viz.page_reader import packed_parts, read_data, read_message, read_pack
from tests.viz.verdicts import made_up_verdict
from viz.content import ReplayContent
from viz.replay.preview_server import TOKEN_HEADER, PreviewServer


@pytest.fixture
def chosen() -> list[object]:
    """What pages have sent to ``server``."""
    return []


@pytest.fixture
def server(recording: Recording, chosen: list[object]) -> Iterator[PreviewServer]:
    with PreviewServer(ReplayContent(recording), "A <plan>", 0, chosen.append) as opened:
        yield opened


def _port(server: PreviewServer) -> int:
    return urlsplit(server.url).port or 0


def _ask(
    server: PreviewServer,
    what: str,
    body: bytes | None = None,
    headers: Mapping[str, str] | None = None,
) -> tuple[int, str]:
    """Status and text of the answer to a method and path."""
    connection = http.client.HTTPConnection("127.0.0.1", _port(server), timeout=30)
    method, path = what.split()
    connection.request(method, path, body, headers or {})
    answer = connection.getresponse()
    text = answer.read().decode(errors="replace")  # data are no text
    connection.close()
    return answer.status, text


def _data(server: PreviewServer, query: str = "", known: bytes = b"") -> bytes:
    """What a page shows that has got the data, and has ``known`` before."""
    connection = http.client.HTTPConnection("127.0.0.1", _port(server), timeout=30)
    connection.request("GET", f"/data{query}")
    answer = connection.getresponse()
    assert answer.status == 200
    _, data = read_message(answer.read(), known)
    connection.close()
    return data


def _post(server: PreviewServer, path: str, body: bytes, **headers: str) -> int:
    own = {"Origin": f"http://127.0.0.1:{_port(server)}"}
    return _ask(server, f"POST {path}", body, {**own, **headers})[0]


def test_it_answers_with_the_page_and_its_data(server: PreviewServer) -> None:
    status, page = _ask(server, "GET /")
    assert status == 200
    assert "<title>A &lt;plan&gt;</title>" in page
    assert "EventSource" in page
    data = _data(server)
    assert data == packed_parts(page)["replay-data"]
    version = read_pack(data)[0]["version"]
    assert _data(server, f"?has={version}", data) == data
    assert _data(server, "?has=other", b"something else") == data
    assert _ask(server, "GET /etc/passwd")[0] == 404
    assert _ask(server, "GET /../pyproject.toml")[0] == 404


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{}", "127.0.0.1.evil.example:{}", "10.0.0.1:{}", ""]
)
@pytest.mark.parametrize("path", ["/", "/data", "/events"])
def test_other_names_of_this_machine_are_refused(
    server: PreviewServer, host: str, path: str
) -> None:
    refused = _ask(server, f"GET {path}", headers={"Host": host.format(_port(server))})
    assert refused == (403, "only for this machine\n")


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "[::1]:{}"])
def test_the_loopbacks_own_names_are_accepted(server: PreviewServer, host: str) -> None:
    assert _ask(server, "GET /data", headers={"Host": host.format(_port(server))})[0] == 200


VALUES = {"angle": 0.2, "times": 3, "side": "left"}
NO_VALUES = (b"", b"{", b"[1]", b'{"a": [1]}', b'{"a": true}', b'{"a": null}', b" " * 5000)
OTHER_SITES = {"Origin": ("http://evil.example", "", "null"), "Host": ("evil.example",)}


def test_values_that_the_page_sends_are_handed_on_and_nothing_else_or_from_elsewhere(
    server: PreviewServer, chosen: list[object]
) -> None:
    for body in NO_VALUES:
        assert _post(server, "/parameters", body) == 400, body
    body = json.dumps(VALUES).encode()
    for header, values in OTHER_SITES.items():
        for value in values:
            assert _post(server, "/parameters", body, **{header: value}) == 403, (header, value)
    assert chosen == []
    assert _post(server, "/parameters", body) == 200
    assert chosen == [VALUES]


def test_nothing_else_can_be_sent(server: PreviewServer, recording: Recording) -> None:
    assert _post(server, "/data", b"x") == 404
    assert _ask(server, "PUT /data", b"x")[0] == 501
    with PreviewServer(ReplayContent(recording), "t", 0) as without_parameters:
        assert _post(without_parameters, "/parameters", b"{}") == 404


@pytest.fixture
def editor(recording: Recording) -> Iterator[PreviewServer]:
    """A server of a page that may edit."""
    actions = {"/edit": lambda order: {"heard": order}}
    with PreviewServer(ReplayContent(recording), "t", 0, token="secret", actions=actions) as opened:
        yield opened


@pytest.mark.parametrize("path", ["/", "/data", "/events"])
@pytest.mark.parametrize("query", ["", "?token=", "?token=secre", "?token=secret2", "?secret"])
def test_without_the_token_nothing_is_told(editor: PreviewServer, path: str, query: str) -> None:
    status, told = _ask(editor, f"GET {path}{query}")
    assert (status, told) == (403, "open the address that the terminal shows\n")


def test_with_the_token_orders_are_answered(editor: PreviewServer) -> None:
    assert _ask(editor, "GET /data?token=secret")[0] == 200
    assert "class Studio" in _ask(editor, "GET /?token=secret")[1]
    own = {"Origin": f"http://127.0.0.1:{_port(editor)}"}
    order = b'{"op": "undo"}'
    answer = _ask(editor, "POST /edit?token=secret", order, own)
    assert answer == (200, '{"heard": {"op": "undo"}}')
    assert _ask(editor, "POST /edit", order, {**own, TOKEN_HEADER: "secret"})[0] == 200
    assert _ask(editor, "POST /edit", order, own)[0] == 403
    assert _ask(editor, "POST /edit?token=secret", order)[0] == 403, "no page"
    for body in (b"[1]", b"1", b"{", b" " * 5000):
        assert _ask(editor, "POST /edit?token=secret", body, own)[0] == 400


def test_a_preview_edits_nothing(server: PreviewServer) -> None:
    assert _post(server, "/edit", b"{}") == 404
    assert "class Studio" not in _ask(server, "GET /")[1]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere 127.0.0.2 is no address")
def test_it_listens_on_the_loopback_only(server: PreviewServer) -> None:
    with socket.socket() as other:
        # Another address of the loopback network: free if, and only if, 127.0.0.1 alone is bound.
        other.bind(("127.0.0.2", _port(server)))
    assert server.url.startswith("http://127.0.0.1:")


def test_what_is_published_is_told_and_served(server: PreviewServer, recording: Recording) -> None:
    first = json.loads(server.next_state(None) or "")
    assert first["error"] is None
    server.publish_error("line 3: oops")
    second = json.loads(server.next_state(json.dumps(first)) or "")
    assert (second["version"], second["error"]) == (first["version"], "line 3: oops")
    told = r"Broken since \d\d:\d\d:\d\d\. What is shown is the last version that compiled{}\."
    assert re.fullmatch(told.format(""), second["title"])
    server.publish(ReplayContent(recording, verdict=made_up_verdict(recording.duration)))
    third = json.loads(server.next_state(json.dumps(second)) or "")
    assert third["version"] != first["version"]
    assert (third["error"], third["title"]) == (None, "")
    server.publish_error("oops")
    fourth = json.loads(server.next_state(json.dumps(third)) or "")
    assert re.fullmatch(told.format(", which the robot cannot do"), fourth["title"])
    header, _ = read_pack(_data(server))
    assert header["version"] == third["version"]
    assert header["verdict"]["ok"] is False
    page_header, arrays = read_data(_ask(server, "GET /")[1])
    assert page_header["version"] == third["version"]
    assert np.isfinite(arrays["q"]).all()


def test_pages_hear_at_once_and_hear_the_end(recording: Recording) -> None:
    with PreviewServer(ReplayContent(recording), "t", 0) as server:
        connection = http.client.HTTPConnection("127.0.0.1", _port(server), timeout=30)
        connection.request("GET", "/events")
        stream = connection.getresponse()
        assert stream.getheader("Content-Type") == "text/event-stream; charset=utf-8"
        assert json.loads(stream.readline()[len("data: ") :])["error"] is None
        assert stream.readline() == b"\n"
        server.publish_error("broken")
        assert json.loads(stream.readline()[len("data: ") :])["error"] == "broken"
    assert stream.read() == b"\n"
    connection.close()


def test_the_server_works_in_daemon_threads_only(recording: Recording) -> None:
    """A preview that nobody closed does not keep the process alive."""
    before = set(threading.enumerate())
    with PreviewServer(ReplayContent(recording), "t", 0):
        started = set(threading.enumerate()) - before
        assert started
        assert all(thread.daemon for thread in started)


def test_a_port_in_use_or_out_of_range_is_refused(
    server: PreviewServer, recording: Recording
) -> None:
    port = _port(server)
    with pytest.raises(ConfigError, match=f"cannot listen on port {port} of 127.0.0.1"):
        PreviewServer(ReplayContent(recording), "t", port)
    with pytest.raises(ConfigError, match="port 70000 is not valid"):
        PreviewServer(ReplayContent(recording), "t", 70_000)
