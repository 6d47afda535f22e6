"""The robot over a network: ``ros2``, ``unitree-sim``, ``unitree-drive``, ``identify-friction``."""

from __future__ import annotations

import logging
import signal
import sys
import threading
import time
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from controller.bridges.unitree import LOOPBACK
from controller.cli.common import (
    ExitCode,
    Json,
    Mjcf,
    Numbers,
    ProgressLine,
    dds_domain,
    folder,
    output,
    print_json,
    print_json_line,
)
from go2_wbc.errors import CommandError, PlantError
from go2_wbc.world import SENSORS

if TYPE_CHECKING:
    from controller.bridges.unitree.drive import Step
    from go2_wbc.plant.base import Plant
    from go2_wbc.plant.friction_identification import FrictionEstimate

STEPS = ("stand", "trot", "high_five", "lie_down")


def ros2(
    *,
    namespace: Annotated[str, "NAME", "of topics, default %(default)s"] = "robot1",
    realtime: Annotated[bool, "at the pace of the wall clock"] = False,
    viewer: Annotated[bool, "open MuJoCo's window"] = False,
    sensors: Annotated[str, SENSORS, "what its state comes from"] = "ideal",
    motions: Annotated[
        Path | None, "FOLDER", "whose saved motions and plans play_motion plays, too", folder
    ] = None,
    config: Numbers = None,
) -> int:
    """Serve a Go2 in MuJoCo under the whole-body controller as a ROS 2 node, until Ctrl-C.

    Needs the extra [ros2]; docs/ros2.md lists topics and services.

    Examples:
        go2-wbc ros2 --realtime                      at the pace of the wall clock
        go2-wbc ros2                                 as fast as it can, with /clock
        go2-wbc ros2 --realtime --namespace robot2   a second robot
        go2-wbc ros2 --realtime --sensors imu        odometry as a robot has it
        go2-wbc ros2 --realtime --motions plans      also plays plans/greet.plan
    """
    from controller.bridges.ros2.behaviors import SavedMotions
    from controller.bridges.ros2.server import ServerSettings, serve

    logging.getLogger("controller").setLevel(logging.INFO)
    saved = SavedMotions(motions)
    settings = ServerSettings(namespace, realtime, viewer, config, sensors, saved)
    serve(settings, _until_signal(), lambda text: print(text, file=sys.stderr, flush=True))
    return ExitCode.OK


def unitree_sim(
    *,
    domain: Annotated[int, "N", "default %(default)s", dds_domain] = 1,
    interface: Annotated[str, "NAME", "network, default %(default)s"] = LOOPBACK,
    mjcf: Mjcf = None,
    friction: Annotated[float | None, "MU", "of the feet, default 0.8"] = None,
    payload: Annotated[float, "KG", "extra mass"] = 0.0,
    sensors: Annotated[str, SENSORS, "what the robot tells"] = "ideal",
    seed: Annotated[int, "N", "of the noise"] = 0,
    lockstep: Annotated[
        bool, "under low-level control time waits for the next lowcmd (1 s at most)"
    ] = False,
    config: Numbers = None,
) -> int:
    """Simulate a Go2 that speaks Unitree's protocol (DDS), until Ctrl-C, limp at the end.

    It has the sport service for the stock SportClient, lowstate and lowcmd at 500 Hz.

    Examples:
        go2-wbc unitree-sim                      domain 1 on the loopback interface
        go2-wbc unitree-sim --domain 5 --sensors noisy
        go2-wbc unitree-sim --mjcf my_scene.xml --interface eth0
    """
    from controller.bridges.unitree import require_dds

    require_dds()
    from controller.bridges.unitree.simulator import SimulatorSettings, UnitreeSimulator

    for name in ("controller.bridges", "controller.loop"):
        logging.getLogger(name).setLevel(logging.INFO)
    stop = _until_signal()
    settings = SimulatorSettings(
        domain, interface, mjcf, friction, payload, sensors, seed, config, lockstep
    )
    with closing(UnitreeSimulator(settings)) as simulator:
        print(f"serving on DDS domain {domain}, interface {interface}", flush=True)
        while not stop.is_set():
            time.sleep(0.1)
            if not simulator.is_alive:
                raise PlantError("the simulation has ended; what was said before tells why")
        gate = simulator.gate
    refused = ", ".join(f"{reason} {count}" for reason, count in gate.refused.items())
    print(f"low-level commands: {gate.accepted} good, refused: {refused or 'none'}", flush=True)
    return ExitCode.OK


