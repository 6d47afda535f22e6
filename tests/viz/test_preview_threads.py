"""A preview that nobody closed does not keep the process alive."""

from __future__ import annotations

import threading

from go2_wbc.recording import Recording
from viz.content import ReplayContent
from viz.replay.preview_server import PreviewServer


def test_the_server_works_in_daemon_threads_only(recording: Recording) -> None:
    before = set(threading.enumerate())
    with PreviewServer(ReplayContent(recording), "t", 0):
        started = set(threading.enumerate()) - before
        assert started
        assert all(thread.daemon for thread in started)
