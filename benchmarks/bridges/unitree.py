"""Unitree's protocol between real processes on the loopback: the sport service, the low level."""

import json
import time
import timeit
from collections.abc import Sequence
from typing import Final

import numpy as np

from benchmarks.study import Study, TrialResult
from controller.bridges.unitree import messages
from controller.bridges.unitree.low_level import intact_message, low_cmd_message
from controller.bridges.unitree.messages import decode_message, encode_message
from controller.bridges.unitree.sport_api import Api
from controller.sweeps.trials import Trial
from go2_wbc.robot.state import JointCommand
from tests.controller.bridges.processes import require, wait_until
from tests.controller.bridges.unitree_processes import (
    MOVE,
    SPEED,
    Scene,
    driver,
    good_commands,
    scene,
)

MOVE_TIME, MOVE_PERIOD = 3.0, 0.05
STREAM_TIME: Final = 10.0  #: Time [s] of listening at 500 Hz
ROUND_TRIPS: Final = 200
CODINGS: Final = 2000
DAMPED: Final = JointCommand.damping(3.0)
DRIVE_LIMIT: Final = 120.0  #: Time [s] after which a drive counts as hanging

SPORT: Final = (
    ("codes", "calls not answered 0", "<= 0"),
    ("move", "Move 0.5: mean speed error", "<= 0.04 m/s"),
    ("latency", "round trip, median", "<= 10 ms"),
    ("latency_p99", "round trip, 99 %", "ms"),
)
STREAM: Final = (
    ("lost_states", "lowstate lost", "<= 0.5 %"),
    ("lost_commands", "lowcmd lost or refused", "<= 0.5 %"),
    ("bad_crc", "bad checksums", "<= 0"),
    ("rate", "lowstate rate", ">= Hz"),
    ("codec", "CPU encode + decode", "<= 50 us"),
)
DRIVE: Final = (
    ("steps", "steps not done, of 4", "<= 0"),
    ("mae", "trot 0.5, true speed: MAE", "<= 0.04 m/s"),
)


def measure_sport(_trial: Trial, found: TrialResult) -> None:
    """The script of a SportClient: up, balance, move, stop, hello, Euler, down."""
    with scene() as at:

        def codes_of(*calls: Api) -> list[int]:
            codes = []
            for api in calls:
                tilt = '{"x": 0.1, "y": 0.1, "z": 0.1}' if api is Api.EULER else "{}"
                codes.append(at.call(api, tilt))
                at.wait_for_rest()
            return codes

        codes = codes_of(Api.STAND_UP, Api.BALANCE_STAND)
        speed = _move(at)
        codes += codes_of(Api.STOP_MOVE)
        trips = timeit.repeat(lambda: at.client.call(Api.STOP_MOVE), number=1, repeat=ROUND_TRIPS)
        codes += codes_of(Api.HELLO, Api.EULER, Api.STAND_DOWN)
        require(at.height <= 0.12, f"StandDown left the base at {at.height:.2f} m")
    found.values = {
        "codes": float(np.count_nonzero(codes)),
        "move": abs(speed - SPEED),
        "latency": 1e3 * float(np.median(trips)),
        "latency_p99": 1e3 * float(np.percentile(trips, 99)),
    }


def _move(at: Scene) -> float:
    """Mean forward speed [m/s] over the last two of three seconds of ``Move``."""
    end = time.monotonic() + MOVE_TIME
    speeds: list[float] = []
    while time.monotonic() < end:
        at.client.send(Api.MOVE, MOVE)
        time.sleep(MOVE_PERIOD)
        messages = at.take()
        if end - time.monotonic() < MOVE_TIME - 1.0:
            speeds += [float(message["velocity"][0, 0]) for message in messages]
    return float(np.mean(speeds)) if speeds else 0.0


