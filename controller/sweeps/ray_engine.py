"""Workers on many machines: tasks of a Ray cluster, which sends items and collects results.

A task calls the same function as a local worker, in the same environment: the rows are the same.
Without an address a cluster on this machine is started, which listens on the loopback only.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, final

from controller.sweeps import engine
from go2_wbc.errors import SweepError, needing

ATTEMPTS = 4
"""How often an item is tried whose process or machine dies: it takes a moment until a machine is
missed, and it may be given the same item once more."""
QUEUED = 2  #: Items in the hands of the cluster for each of its processors: none waits for the next
QUIET = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_NUM_REDIS_GET_RETRIES": "3"}
"""Ray tells nobody of its use, and does not look for minutes for a cluster that does not answer."""
PATIENCE = 10.0  #: Time [s] in which something must listen at the address of a cluster
ON_LOOPBACK = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}
"""Ray on this machine only listens on 127.0.0.1, as it does elsewhere than on Linux by default. Its
argument for the address does not: it replaces 127.0.0.1 by one that others reach."""


@final
class RayEngine(engine.Engine):
    """Runs items on the processors of a Ray cluster.

    A process or machine that dies costs no item its result: its items are tried again elsewhere.
    """

    def __init__(self, workers: int | None = None, address: str | None = None) -> None:
        """Use a cluster; nothing is started yet.

        Args:
            workers: at most so many processors; by default all of them.
            address: of the cluster, as ``ray.init`` takes it: "auto", or "HOST:PORT". By default
                the one in ``RAY_ADDRESS``, or one that is started on this machine.

        Raises:
            MissingDependency: if Ray is not installed.
        """
        self._workers = workers
        self._address = address or os.environ.get("RAY_ADDRESS") or None
        _ray(QUIET if self._address else QUIET | ON_LOOPBACK)

    def run(
        self, function: Callable[[engine.Item], Any], items: Sequence[engine.Item]
    ) -> engine.Ends[engine.Item]:
        """What came of each item; see ``Engine.run``.

        Raises:
            SweepError: if the cluster cannot be reached.
        """
        if not items:
            return
        with self._connected() as ray:
            order = ray.put(engine.order_of(function))
            call = ray.remote(
                num_cpus=1, max_retries=0, runtime_env={"env_vars": engine.ONE_THREAD}
            )(engine.answer)
            trials, running = engine.Trials(items, ATTEMPTS), dict[Any, int]()
            there = int(ray.cluster_resources().get("CPU", 1))
            size = self._workers or max(QUEUED * there, 1)
            while trials.waiting or running:
                while trials.waiting and len(running) < size:
                    number = trials.waiting.popleft()
                    running[call.remote(order, trials.pickled[number])] = number
                (task,), _ = ray.wait(list(running), num_returns=1)
                number = running.pop(task)
                try:
                    yield trials.ended(number, ray.get(task))
                except ray.exceptions.RayError as error:
                    why = f"{type(error).__name__}: {error}".partition("\n")[0]
                    if (ended := trials.died(number, why)) is not None:
                        yield ended
                    else:
                        trials.waiting.append(number)

    @contextmanager
    def _connected(self) -> Iterator[Any]:
        ray = _ray(QUIET)
        started = {"num_cpus": self._workers or engine.processors(), "include_dashboard": False}
        try:
            _require_listener(self._address or "")
            ray.init(
                self._address,
                log_to_driver=False,
                logging_level="ERROR",
                **({} if self._address else started),
            )
        except Exception as error:  # what it raises depends on where it fails
            where = self._address or "this machine"
            why = str(error).partition("\n")[0]
            raise SweepError(f"no Ray cluster at {where}: {type(error).__name__}: {why}") from error
        try:
            yield ray
        finally:
            ray.shutdown()


def _require_listener(address: str) -> None:
    """Raise OSError if nothing listens at HOST:PORT; Ray itself would try for many minutes."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if host and port.isdecimal():
        socket.create_connection((host, int(port)), PATIENCE).close()


def _ray(settings: Mapping[str, str]) -> Any:  # noqa: ANN401 - a module of an extra
    """Ray; it reads its settings when it is imported first.

    Raises:
        MissingDependency: if it is not installed.
    """
    for name, value in settings.items():
        os.environ.setdefault(name, value)
    with needing("cluster", "Ray is not here"):
        import ray
        import ray.exceptions
    return ray
