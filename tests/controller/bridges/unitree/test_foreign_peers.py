"""Other people's programs move our robot: the stock ``SportClient``, the C++ SDK."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from controller.bridges.unitree.sport_api import Code, SportMode
from tests.controller.bridges.processes import PROGRAM, Process
from tests.controller.bridges.unitree.support import (
    CPP_SDK,
    OLD_STOCK_SDK,
    STOCK_SDK,
    absent,
    needs_dds,
    peer_python,
)
from tests.controller.bridges.unitree_processes import good_commands, own_domain, simulator

pytestmark = [needs_dds, pytest.mark.slow]
PEERS = Path(__file__).parent / "peers"
LIMIT = 120.0  # s; only ends a test that hangs
# s; the default of 1 s is kept by an idle machine, a loaded one pauses processes for longer.
PATIENT = 5.0
GRAVITY = pytest.approx(9.8, abs=0.5)
SAG = 0.2  # rad; joint servos of 60 N m/rad sag by about 0.12 under the robot's weight
MESSAGES = 1500  # Checked in either direction; of ours a busy peer may miss some
# What own_low_level.py commands, in Unitree's order of joints.
ANGLES = [0.4, 0.5, 0.6, 0.1, 0.2, 0.3, 1.0, 1.1, 1.2, 0.7, 0.8, 0.9]
# A network of one's own; who is not root is root in a user namespace.
UNSHARE = ("unshare", "--net") if os.geteuid() == 0 else ("unshare", "--map-root-user", "--net")
# Loopback with multicast, which CycloneDDS 0.10 needs, in a network of our own.
NETWORK = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo"


def test_the_stock_sport_client_moves_the_robot() -> None:
    python = peer_python(STOCK_SDK)
    with own_domain() as domain, simulator(domain):
        peer = [python, str(PEERS / "stock_sport.py"), str(domain), str(PATIENT)]
        with Process(peer) as process:
            require_a_script_done(process.finish(LIMIT))


def test_the_stock_sport_client_on_the_dds_of_the_robot_moves_it_too() -> None:
    peer = f"{peer_python(OLD_STOCK_SDK)} {PEERS / 'stock_sport.py'} 0 {PATIENT}"
    code, text = beside_a_simulator(peer)
    assert code == 0, text
    require_a_script_done(text)


def require_a_script_done(text: str) -> None:
    by_call = {answer["call"]: answer for answer in json_lines(text)}
    codes = {name: answer["code"] for name, answer in by_call.items()}
    assert codes.pop("FrontFlip", None) == Code.NOT_SUPPORTED, text
    assert len(codes) == 8, text
    assert set(codes.values()) == {0}, codes
    assert by_call["StandUp"]["mode"] == SportMode.JOINT_LOCK
    assert by_call["BalanceStand"]["mode"] == SportMode.BALANCE_STAND
    assert by_call["Move"]["mode"] == SportMode.LOCOMOTION
    way = by_call["StopMove"]["position"][0] - by_call["BalanceStand"]["position"][0]
    assert 0.8 < way < 1.6
    assert by_call["Euler"]["mode"] == SportMode.POSE
    assert by_call["Euler"]["rpy"][1] == pytest.approx(0.15, abs=0.06)
    assert by_call["StandDown"]["mode"] == SportMode.LIE_DOWN
    assert by_call["StandDown"]["position"][2] < 0.12


def test_the_cpp_sdk_reads_our_state_and_stands_the_robot_up() -> None:
    python = peer_python(CPP_SDK)
    code, text = beside_a_simulator(f"{python} {PEERS / 'cpp_stand.py'} lo")
    assert code == 0, text
    (said,) = json_lines(text)
    assert said["accelerometer"] == GRAVITY
    assert said["start"][1] > 1.0  # a folded thigh: the front right one, first in Unitree's order
    assert said["error"] < SAG
    assert good_commands(text) > 0.9 * said["sent"]
    assert "refused: none" in text
    assert "CRC Error" not in text


def cpp_checks(mask: int) -> tuple[dict[str, Any], str]:
    """The C++ SDK plays the robot to our low level; what both say. ``mask`` breaks checksums."""
    robot = f"{peer_python(CPP_SDK)} {PEERS / 'cpp_robot.py'} lo"
    own = f"{sys.executable} {PEERS / 'own_low_level.py'} {MESSAGES} {mask}"
    script = f"{robot} & robot=$!; {own}; code=$?; kill -TERM $robot; wait $robot; exit $code"
    code, text = in_own_network(script)
    assert code == 0, text
    said: dict[str, Any] = {}
    for line in json_lines(text):
        said |= line
    return said, text


def test_the_cpp_sdk_accepts_our_checksums_and_we_accept_its() -> None:
    said, text = cpp_checks(mask=0)
    assert "CRC Error" not in text
    assert said["q_target"] == pytest.approx(ANGLES)
    assert said["intact"] >= MESSAGES
    assert said["broken"] == 0


def test_the_cpp_sdk_refuses_wrong_checksums() -> None:
    said, text = cpp_checks(mask=1)
    assert text.count("incoming low_cmd CRC Error") > MESSAGES / 3
    assert text.count("low_state CRC Error") > MESSAGES / 3
    assert said["q_target"] == [0.0] * 12


def beside_a_simulator(peer: str) -> tuple[int | None, str]:
    """Exit code of a command on the domain of a simulator, and what both said."""
    script = f"{' '.join(PROGRAM)} unitree-sim --domain 0 & sim=$!; {peer}; "
    return in_own_network(f"{script} code=$?; kill -TERM $sim; wait $sim; exit $code")


def in_own_network(script: str) -> tuple[int | None, str]:
    """Exit code and output of a shell script in a network of its own, as a robot's is."""
    if not has_own_network():
        absent(f"needs the right to make a network namespace ({' '.join(UNSHARE)})")
    with Process([*UNSHARE, "sh", "-c", f"{NETWORK}; {script}"]) as process:
        text = process.finish(LIMIT)
        return process.code, text


def json_lines(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def has_own_network() -> bool:
    if shutil.which(UNSHARE[0]) is None:
        return False
    return subprocess.run([*UNSHARE, "true"], check=False).returncode == 0
