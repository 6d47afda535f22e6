"""A worker: a process that takes a function and items from its parent, and answers each.

What the function prints goes to standard error. When the parent ends, however it came, so does the
worker, at once.
"""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache, lru_cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from controller.sweeps.engine import Failure

_HERE = Path(__file__).parent


def order_of(function: Callable[[Any], Any]) -> bytes:
    """The message that tells a worker what to call, and where to look for it."""
    return pickle.dumps((sys.path, pickle.dumps(function)))


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


_keep_the_rest = cache(gc.freeze)
"""What the first item has imported and kept is not looked through again: that takes long."""


@lru_cache(maxsize=1)
def _ordered(order: bytes) -> Callable[[Any], Any]:
    """The function of an order: unpickled once, so that what it keeps is kept."""
    path, function = pickle.loads(order)
    sys.path += [place for place in path if place not in sys.path]  # after one's own
    return pickle.loads(function)


def serve(pipe: Connection, order: bytes, environment: Mapping[str, str]) -> None:
    """Answer what comes through ``pipe``, as a process that was started anew with ``environment``.

    Until the parent closes the pipe, or ends.
    """
    if sys.flags.hash_randomization:
        sys.exit(
            "multiprocessing's fork server runs already, with sets in random order: sweep first"
        )
    gc.freeze()  # the collector passes over what was loaded before the fork, which is shared
    os.setpgid(0, 0)  # out of reach of Ctrl-C, which was put off for the start
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    os.dup2(2, 1)
    os.environ.clear()
    os.environ.update(environment)
    logging.getLogger().addHandler(logging.NullHandler())  # a fall is told by its row
    if (random := sys.modules.get("numpy.random")) is not None:
        random.seed()  # Python's own numbers are seeded anew by a fork
    with suppress(EOFError):
        while True:
            pipe.send_bytes(answer(order, pipe.recv_bytes()))


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(0)
