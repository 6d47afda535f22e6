"""Puts a pilot together: robot model, control loop and runner on one plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from controller.loop import ControlLoop
from controller.pilot import Pilot
from controller.runner import Runner
from controller.telemetry import Telemetry
from go2_wbc.compilation import load_kernels
from go2_wbc.config import Config
from go2_wbc.lazy import without_collecting
from go2_wbc.plant.base import Plant
from go2_wbc.plant.friction_identification import VISCOUS_SHARE
from go2_wbc.robot.description import RobotDescription, find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload_estimation import PayloadEstimator
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.tasks import Task

if TYPE_CHECKING:
    from go2_wbc.plant.mujoco.viewer import PlantViewer

RECORDED_TIME = 240.0  #: Seconds of robot time that the telemetry keeps


def build_pilot(
    plant: Plant,
    config: Config,
    *,
    realtime: bool = False,
    viewer: bool = False,
    recorded_time: float = RECORDED_TIME,
    description: RobotDescription | None = None,
    after_tick: Callable[[], None] = lambda: None,
    extra_tasks: Sequence[Task] = (),
) -> Pilot:
    """Take over a robot that lies on the ground, damped; ``close`` the pilot in the end.

    Nothing is left open if it fails; ``plant`` stays the caller's to close. The pilot's robot model
    belongs to the thread that ticks: whoever plans needs another one.

    Args:
        plant: what to drive; no other pilot may drive it.
        config: numbers of the engine; ``beside_hardware`` if the plant moves a real robot.
        realtime: let time pass in a background thread at wall-clock pace.
        viewer: open MuJoCo's window, if there is a display.
        recorded_time: robot time [s] that the telemetry keeps; 0 keeps the last tick.
        description: what the controller takes the robot for; by default the installed one.
        after_tick: is called after every tick, in the thread that ticks.
        extra_tasks: a user's own tasks of the whole-body QP.

    Raises:
        ConfigError: for a back end that does not exist or takes no tasks of a user's own.
        SolverUnavailable: if the configured QP solver is unknown or not installed.
        DescriptionError: if the robot's files are missing, broken, or not a Go2's.
        PlantError: if the plant does not answer, or another pilot drives it.
    """
    if plant.is_hardware:
        config = config.beside_hardware
    with without_collecting():
        load_kernels()
    config = _with_damping(config, plant)
    model = RobotModel(description or find_description(robot=config.robot), motor=config.motor)
    wbc, dynamic_wbc = (
        WholeBodyController(model, config.backend, numbers, extra_tasks=extra_tasks)
        for numbers in (config.wbc, config.wbc.for_dynamics)
    )
    telemetry = Telemetry(model, max(1, round(recorded_time / plant.control_period)))
    payloads = None
    if config.payload.enabled and config.backend != "placo":  # whose robot is PlaCo's own
        payloads = PayloadEstimator(model, config.wbc.joint_friction, config.payload)
    loop = ControlLoop(plant, model, wbc, telemetry, config.safety, dynamic_wbc, payloads)
    with ExitStack() as opened:
        if viewer:
            from go2_wbc.plant.mujoco.viewer import open_viewer  # MuJoCo's window with it

            window = open_viewer(plant)
            if window is not None:
                opened.callback(window.close)
                after_tick = partial(_shown, window, loop, after_tick)
        runner = Runner(loop, realtime=realtime, after_tick=after_tick)
        opened.callback(runner.close)
        pilot = Pilot(runner, config)
        pilot.close = opened.pop_all().close
    return pilot


def _with_damping(config: Config, plant: Plant) -> Config:
    """``config`` with the friction that the plant's description tells, unless it has its own.

    A leg of 0.3 kg at the foot that meets 2 N m s/rad is slowed down by 100 1/s: without it no foot
    would swing to its place in time.
    """
    own = config.wbc.joint_friction
    if any(own.viscous) or not any(plant.joint_damping):
        return config
    viscous = tuple(VISCOUS_SHARE * damping for damping in plant.joint_damping)
    friction = replace(own, viscous=viscous)
    return replace(config, wbc=replace(config.wbc, joint_friction=friction))


def _shown(window: PlantViewer, loop: ControlLoop, after_tick: Callable[[], None]) -> None:
    window.show(loop.state.time)
    after_tick()
