"""``python -m benchmarks locomotion``: how fast, and how exactly, the robot walks in every gait.

A run takes ``WINDOW`` seconds, from ``START_TIME`` after
the command on: motors with their torque-speed line, friction 0.6 to 1.0 and masses within 10 %, of
which the controller is not told. The state is the true one, or estimated from IMU, encoders and
feet (the group ``sensors``). Gaits and weights were chosen on
seeds 0 to 9; those judged begin at ``FIRST_SEED``.

- velocity: of MuJoCo's CoM in the heading frame, every tick;
- mean velocity error: |mean - command| / |command|, in the direction of the command;
- mean absolute error: mean of |velocity - command|, oscillation within the stride included;
- turning: from the heading (unwrapped) at both ends of the window;
- saturated ticks: share of ticks in which some motor gives all it has at its speed;
- cost of transport: mean of the joints' sum of |torque x speed|, over weight times wanted speed.

On sensors also (tuned on seeds 0 to 9 and 7000 to 7035, at 0.5 to 3 m/s), in a world that begins
where the robot lies:

- creep: way of the estimate of a standing robot over 60 s, beyond the way in truth;
- drift: the way walked by the estimate against that in truth, over 20 s;
- height, heading and velocity of the estimate while it walks up stairs, over a ramp and waves, on a
  slope, and by commands that change every ``EACH`` seconds: how far the first two are off in the
  end, and the velocity in the mean of the worst second (tuned on seeds 100 to 106).

``benchmarks.unknown_world`` has the groups ``unknown``, ``unknown-sensors`` and ``robots``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from benchmarks import library
from benchmarks.command import Benchmark
from benchmarks.robots import FRICTION_RANGE, UNTOLD, plant_of
from benchmarks.study import IMU, Study, TrialResult
from benchmarks.unknown_world import STUDIES as UNKNOWN
from controller.motion_measurement import FULL
from controller.sweeps.trials import Trial, TrialRobot, set_off
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import trot_of
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.plant.terrain import Ramp, Slope, Stairs, Terrain, Waves
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation

FIRST_SEED = 14000
"""Seed of the first trial that is judged; those from 4000 on were, and causes found on them."""
START_TIME, WINDOW = 3.0, 20.0  #: Time [s] after a command that is left out, and that is measured
BEYOND = Config(envelope=VelocityEnvelope(forward=4.0))  #: Of the runs that are beyond the envelope


@dataclass(frozen=True, slots=True)
class Run:
    """One command to one gait, and what is asked of it."""

    name: str  #: of the scenario
    gait: str  #: its name
    command: VelocityCommand  #: what is followed
    mean: float | None  #: greatest mean error [%]; None if it only informs
    mae: float | None = None  #: greatest mean absolute error [m/s]; None if it only informs
    saturated: float | None = None
    """Greatest share of saturated ticks [%]; None if it only informs."""
    group: str = "trot"  #: of the scenario
    speed: float | None = 1.0
    """Greatest joint speed, as a share of its limit; None if it only informs."""
    cost: float | None = None  #: greatest cost of transport; None if it only informs

    @property
    def study(self) -> Study:
        """Its rows and its trial."""
        c = self.command
        item = f"{self.gait} ({c.linear_x:g}, {c.linear_y:g}) m/s, {c.angular_z:g} rad/s, 20 s"
        rows = [
            ("mean", "mean velocity error", _bar(self.mean, "%")),
            ("mae", "mean absolute error", _bar(self.mae, "m/s")),
            ("cost", "cost of transport", _bar(self.cost, "")),
            ("turn", "mean turning error", _bar(self.mean, "%")),
            ("saturated", "saturated ticks", _bar(self.saturated, "%")),
            ("speed", "peak joint speed / limit", _bar(self.speed, "")),
        ]
        first, last = 0 if speed_of(c) else 3, 4 if c.angular_z else 3
        table = {item: (*rows[first:last], *rows[4:])}
        return Study(self.name, table, partial(measure_run, run=self), group=self.group)


def _bar(most: float | None, unit: str) -> str:
    return unit if most is None else f"<= {most:g} {unit}".rstrip()


def speed_of(command: VelocityCommand) -> float:
    """Speed [m/s] of the command, turning aside."""
    return math.hypot(command.linear_x, command.linear_y)


def measure_run(trial: Trial, found: TrialResult, run: Run) -> None:
    """Follow the command; see the module's docstring for what is measured."""
    plant, config = plant_of(trial, FIRST_SEED, UNTOLD), None
    if speed_of(run.command) > trot_of().forward:
        config = BEYOND
    mass = plant.total_mass
    with TrialRobot(plant, config) as robot:
        set_off(robot, run.gait, run.command)
        robot.wait(START_TIME + WINDOW)
        recorded = robot.truth.recording()
    found.values = measured(run, recorded.since(recorded.time[0] + START_TIME), mass)