def unitree_drive(
    *,
    interface: Annotated[str, "NAME", f"{LOOPBACK} for a simulator"],
    domain: Annotated[int, "N", "0 robot, 1 simulator", dds_domain] = 0,
    i_have_the_remote_in_hand: Annotated[bool, "required: you can stop it"] = False,
    steps: Annotated[
        tuple[str, ...],
        "STEP",
        "of stand, sit, trot, high_five, lie_down, or a saved FILE.json or FILE.plan; default"
        f" {' '.join(STEPS)}",
    ] = STEPS,
    speed: Annotated[float, "M/S", "of the trot"] = 0.5,
    seconds: Annotated[float, "S", "of the trot"] = 4.0,
    stale_limit: Annotated[
        float, "S", "damp after this time without lowstate, default %(default)s"
    ] = 0.03,
    config: Numbers = None,
    json: Annotated[bool, "print a JSON line per step"] = False,
) -> int:
    """Drive a Go2, or go2-wbc unitree-sim, step by step with this project's controller.

    It goes through lowcmd and lowstate. The robot must lie, and ends limp. Read docs/real_robot.md
    first: no real robot has been driven by this program yet.

    Examples:
        go2-wbc unitree-drive --interface lo --domain 1 --i-have-the-remote-in-hand
        go2-wbc unitree-drive --interface eth0 --json --i-have-the-remote-in-hand
        go2-wbc unitree-drive --interface lo --domain 1 --i-have-the-remote-in-hand
            --steps stand greet.plan lie_down    a motion of your own, saved
    """
    from controller.arguments import config as read_config
    from controller.bridges.unitree.drive import Trot, check_steps, drive
    from controller.bridges.unitree.low_level import GuardConfig
    from controller.bridges.unitree.plant import UnitreePlant

    check_steps([*steps])
    trot, numbers = Trot(speed, seconds), read_config(config)
    plant = UnitreePlant(
        interface,
        domain,
        i_have_the_remote_in_hand=i_have_the_remote_in_hand,
        guards=GuardConfig(
            stale_limit=stale_limit, hang_limit=max(stale_limit, GuardConfig().hang_limit)
        ),
        estimator=numbers.estimator,
    )
    done = True
    with closing(plant):
        for step in drive(plant, [*steps], trot, numbers):
            _tell(step, as_json=json)
            done = done and step.ok
    return ExitCode.OK if done else ExitCode.FAILED


def _tell(step: Step, *, as_json: bool) -> None:
    if as_json:
        print_json_line(asdict(step))
        return
    error = "" if step.speed_error is None else f", speed off by {step.speed_error:.3f} m/s"
    print(f"{step.name:<12}{'done' if step.ok else 'NOT done: ' + step.reason}{error}", flush=True)


def _until_signal() -> threading.Event:
    """Is set by Ctrl-C, and by what ends a service.

    Ask ``is_set()``; the main thread may not ``wait()``: that holds the event's lock for a moment,
    and a handler that breaks in then waits for the lock in ``set()``, for ever.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    return stop


def friction(
    *,
    mjcf: Annotated[Path | None, "FILE", "an MJCF of your own"] = None,
    interface: Annotated[str | None, "NAME", "lo for a simulator"] = None,
    domain: Annotated[int, "N", "0 robot, 1 simulator", dds_domain] = 0,
    i_have_the_remote_in_hand: Annotated[bool, "required with --interface"] = False,
    out: Annotated[Path | None, "FILE", "write the TOML there, too", output(".toml")] = None,
    json: Json = False,
) -> int:
    """Move every joint of a robot that lies on its belly, legs over its back, for a minute.

    It prints the friction of the joints for the configuration file. With --interface that of a Go2,
    or go2-wbc unitree-sim: read docs/real_robot.md first, and leave half a metre around it.

    Examples:
        go2-wbc identify-friction     of the simulated robot
        go2-wbc identify-friction --mjcf my_go2.xml --out friction.toml
        go2-wbc identify-friction --interface eth0 --i-have-the-remote-in-hand
    """
    from go2_wbc.plant.friction_identification import identify_friction

    if mjcf is not None and interface is not None:
        raise CommandError("give --mjcf or --interface, not both")
    if interface is None:
        from go2_wbc.plant import MujocoPlant

        plant: Plant = MujocoPlant(mjcf)
    else:
        from controller.bridges.unitree.plant import UnitreePlant

        consent = i_have_the_remote_in_hand
        plant = UnitreePlant(interface, domain, i_have_the_remote_in_hand=consent)
    with ProgressLine() as line, closing(plant):
        estimate = identify_friction(
            plant, on_progress=lambda share: line.update(share, "identify friction")
        )
    if out is not None:
        out.write_text(estimate.toml(), encoding="utf-8")
    if json:
        print_json({name: values.tolist() for name, values in asdict(estimate).items()})
    else:
        _print(estimate)
    return ExitCode.OK


def _print(estimate: FrictionEstimate) -> None:
    from go2_wbc.legs import JOINT_NAMES

    print("# joint      dry [N m]          viscous [N m s/rad], measured")
    rows = zip(
        JOINT_NAMES,
        estimate.dry,
        estimate.dry_error,
        estimate.viscous,
        estimate.viscous_error,
        strict=True,
    )
    for name, dry, dry_error, viscous, viscous_error in rows:
        joint = name.removesuffix("_joint")
        print(f"# {joint:<10}{dry:7.3f} +- {dry_error:.3f}   {viscous:7.3f} +- {viscous_error:.3f}")
    print("# of the viscous friction 75 % is fed forward, less what is uncertain")
    print(estimate.toml(), end="")
