"""A namespace belongs to one process of a machine, until that ends. No ROS is needed."""

from __future__ import annotations

import os
import sys

import pytest

from benchmarks.bridges.processes import Process
from controller.bridges.ros2.claim import Claim
from go2_wbc.errors import BridgeError

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="sockets without files are Linux's"
)
NAMESPACE = f"claimed_{os.getpid()}"
HOLDER = f"""
import time
from controller.bridges.ros2.claim import Claim
claim = Claim("{NAMESPACE}_far", 7)
print("claimed", flush=True)
time.sleep(60)
"""


def test_a_namespace_is_claimed_once_and_can_be_given_back() -> None:
    first = Claim(NAMESPACE, 7)
    with pytest.raises(BridgeError, match=f"/{NAMESPACE} is already served.*--namespace"):
        Claim(NAMESPACE, 7)
    first.close()
    Claim(NAMESPACE, 7).close()


def test_other_namespaces_and_other_domains_are_free() -> None:
    claims = [Claim(NAMESPACE, 7), Claim(f"{NAMESPACE}_b", 7), Claim(NAMESPACE, 8)]
    for claim in claims:
        claim.close()


def test_the_claim_of_a_process_that_is_killed_ends_with_it() -> None:
    with Process([sys.executable, "-c", HOLDER]) as holder:
        holder.wait_for("claimed")
        with pytest.raises(BridgeError, match="already served"):
            Claim(f"{NAMESPACE}_far", 7)
        holder.kill()
    Claim(f"{NAMESPACE}_far", 7).close()