def measure_stream(_trial: Trial, found: TrialResult) -> None:
    """Answer every ``rt/lowstate`` with a damping command for ten seconds."""
    with scene() as at:
        states = at.bus.reader("rt/lowstate", depth=64)
        commands = at.bus.writer("rt/lowcmd")
        states.wait(5.0)
        time.sleep(1.0)  # both ends must have found each other before losses count
        states.take()
        ticks, bad, sent, start = [], 0, 0, time.monotonic()
        while time.monotonic() - start < STREAM_TIME:
            states.wait(0.1)
            for data in states.take():
                message = decode_message(messages.LOW_STATE, data)
                bad += not messages.is_intact(message)
                ticks.append(int(message["tick"][0]))
                commands.write(encode_message(low_cmd_message(DAMPED)))
                sent += 1
        elapsed = time.monotonic() - start
        time.sleep(0.2)
        good = good_commands(at.process.stop())
    expected = (ticks[-1] - ticks[0]) // 2 + 1
    found.values = {
        "lost_states": 100.0 * (expected - len(set(ticks))) / expected,
        "lost_commands": 100.0 * (sent - good) / sent,
        "bad_crc": float(bad),
        "rate": len(ticks) / elapsed,
        "codec": codec_time(),
    }


def codec_time() -> float:
    """CPU time [us] of one lowcmd made, sealed and encoded, one lowstate decoded and checked."""
    state = np.zeros(1, messages.LOW_STATE)
    messages.seal(state)
    data = encode_message(state)

    def code() -> None:
        encode_message(low_cmd_message(DAMPED))
        intact_message(messages.LOW_STATE, data)

    return 1e6 / CODINGS * timeit.timeit(code, timer=time.process_time, number=CODINGS)


def measure_drive(
    _trial: Trial,
    found: TrialResult,
    simulator_options: Sequence[str] = (),
    driver_options: Sequence[str] = (),
) -> None:
    """Our controller in one process drives the simulator in another through ``UnitreePlant``.

    Stand, trot, high five, lie down; the speed is the simulator's truth.
    """
    with scene(*simulator_options) as at:
        with driver(at.domain, *driver_options) as peer:
            speeds = _true_speeds(at, peer.lines)
            text = peer.finish(DRIVE_LIMIT)
        said = at.process.stop()
    steps = [json.loads(line) for line in text.splitlines() if line.startswith("{")]
    undone = 4 - sum(bool(step["ok"]) for step in steps)
    reason = "; ".join(step["reason"] for step in steps if not step["ok"]) or text[-400:] + said
    found.values["steps"] = float(undone)
    if speeds:
        found.values["mae"] = float(np.mean(np.abs(np.array(speeds) - SPEED)))
    if undone:
        found.failures["steps"] = reason
    found.reason = "" if speeds else reason


def _true_speeds(at: Scene, lines: list[str]) -> list[float]:
    """Forward speeds over the four seconds before the trot's end, while the driver runs."""
    samples: list[tuple[float, float]] = []

    def has_walked() -> bool:
        for message in at.take():
            seconds, nanoseconds = message["stamp"][0]
            samples.append((seconds + 1e-9 * nanoseconds, float(message["velocity"][0, 0])))
        return any('"high_five"' in line or '"ok": false' in line for line in lines)

    wait_until(has_walked, DRIVE_LIMIT)
    walking = [time for time, speed in samples if speed > 0.8 * SPEED]
    if not walking:
        return []
    start, end = walking[0] + 1.5, walking[-1] - 0.3
    return [speed for moment, speed in samples if start <= moment <= end]


STUDIES: Final = tuple(
    Study(f"unitree-{name}", {f"Unitree: {item}": rows}, measure, "unitree", group="unitree")
    for name, item, rows, measure in (
        ("sport", "sport service", SPORT, measure_sport),
        ("stream", "lowstate and lowcmd, 500 Hz, 10 s", STREAM, measure_stream),
        ("drive", "our controller through UnitreePlant", DRIVE, measure_drive),
    )
)
