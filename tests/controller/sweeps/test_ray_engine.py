"""Rows from a real Ray cluster of two nodes on the loopback: the same, also if one is killed."""

import os
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from controller import sweep
from controller.sweeps import Progress, SweepResult
from controller.sweeps.ray_engine import ON_LOOPBACK, QUIET
from go2_wbc.errors import SweepError
from tests.controller.sweeps import swept

IS_REQUIRED = "GO2_WBC_REQUIRE_CLUSTER" in os.environ
"""Set by ``make test-cluster``: without Ray these tests then fail instead of being skipped."""
pytestmark = pytest.mark.skipif(
    find_spec("ray") is None and not IS_REQUIRED,
    reason="Ray is not installed: `make test-cluster` installs it",
)
NOWHERE = "127.0.0.1:9"  #: An address at which no cluster listens: the port of the discard protocol


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes with one processor each; workers find the tests' modules as this process does."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (QUIET | ON_LOOPBACK).items():
            patch.setenv(name, value)
        patch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[3]))
        from ray.cluster_utils import Cluster

        nodes = Cluster(
            initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
        )
        nodes.add_node(num_cpus=1)
        yield nodes
        nodes.shutdown()


@pytest.fixture
def ray_sweep(cluster: Any, tmp_path: Path) -> Callable[..., SweepResult]:  # noqa: ANN401
    """Sweeps on the cluster."""
    return partial(sweep, engine="ray", address=cluster.address, out=tmp_path / "ray.sqlite")


def test_rows_are_those_of_local_workers_also_if_a_node_is_killed(
    cluster: Any,  # noqa: ANN401 - Ray's own, which is untyped
    ray_sweep: Callable[..., SweepResult],
    tmp_path: Path,
) -> None:
    """The node is killed with ``kill -9``, its running item with it, after ten rows."""
    n, victims = 60, [cluster.list_all_nodes()[1]]

    def kill(progress: Progress) -> None:
        if progress.done >= 10 and victims:
            cluster.remove_node(victims.pop(), allow_graceful=False)

    there = ray_sweep(swept.slow, n, on_progress=kill)
    here = sweep(swept.slow, n, workers=2, out=tmp_path / "local.sqlite")
    assert not victims
    assert there.rows == here.rows
    assert [row["seed"] for row in there.rows] == list(range(n))
    cluster.add_node(num_cpus=1)


def test_a_function_that_raises_or_kills_its_process_is_told(
    ray_sweep: Callable[..., SweepResult],
) -> None:
    with pytest.raises(SweepError, match="seed 5: ValueError: five is too much"):
        ray_sweep(swept.raise_on_5, 8)
    result = ray_sweep(swept.raise_on_5, 8, keep_going=True)
    assert (len(result.rows), list(result.failures)) == (7, [5])
    dead = ray_sweep(swept.die_on_5, 8, keep_going=True, fresh=True)
    assert len(dead.rows) == 7
    assert "its process died 4 times" in dead.failures[5]


def test_workers_of_ray_have_the_environment_of_local_ones(
    ray_sweep: Callable[..., SweepResult],
) -> None:
    (row,) = ray_sweep(swept.threads, 1).rows
    assert (row["blas"], row["hash"]) == ("1", "0")


def test_every_address_of_the_cluster_is_on_the_loopback(cluster: Any) -> None:  # noqa: ANN401
    assert cluster.address.startswith("127.0.0.1:")
    assert {node.node_ip_address for node in cluster.list_all_nodes()} == {"127.0.0.1"}


def test_a_cluster_that_is_not_there_is_told_and_nothing_is_lost(tmp_path: Path) -> None:
    out = tmp_path / "rows.sqlite"
    sweep(swept.trial, 2, workers=1, out=out)
    with pytest.raises(SweepError, match=rf"no Ray cluster at {NOWHERE}"):
        sweep(swept.trial, 4, engine="ray", address=NOWHERE, out=out)
    assert len(sweep(swept.trial, 4, workers=1, out=out).rows) == 4
