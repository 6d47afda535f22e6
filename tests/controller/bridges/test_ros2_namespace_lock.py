"""A namespace belongs to one process of a machine, until that ends. No ROS is needed."""

import os
import sys

import pytest

from controller.bridges.ros2.namespace_lock import lock_namespace
from go2_wbc.errors import BridgeError
from tests.controller.bridges.processes import Process

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="sockets without files are Linux's"
)
NAMESPACE = f"locked_{os.getpid()}"
HOLDER = f"""
import time
from controller.bridges.ros2.namespace_lock import lock_namespace
lock = lock_namespace("{NAMESPACE}_far", 7)
print("locked", flush=True)
time.sleep(60)
"""


def test_a_namespace_is_locked_once_and_can_be_given_back() -> None:
    first = lock_namespace(NAMESPACE, 7)
    with pytest.raises(BridgeError, match=f"/{NAMESPACE} is already served.*--namespace"):
        lock_namespace(NAMESPACE, 7)
    first.close()
    lock_namespace(NAMESPACE, 7).close()


def test_other_namespaces_and_other_domains_are_free() -> None:
    locks = [
        lock_namespace(NAMESPACE, 7),
        lock_namespace(f"{NAMESPACE}_b", 7),
        lock_namespace(NAMESPACE, 8),
    ]
    for lock in locks:
        lock.close()


def test_the_lock_of_a_process_that_is_killed_ends_with_it() -> None:
    with Process([sys.executable, "-c", HOLDER]) as holder:
        holder.wait_for("locked")
        with pytest.raises(BridgeError, match="already served"):
            lock_namespace(f"{NAMESPACE}_far", 7)
        holder.kill()
    lock_namespace(f"{NAMESPACE}_far", 7).close()
