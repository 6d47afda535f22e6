"""A worker: a process that takes a function and items from its parent, and answers each.

Messages are lengths and pickles, over the standard streams. What the function prints goes to
standard error. When the parent ends, however it came, so does the worker, at once.
"""

from __future__ import annotations

import gc
import io
import logging
import os
import pickle
import signal
import struct
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

from controller.sweeps.engine import Failure
from controller.sweeps.identity import SOURCES

_HERE = Path(__file__).parent
_LENGTH = struct.Struct("<Q")
_OURS = (*SOURCES, "benchmarks")
"""Packages that stay what they are while a process runs: those of users may be edited."""


def write_message(stream: IO[bytes], content: bytes) -> None:
    """Send a message, at once."""
    stream.write(_LENGTH.pack(len(content)) + content)
    stream.flush()


def read_message(stream: IO[bytes]) -> bytes | None:
    """The next message; None if there is none, or not all of it: the other end has gone."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    content = stream.read(length)
    return content if len(content) == length else None


def order_of(function: Callable[[Any], Any]) -> bytes:
    """The message that tells a worker what to call, and where to look for it."""
    return pickle.dumps((sys.path, pickle.dumps(function)))


def modules_of(*pickled: bytes) -> tuple[str, ...]:
    """Modules of this project in which a worker will look for what these pickles name."""
    found = dict[str, None]()
    for content in pickled:
        _Reader(content, found).load()
    return tuple(name for name in found if name.partition(".")[0] in _OURS)


class _Reader(pickle.Unpickler):
    """Notes the modules that a pickle names."""

    def __init__(self, content: bytes, found: dict[str, None]) -> None:
        super().__init__(io.BytesIO(content))
        self._found = found

    def find_class(self, module_name: str, global_name: str) -> Any:  # noqa: ANN401 - anything
        self._found[module_name] = None
        return super().find_class(module_name, global_name)


def cause_of(code: int) -> str:
    """What an exit code of ``subprocess`` says."""
    with suppress(ValueError):
        return f"killed by {signal.Signals(-code).name}"
    return f"exit code {code}"


def answer(order: bytes, item: bytes) -> bytes:
    """The message that says what came of an item: the value, or the ``Failure``."""
    try:
        return pickle.dumps((_ordered(order)(pickle.loads(item)), None))
    except (Exception, SystemExit) as error:
        text = traceback.format_exception_only(error)[-1].strip()
        return pickle.dumps((None, Failure(text, _told(error))))
    finally:
        _tidy_up()


def _told(error: BaseException) -> str:
    """The traceback from where it leaves this package: its user looks for what is in their file."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        if Path(trace.tb_frame.f_code.co_filename).parent != _HERE:
            break
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace))


def _tidy_up() -> None:
    """Free what the item has left: robots hold tens of megabytes of records, in cycles."""
    gc.collect()
    _keep_the_rest()


@cache
def _keep_the_rest() -> None:
    """What the first item has imported and kept is not looked through again: that takes long."""
    gc.freeze()


@lru_cache(maxsize=1)
def _ordered(order: bytes) -> Callable[[Any], Any]:
    """The function of an order: unpickled once, so that what it keeps is kept."""
    path, function = pickle.loads(order)
    follow(path)
    return pickle.loads(function)


def follow(path: Sequence[str]) -> None:
    """Find modules where the parent does, after the places of one's own."""
    sys.path += [place for place in path if place not in sys.path]


def main() -> None:
    """Answer what comes in until the parent closes the stream."""
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    logging.getLogger().addHandler(logging.NullHandler())  # a fall is told by its row
    items: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(source, items), name="parent", daemon=True).start()
    order = items.get()
    while True:
        write_message(sink, answer(order, items.get()))


def _receive(source: IO[bytes], items: SimpleQueue[bytes]) -> None:
    while (content := read_message(source)) is not None:
        items.put(content)
    os._exit(0)