def measured(run: Run, window: TruthRecording, mass: float) -> dict[str, float]:
    """The values of the run's rows; ``mass`` of the robot [kg]."""
    command, model, wanted = run.command, RobotModel(), speed_of(run.command)
    values = {
        "saturated": 100.0 * float((window.torque_shares(model) >= FULL).mean()),
        "speed": window.peak_speed_share(model),
    }
    if wanted:
        direction = np.array([command.linear_x, command.linear_y]) / wanted
        error = window.com_velocity[:, :2] @ direction - wanted
        values["mean"] = 100.0 * abs(float(error.mean())) / wanted
        values["mae"] = float(np.abs(error).mean())
        power = np.abs(window.tau * window.v[:, 6:]).sum(axis=1).mean()
        values["cost"] = float(power) / (mass * model.gravity * wanted)
    if command.angular_z:
        rate = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        values["turn"] = 100.0 * abs(rate / command.angular_z - 1.0)
    return values


RUNS = (
    Run("ahead-0.5", "trot", VelocityCommand(0.5), 1.0, 0.012, 5.0, cost=0.85),
    Run("ahead-1.0", "trot", VelocityCommand(1.0), 1.0, 0.02, 5.0, cost=0.78),
    Run("ahead-1.5", "trot", VelocityCommand(1.5), 1.0, 0.03, 5.0),
    Run("ahead-2.0", "trot", VelocityCommand(2.0), 1.0, 0.04, 5.0, cost=0.75),
    Run("ahead-2.5", "trot", VelocityCommand(2.5), 1.0, 0.05, 5.0),
    Run("ahead-3.0", "trot", VelocityCommand(3.0), 3.0, 0.08),
    Run("aside-0.5", "trot", VelocityCommand(0.0, 0.5), 2.0),
    Run("aside-1.0", "trot", VelocityCommand(0.0, 1.0), 2.0),
    Run("turn-2", "trot", VelocityCommand(0.0, 0.0, 2.0), 2.0),
    Run("turn-4", "trot", VelocityCommand(0.0, 0.0, 4.0), 2.0),
    Run("turn-6", "trot", VelocityCommand(0.0, 0.0, 6.0), 2.0),
    Run("curve", "trot", VelocityCommand(0.8, 0.3, 1.0), 2.0),
    Run("ahead-3.5", "trot", VelocityCommand(3.5), None, group="moonshot", speed=None),
    Run("flying-trot", "flying_trot", VelocityCommand(1.5), 5.0, None, 5.0, "gaits"),
    Run("walk", "walk", VelocityCommand(0.4), 5.0, None, 5.0, "gaits"),
    Run("pace", "pace", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
    Run("pronk", "pronk", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
    Run("bound", "bound", VelocityCommand(0.6), 5.0, None, 5.0, "gaits"),
    Run("gallop", "gallop", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
)
ON_SENSORS = (
    *(
        Run(f"{speed:g}", "trot", VelocityCommand(speed), mean)
        for speed, mean in ((0.5, 2.0), (1.0, 2.0), (1.5, 2.0), (2.0, 2.0), (2.5, 3.0), (3.0, None))
    ),
    *(replace(run, mae=None) for run in RUNS if not run.name.startswith("ahead")),
    Run("3.5", "trot", VelocityCommand(3.5), None, speed=None),
)
"""The same on its own sensors; at 3 m/s all that is asked for is not to fall, at 3.5 nothing."""


ODOMETRY_SPEED = 0.5  # m/s
EACH = 3.0  # s
SLOPE = math.radians(15.0)
MIXED = (-0.8, -0.5, -1.5), (1.5, 0.5, 1.5)
"""Range of what is commanded: ahead, to the left [m/s], turning [rad/s]."""
Commands = Sequence[tuple[float, float, float]]


def _place(plant: MujocoPlant) -> Float[np.ndarray, "2 4"]:
    """x, y, z [m] and heading [rad] by the estimate, and in truth."""
    return np.array([[*state.q[:3], state.yaw] for state in (plant.read(), plant.truth())])


def measure_drift(trial: Trial, found: TrialResult, seconds: int, *, walks: bool) -> None:
    """Stand, or trot straight ahead."""
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        robot.require(robot.go2.stand())
        if walks:
            robot.require(robot.go2.walk())
        before = _place(robot.plant)
        if walks:
            robot.go2.move(ODOMETRY_SPEED)
        for _ in range(seconds):
            robot.wait(1.0)
            robot.truth.clear()  # a minute's recording would be a gigabyte
        seen, true = _place(robot.plant) - before
    turn = yaw_rotation(before[0, 3] - before[1, 3])[:2, :2]  # from the true world into its own
    off, way = (float(np.linalg.norm(p)) for p in (seen[:2] - turn @ true[:2], true[:2]))
    turned = float(abs(np.degrees(seen[3] - true[3] + np.pi) % 360.0 - 180.0))
    if walks:
        found.values = {"drift": 100.0 * off / way, "turned": turned}
    else:
        found.values = {"creep": 1000.0 * off, "moved": 1000.0 * way}


def measure_estimate(
    trial: Trial, found: TrialResult, terrain: Terrain | None = None, commands: Commands = ()
) -> None:
    """Walk on ``terrain`` by the ``commands``, by default random ones for 60 s."""
    rng = np.random.default_rng(FIRST_SEED + trial.seed)
    friction, mass = rng.uniform(*FRICTION_RANGE), rng.uniform(*UNTOLD)
    plant = MujocoPlant(
        terrain=terrain,
        friction=friction,
        mass_scale=mass,
        sensors=trial.sensors,
        seed=FIRST_SEED + trial.seed,
    )
    off: list[Float[np.ndarray, "3"]] = []
    with TrialRobot(plant) as robot:
        robot.require(robot.go2.walk())
        before = np.subtract(*_place(plant))
        robot.truth.on_tick = lambda: off.append(plant.read().v[:3] - plant.truth().v[:3])
        for ahead, left, turn in commands or rng.uniform(*MIXED, size=(20, 3)).tolist():
            robot.go2.move(ahead, turn, linear_y=left)
            robot.wait(EACH)
            robot.truth.clear()
        *_, height, heading = np.subtract(*_place(plant)) - before
    second = round(1.0 / plant.control_period)
    seconds = np.array(off[: len(off) // second * second]).reshape(-1, second, 3).mean(axis=1)
    found.values = {
        "height": 1000.0 * abs(float(height)),
        "turned": math.degrees(abs(wrap_angle(float(heading)))),
        "velocity": float(np.linalg.norm(seconds, axis=1).max()),
    }


_stand = partial(measure_drift, seconds=60, walks=False)
_walk = partial(measure_drift, seconds=20, walks=True)
_CREEP = (("creep", "creep of the estimate", "<= 3 mm"), ("moved", "way in truth", "mm"))
_DRIFT = (
    ("drift", "drift of odometry / way", "<= 1.5 %"),
    ("turned", "drift of the heading", "deg"),
)
_OFF = (
    ("height", "height off", "mm"),
    ("turned", "heading off", "deg"),
    ("velocity", "velocity off, worst second", "m/s"),
)


def _barred(which: str, most: float) -> tuple[tuple[str, str, str], ...]:
    """The rows of an estimate, one with a bar."""
    return tuple(
        (name, quantity, f"<= {most:g} {unit}" if name == which else unit)
        for name, quantity, unit in _OFF
    )


_AHEAD, _BACK = (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)
_LEFT, _RIGHT = (0.0, 0.3, 0.0), (0.0, -0.3, 0.0)
_RAMP, _ROUND = Ramp(math.radians(20.0), length=2.0), (_AHEAD, _BACK, _LEFT, _RIGHT)
_ON_STAIRS = partial(measure_estimate, terrain=Stairs(), commands=3 * (_AHEAD,))
_ON_SLOPE = partial(measure_estimate, terrain=Slope(SLOPE), commands=_ROUND)
_ON_RAMP = partial(measure_estimate, terrain=_RAMP, commands=5 * (_AHEAD,))
_ON_WAVES = partial(measure_estimate, terrain=Waves(), commands=5 * (_AHEAD,))
ESTIMATED = tuple(
    Study(name, {f"sensors: {item}": rows}, measure, prefix, group="sensors", sensors=IMU)
    for name, item, rows, measure, prefix in (
        ("standing", "standing, 60 s", _CREEP, _stand, ""),
        ("odometry", "trot 0.5 m/s, 20 s", _DRIFT, _walk, ""),
        ("stairs-height", "up 4 stairs of 8 cm, 9 s", _barred("height", 15), _ON_STAIRS, "stairs"),
        ("ramp-height", "over a ramp of 20 deg, 15 s", _barred("height", 15), _ON_RAMP, "ramp"),
        ("waves-height", "over waves of 8 cm, 15 s", _barred("height", 15), _ON_WAVES, "waves"),
        ("mixed", "20 commands, 60 s", _barred("turned", 1.5), measure_estimate, "mixed"),
        ("slope", "to all sides on 15 deg, 12 s", _barred("velocity", 0.03), _ON_SLOPE, "slope"),
    )
)


STUDIES = (
    *(run.study for run in RUNS),
    *(run.study.sensed("sensors") for run in ON_SENSORS),
    *ESTIMATED,
    library.ON_SENSORS,
    *UNKNOWN,
)
"""In the order of the report."""


BENCHMARK = Benchmark(
    "locomotion",
    "Every gait at its speeds: how exactly, and within which limits.",
    STUDIES,
    takes="an hour on two cores",
    examples=("--rows sensors", "--rows ahead-2.5 gaits --json"),
)
run = BENCHMARK.run
