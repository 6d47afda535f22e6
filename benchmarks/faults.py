"""``python -m benchmarks faults``: parts break; are they named, and does the robot stay up?

MuJoCo judges. A trial of ``parts`` breaks one, drawn like the moment, of a robot that stands, of
one that trots at 0.5 m/s, and of one that raises a paw (motors and held feet are the raised leg's:
none stands on three with a dead motor in another, and a held foot that stands is none):

- named: the health tells of the part within ``NAMED_WITHIN``;
- falls: the trunk touches the ground, or tilts by 60 deg, before the robot has gone limp; or it
  tilts so far afterwards;
- goes on: it has not gone limp, and ``stand()`` is true at the end;
- others: parts that are named, be it for a moment, though they are sound.

``walks``: what everything must go on with, in twenty seconds of trot and other calls. ``alarms``:
two minutes of random calls of a sound robot in a world of other tables, every other one under
random pushes; no part may be named. Numbers were chosen on seeds below 9000.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.disturbed import CALLED, DOWN, RECOVERIES, STUMBLE, Watch, make
from benchmarks.robots import UNTOLD, plant_of
from benchmarks.study import Study, TrialResult
from benchmarks.unknown_world import ROBOTS, WORLDS, Robot, Unknown
from controller.modes import Mode
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.errors import Go2WbcError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant.faults import AXES
from go2_wbc.plant.mujoco.ground_truth import FALLEN_TILT, TOUCH
from go2_wbc.recording import true_runs
from go2_wbc.robot.description import GO2
from go2_wbc.robot.state import Health, PartFault
from motions import load_motion

FIRST_SEED = 10100
"""Seed of the first trial that is judged."""
STATES, PAW = ("standing", "trotting", "three-legs"), "FR_foot"
NAMED_WITHIN = 0.5  # [s]
SPEED = 0.5  # [m/s]
BEFORE, WATCHED = (1.0, 2.0), 4.0
"""Range of the time [s] from the last call to the break, and for how long that is watched [s]."""
RAISED, RISING, HELD = (1.8, 3.8), (2.1, 2.6), 2.0
"""The same range for a paw, and for one that is held: it leaves the ground after 2.1 s, rises until
2.8 s, and stays up for so long [s]."""
WALK_TIME = 20.0  # [s]
CALLS = ("stop", "stand", "high_five", "sit", "stand")
LIFE = 120.0  # Time [s] of a sound robot's random calls


@dataclass(frozen=True, slots=True)
class Break:
    """What breaks."""

    name: str  #: of its rows
    item: str  #: what it is, for the report
    kind: str  #: of fault, as ``MujocoPlant.fault`` takes it, and its ``value``
    parts: tuple[str, ...]  #: of which one breaks, or all if ``at_once``
    value: float | None = None
    named: str = "{}"  #: what the health calls a part
    unjudged: tuple[str, ...] = ()  #: states in which nothing can be noticed of it
    at_once: bool = False
    is_of_paw: bool | None = False
    """Whether it is the raised leg's on three legs; None for never, as a dead sensor is right of a
    paw in the air."""
    raised: tuple[float, float] = RAISED  #: range of the moment then [s]

    @property
    def study(self) -> Study:
        """Its rows in every state."""
        rows: list[tuple[str, str, str]] = []
        for state in STATES:
            bars = ("", "") if state in self.unjudged else (">= 0.9", "<= 0")
            rows += [
                (f"{state}-named", f"{state}: named in {NAMED_WITHIN:g} s", bars[0]),
                (f"{state}-falls", f"{state}: falls", bars[1]),
                (f"{state}-goes-on", f"{state}: goes on", ">="),
                (f"{state}-others", f"{state}: others named", ""),
            ]
        return Study(self.name, {self.item: rows}, partial(measure_break, what=self), group="parts")

    @property
    def walk(self) -> Study:
        """The rows of a robot that has it all the time."""
        rows = [("calls", "calls that are true", ">= 1"), ("way", "way off", "<= 10 %")]
        if not self.named:
            rows.append(("others", "parts named", "<= 0"))
        item, measure = f"{WALK_TIME:g} s of trot: {self.item}", partial(measure_walk, what=self)
        return Study(f"walk-{self.name}", {item: rows}, measure, group="walks")

    def broken(self, seed: int, state: str = "") -> tuple[str, ...]:
        """The parts that break in a trial."""
        parts, is_of_paw = self.parts, self.is_of_paw
        if is_of_paw is not False and state == "three-legs":
            parts = tuple(part for part in parts if part.startswith("FR") is bool(is_of_paw))
        return parts if self.at_once else (parts[seed % len(parts)],)


def measure_break(trial: Trial, found: TrialResult, what: Break) -> None:
    """Break a part in each state."""
    for state in STATES:
        with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
            robot.require(robot.go2.stand())
            if state == "trotting":
                robot.require(robot.go2.walk())
                robot.go2.move(SPEED)
            rng = np.random.default_rng(FIRST_SEED + trial.seed)
            bounds = what.raised if state == "three-legs" else BEFORE
            at = robot.plant.time + float(rng.uniform(*bounds))
            parts = what.broken(trial.seed, state)
            for part in parts:
                robot.plant.fault(what.kind, part=part, at=at, value=what.value)
            told = set[PartFault]()
            values = _lived_through(robot, state, at, told)
            health, reason = robot.go2.health, robot.go2.last_outcome.reason
        broken = {what.named.format(part) for part in parts}
        times = dict[str, float]()  # of a part that is named twice, when it first was
        for fault in sorted(told, key=lambda fault: -fault.since):
            if fault.part in broken:
                times[fault.part] = fault.since - at
        if what.at_once and state == "three-legs":  # a dead sensor is right of a paw in the air
            broken.discard(what.named.format(PAW))
        values["named"] = max(times.get(part, math.inf) for part in broken) <= NAMED_WITHIN
        values["others"] = len({(fault.part, fault.what) for fault in told}) - len(times)
        found.notes[state] = f"{', '.join(parts)} at {at:.2f} s: {health}; {reason}"
        found.values |= {f"{state}-{name}": float(value) for name, value in values.items()}


def _lived_through(
    robot: TrialRobot, state: str, at: float, told: set[PartFault]
) -> dict[str, float]:
    """Whether a robot of which something breaks at that time [s] falls, and goes on.

    What it names goes into ``told``.
    """
    go2, limp = robot.go2, math.inf

    def look() -> None:
        nonlocal limp
        told.update(go2.health.faults)
        if go2.mode in DOWN:
            limp = min(limp, robot.plant.time)

    robot.truth.on_tick = look
    if state == "three-legs":
        go2.play(load_motion("high_five", hold=HELD))
    else:
        go2.wait(at + WATCHED - robot.plant.time)
    seen = robot.truth.recording(since=at)
    touches = true_runs((seen.trunk_force > TOUCH) & (seen.time <= limp))
    longest = max((run.stop - run.start for run in touches), default=0)
    tilt = np.arccos(np.cos(seen.rpy[:, 0]) * np.cos(seen.rpy[:, 1])).max()
    lies = longest * robot.plant.control_period > STUMBLE
    falls = lies or tilt > FALLEN_TILT or go2.mode is Mode.FALLEN
    return {"falls": falls, "goes-on": go2.mode not in DOWN and go2.stand()}


def measure_walk(trial: Trial, found: TrialResult, what: Break) -> None:
    """Trot, and call; what breaks at once breaks at random times, one part after the other."""
    rng, done = np.random.default_rng(FIRST_SEED + trial.seed), 0
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        go2, plant, told = robot.go2, robot.plant, set[PartFault]()
        robot.truth.on_tick = lambda: told.update(go2.health.faults)
        for part in what.broken(trial.seed):
            at = float(rng.uniform(0.0, WALK_TIME))
            plant.fault(what.kind, part=part, at=at if what.at_once else 0.0, value=what.value)
        try:
            robot.require(go2.walk())
            go2.move(SPEED)
            robot.wait(1.0)
            robot.truth.clear()
            robot.wait(WALK_TIME)
            speed = float(robot.truth.recording().com_velocity[:, 0].mean())
            found.values["way"] = 100.0 * abs(speed / SPEED - 1.0)
            for call in CALLS:
                getattr(go2, call)()
                robot.require(go2.last_outcome.ok)
                done += 1
        except (TrialFailed, Go2WbcError) as failed:
            found.notes["calls"] = f"{done} calls: {failed}"
        found.values["calls"] = done / len(CALLS)
        found.notes["health"] = str(go2.health)
        if not what.named:
            found.values["others"] = float(len(told))


def measure_alarms(trial: Trial, found: TrialResult, world: Unknown | Robot) -> None:
    """Live for two minutes, and name nothing."""
    rng = np.random.default_rng((FIRST_SEED + trial.seed, *world.name.encode()))
    plant = world.plant(FIRST_SEED + trial.seed, trial.sensors)
    with TrialRobot(plant, world.config if isinstance(world, Robot) else None) as robot:
        life, told = Watch(robot, rng), set[PartFault]()

        def look() -> None:
            told.update(robot.go2.health.faults)
            if trial.seed % 2:
                life.look()

        robot.truth.on_tick = look
        while plant.time < LIFE:
            make(robot, life, str(rng.choice(CALLED)), rng)
            for _ in range(RECOVERIES):
                if robot.go2.mode in DOWN:
                    make(robot, life, "recover", rng)
            robot.truth.clear()
    found.values = {"alarms": float(len(told)), "time": plant.time / 60.0}
    found.notes["health"] = str(Health(tuple(sorted(told, key=lambda fault: fault.since))))


_motor = partial(Break, kind="motor", named="motor of {}", is_of_paw=True)
MOTORS = (
    *(
        _motor(f"{name}-dead", f"motor of a {name} dead", parts=JOINT_NAMES[part::3])
        for part, name in enumerate(("hip", "thigh", "calf"))
    ),
    _motor("half", "motor at half its torque", parts=JOINT_NAMES, value=0.5),
)
ENCODERS = (
    Break("stuck", "encoder stuck", "encoder_stuck", JOINT_NAMES),
    Break("off", "encoder 0.1 rad off", "encoder", JOINT_NAMES),
)
FEET = (
    Break("foot-dead", "foot's sensor dead", "foot_force", FOOT_NAMES, is_of_paw=None),
    Break("foot-40", "foot's sensor stuck at 40 N", "foot_force", FOOT_NAMES, 40.0),
    Break("feet-dead", "all feet's sensors dead", "foot_force", FOOT_NAMES, at_once=True),
)
IMU = (
    Break("gyro", "gyro + 0.5 rad/s about an axis", "gyro", AXES, named="gyro"),
    Break("accelerometer", "accelerometer + 1 m/s^2", "accelerometer", AXES, named="accelerometer"),
)
HELD_FOOT = Break(
    "held",
    "foot held for 0.3 s by 200 N",
    "foot_held",
    FOOT_NAMES,
    unjudged=("standing",),
    is_of_paw=True,
    raised=RISING,
)
UNFELT = (
    Break(
        "nan",
        "19 readings not a number",
        "not_a_number",
        (*JOINT_NAMES, *FOOT_NAMES, *AXES),
        named="",
        at_once=True,
    ),
    Break("lost", "5 % of packets lost", "lost_packets", ("",), named=""),
)


ALARMS = (("alarms", "parts named", "<= 0"), ("time", "robot time", "min"))
STUDIES = (
    *(what.study for what in (*MOTORS, *ENCODERS, *FEET, *IMU, HELD_FOOT)),
    *(what.walk for what in (*FEET, *UNFELT)),
    *(
        Study(
            f"alarms-{world.name}",
            {f"sound: {world.item}": ALARMS},
            partial(measure_alarms, world=world),
            group="alarms",
        )
        for world in (*WORLDS, *(robot for robot in ROBOTS if robot.robot == GO2))
    ),
)

run = Benchmark(
    "faults",
    "Parts break: are they named in time, does the robot stay up;\nand is a sound one ever named?",
    STUDIES,
    takes="an hour on two cores",
    examples=("--sensors imu --rows parts", "--sensors imu --rows alarms"),
    sensors=True,
).run
