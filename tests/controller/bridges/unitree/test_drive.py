"""Our controller drives the simulator in another process through ``UnitreePlant``."""

import itertools
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest

from benchmarks.bridges.unitree import measure_drive
from benchmarks.study import TrialResult
from controller.bridges.unitree.low_level import GuardConfig
from controller.bridges.unitree.plant import UnitreePlant
from controller.sweeps.trials import Trial
from go2_wbc.errors import CommandError, PlantTimeout
from go2_wbc.plant.base import Plant
from tests.controller.bridges import unitree_processes
from tests.controller.bridges.processes import wait_until
from tests.controller.bridges.unitree.scenes import DAMPED, garbage, watched
from tests.controller.bridges.unitree.support import needs_dds
from tests.controller.bridges.unitree_processes import own_domain, simulator
from tests.go2_wbc.plant.contract import PlantContract

MAE_BAR = 0.04  # m/s
CODEC_BAR = 50.0  # us
LIMIT = 60.0  # s; only ends a test that hangs
# s; a loaded test machine pauses processes for longer than the 30 ms of the real limit.
PATIENT = GuardConfig(stale_limit=2.0, hang_limit=5.0)


def test_encoding_and_decoding_take_little_cpu() -> None:
    # In a process of its own: the run-time checks of these tests cost more than what is measured.
    script = "from benchmarks.bridges.unitree import codec_time; print(codec_time())"
    times = [subprocess.check_output([sys.executable, "-c", script]) for _ in range(3)]
    assert min(map(float, times)) < CODEC_BAR


@needs_dds
@pytest.mark.slow
@pytest.mark.parametrize("sensors", ["ideal", "noisy"])
def test_it_stands_trots_and_gives_a_high_five(sensors: str) -> None:
    simulator_options = ["--lockstep", "--sensors", sensors]
    result = TrialResult()
    measure_drive(Trial(0), result, simulator_options, ["--stale-limit", "2.0"])
    assert result.values.get("steps") == 0.0, result
    assert result.values["mae"] < MAE_BAR


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with own_domain() as domain, simulator(domain, "--lockstep"):
        yield domain


@needs_dds
@pytest.mark.slow
class TestUnitreePlant(PlantContract):
    @pytest.fixture
    def plant(self, domain: int) -> Iterator[Plant]:
        plant = UnitreePlant("lo", domain, i_have_the_remote_in_hand=True, guards=PATIENT)
        yield plant
        plant.close()


@needs_dds
@pytest.mark.slow
def test_in_lockstep_garbage_lets_no_time_pass() -> None:
    with watched("--lockstep") as at:

        def time_stands_still() -> bool:
            at.flood([DAMPED], 0.2)
            at.flood(garbage(), 0.1)  # for what is still on its way
            has_lived = len(at.take()) > 1
            at.flood(garbage(), 0.4)
            return has_lived and len(at.take()) <= 1  # one comes in 20 ms of robot time

        assert wait_until(time_stands_still, LIMIT)


@needs_dds
def test_a_robot_that_is_not_there_is_named() -> None:
    with pytest.raises(PlantTimeout, match="no rt/lowstate on DDS domain 9, interface lo"):
        UnitreePlant("lo", 9, i_have_the_remote_in_hand=True)


def test_without_consent_nothing_is_touched() -> None:
    with pytest.raises(CommandError, match="--i-have-the-remote-in-hand"):
        UnitreePlant("lo", 1)


def test_a_domain_whose_port_another_program_holds_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Any program's outgoing socket may get it: a simulator could not join, and 20 tests failed.
    with own_domain() as first, own_domain() as second:
        pass
    monkeypatch.setattr(unitree_processes, "DOMAINS", (first, second))
    monkeypatch.setattr(unitree_processes, "_tries", itertools.count())
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 7400 + 250 * first))
        with own_domain() as domain:
            assert domain == second
