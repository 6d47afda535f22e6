"""``python -m benchmarks sequences``: random calls in a row; does every answer hold in truth?

A trial makes ``CALLS`` random calls, in one of four worlds that the controller is not told of:
postures, gaits, small, large and zero commands, goals, motions, arguments that are wrong, calls
that the mode does not allow, and calls from a second thread while one runs. Nobody pushes. MuJoCo
judges, by criteria of this module. Causes were looked for on seeds below ``FIRST_SEED``.

- untrue True: it said True, and the goal is missed by more than what the documentation allows;
- untrue False: it said False, the goal met at that moment, and nobody had called it off;
- falls: tilt of 60 deg or the trunk on the ground, without being told, or a robot that says so;
- errors: an exception that the documentation does not name for this call in this mode, or none
  where it names one;
- hangs: a call, or one in the second thread, that does not end in time.
"""

import math
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.behaviour import REAR_END, SIT_PITCH, SIT_REAR_HEIGHT
from benchmarks.command import Benchmark
from benchmarks.disturbed import Watch
from benchmarks.high_five import longest_run
from benchmarks.robots import plan_of
from benchmarks.study import IMU, Study, TrialResult
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.motion_measurement import during_motion, placed, trunk_off, turned_off
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.errors import CommandError, ModeError, StanceMismatch
from go2_wbc.legs import LEGS, SIDES
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TOUCH, TruthRecording
from go2_wbc.plant.terrain import Boxes, Slope
from go2_wbc.reference import Anchor
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel

FOOT_RADIUS, STAND_HEIGHT = find_profile().foot_radius, find_profile().stand_height
FIRST_SEED = 9100  #: Seed of the first trial that is judged
CALLS = 7
HANGS = 90.0
"""Time [s] of the robot, and of a thread, after which a call hangs: no call here may take 40."""
AT_REST, WATCHED, MOMENT = 0.02, 2.0, 0.1
"""Speed [m/s] of the CoM at rest; for how long it is watched then, and before a verdict [s]."""
HEIGHT, TILT, STILL, JOINTS_STILL = 0.02, 0.1, 0.05, 0.5
"""m, rad, m/s and rad/s by which a posture may be off, or move."""
TURN, HEADING, PLACE = math.radians(1.5), math.radians(1.5), 0.02
"""rad, rad and m by which a goal may be missed."""
SHOULDER, OVER_SHOULDER = 0.1934, 0.2
"""Place of the front hips ahead in the base frame, and height of a raised paw over them [m]."""
TRUNK_OFF, TURNED_OFF, TOUCHED = 0.05, 0.1, 0.02
"""m and rad that a motion may be off its plan, and time [s] on trunk or legs."""
LYING_HEIGHT = 0.1  # m; base of a robot that lies
MOTIONS = ("bow", "wave", "nod", "march", "push_ups", "stretch", "side_shuffle", "twist")
POSTURES = ("stand", "sit", "lie_down", "recover")
GOALS = ("turn_left", "turn_right", "move_forward")
OTHERS = ("stop", "damp", "cancel", "stand", "move")  #: What a second thread calls
ENDING: Mapping[str, tuple[str, ...]] = {
    "damp": (*POSTURES, *GOALS, "walk", "high_five", "play", "wait", "stop"),
    "stop": GOALS,
    "cancel": ("high_five", "play"),
}
"""Calls that each of them may end."""
WRONG: tuple[tuple[str, tuple[Any, ...]], ...] = (
    ("walk", ("hop",)),
    ("move", (math.nan,)),
    ("turn_left", (1e9,)),
    ("move_forward", (math.inf,)),
    ("high_five", ("top",)),
    ("play", ("no such motion",)),
    ("wait", (-1.0,)),
)
"""Calls whose arguments are wrong."""
DRAWN_GAITS = (*GAITS, "trot", "trot", "auto")
STEEP_GAITS = ("pace", "bound")
"""Both feet of a side, or of an end, stand beside the CoM: that asks for more friction than 0.3."""
FREE = ("recover", "wait", "damp", "stop")  #: What a robot that has fallen may be told


@dataclass(frozen=True, slots=True)
class World:
    """What the controller is not told."""

    name: str  #: of the study
    item: str  #: what it is, for the report
    room: float
    """Share by which True may be worse, and False must be better, than the limit that the
    documentation names."""
    settings: tuple[Mapping[str, Any], ...]  #: of ``MujocoPlant``, from seed to seed in turn
    gaits: tuple[str, ...] = DRAWN_GAITS  #: that are drawn

    def plant(self, seed: int) -> MujocoPlant:
        """The simulated robot of a trial."""
        settings = dict(self.settings[seed % len(self.settings)])
        if isinstance(boxes := settings.get("terrain"), Boxes):
            settings["terrain"] = replace(boxes, seed=seed)
        return MujocoPlant(**settings, seed=seed, initial_joint_noise=JOINT_NOISE)


_SLIPPERY, _LATE = {"friction": 0.3, "payload": 3.0}, {"delay": 0.008, "sensors": IMU}
_UNEVEN = {"terrain": Boxes(count=60)}, {"terrain": Slope(math.radians(8.0))}
_FLAT_GAITS = tuple(name for name in DRAWN_GAITS if name not in STEEP_GAITS)
WORLDS = (
    World("level", "friction 0.6", 0.05, ({"friction": 0.6},)),
    World("slippery", "friction 0.3, 3 kg", 0.05, (_SLIPPERY,), _FLAT_GAITS),
    World("uneven", "boxes of 6 cm, or 8 deg", 0.25, _UNEVEN),
    World("late", "8 ms late, on its own sensors", 0.5, (_LATE,)),
)


@dataclass(frozen=True, slots=True)
class Call:
    """One call, what follows it, and what a second thread calls meanwhile."""

    name: str  #: of the method
    arguments: tuple[Any, ...]  #: of it
    is_wrong: bool  #: whether they are
    is_watched: bool  #: whether the robot is watched for ``WATCHED`` seconds after it
    other: str  #: what a second thread calls, or ""
    moment: float  #: time [s] after the beginning at which it does
    pause: float  #: time [s] until the next call

    def __str__(self) -> str:
        """As it is written."""
        other = f" & {self.other} after {self.moment:.2f} s" if self.other else ""
        return f"{self.name}({', '.join(map(str, self.arguments))}){other}; {self.pause:.1f} s"


def drawn(rng: np.random.Generator, mode: Mode, gaits: Sequence[str]) -> Call:
    """A random call to a robot in this mode: it seldom asks of one that does not walk to go."""
    scale = rng.choice([0.0, 0.4, 1.0, 5.0])
    arguments: dict[str, tuple[Any, ...]] = {
        **dict.fromkeys((*POSTURES, "stop", "damp"), ()),
        "walk": (str(rng.choice(gaits)),),
        "high_five": (str(rng.choice([*SIDES])), round(float(rng.uniform(0.5, 2.0)), 2)),
        "turn_left": (round(float(rng.uniform(-2.0, 2.0)), 3),),
        "turn_right": (round(float(rng.normal(0.0, 0.5)), 3),),
        "move_forward": (round(float(rng.uniform(-0.6, 1.0)), 3),),
        "play": (str(rng.choice(MOTIONS)),),
        "wait": (round(float(rng.uniform(0.0, 1.5)), 3),),
        "move": tuple(np.round(scale * rng.uniform(-1.0, 1.0, 2), 2).tolist()),
    }
    often = ("stand", "sit", "walk", "walk", "move", "move", "move", "stop", "stop", *GOALS)
    name = str(rng.choice([*arguments, *often]))
    if name in ("move", "stop") and mode is not Mode.WALKING and rng.random() < 0.8:
        name = "walk"
    is_wrong = bool(rng.random() < 0.06)
    if is_wrong:
        name, arguments[name] = WRONG[int(rng.integers(len(WRONG)))]
    return Call(
        name,
        arguments[name],
        is_wrong=is_wrong,
        is_watched=bool(rng.random() < 0.5),
        other=str(rng.choice(OTHERS)) if rng.random() < 0.15 and name != "move" else "",
        moment=float(rng.uniform(0.05, 3.0)),
        pause=float(rng.choice([0.0, 0.3, 1.5, 3.0])),
    )


class _Hangs(Exception):
    """A call that does not end."""


class Judge:
    """Makes calls, and compares what comes of them with the truth.

    Attributes:
        found: by row, what was wrong.
    """

    def __init__(self, robot: TrialRobot, room: float) -> None:
        """Judge ``robot``'s answers; see ``World.room``."""
        self._robot, self._room = robot, room
        self._watch = Watch(robot, None)
        robot.truth.on_tick = self._look
        self.found: dict[str, list[str]] = {name: [] for name, *_ in ROWS}
        self._is_limp, self._goal_row = False, -1
        self._second = _Second(robot, "")

    def make(self, call: Call) -> None:
        """Make one call, and judge it."""
        go2, truth, watch = self._robot.go2, self._robot.truth, self._watch
        truth.clear()
        watch.call, before = str(call), go2.mode
        self._is_limp = call.name == "damp" or (self._is_limp and not before.is_upright)
        watch.may_lie = self._is_limp or call.name == "lie_down"
        self._second = second = _Second(self._robot, call.other, truth.start + call.moment)
        self._goal_row, raised = -1, None
        falls = len(watch.all_falls)
        try:
            said = _made(go2, call)
        except _Hangs:
            self.found["hangs"].append(str(call))
            raise
        except Exception as error:  # whatever it is, it is what is looked for
            said, raised = None, error
        must, may = _errors(call, before)
        if not (isinstance(raised, may) if raised else not must):
            what = f"{type(raised).__name__}: {raised}" if raised else "no error"
            self.found["errors"].append(f"{call} in mode {before.value}: {what}")
        wrong, self._second = second.ended(), _Second(self._robot, "")
        if wrong:
            self.found["hangs" if wrong.endswith("hangs") else "errors"].append(f"{call}: {wrong}")
        has_ended = second.has_begun and call.name in ENDING.get(call.other, ())
        if second.has_begun and call.other == "damp":
            self._is_limp = watch.may_lie = True
        if said is not None and len(watch.all_falls) == falls:
            self._judge(call, said, has_ended)
        go2.wait(call.pause)
        if not self._is_limp:  # one that was told to go limp may have fallen
            self.found["falls"] += map(str, watch.all_falls[falls:])

    def _judge(self, call: Call, said: bool, has_ended: bool) -> None:
        reason = self._robot.go2.last_outcome.reason
        recorded = self._robot.truth.recording()
        room = self._room if said else -self._room
        missed = self._missed(call, said, recorded, 1.0 + room)
        rests = call.name in ("stop", *GOALS) and (call.is_watched or not said)
        if rests and missed is None and not has_ended:
            missed = self._moves()
        if said and missed:
            self.found["untrue-true"].append(f"{call}: {missed}")
        if not (said or missed or has_ended):
            self.found["untrue-false"].append(f"{call}: {reason}")

    def _look(self) -> None:
        """Once a tick."""
        self._watch.look()
        plant, truth = self._robot.plant, self._robot.truth
        if self._goal_row < 0 and not self._robot.go2.command.is_zero:
            self._goal_row = max(0, round((plant.time - truth.start) / plant.control_period) - 2)
        self._second.look(plant.time)
        if plant.time - truth.start > HANGS:
            raise _Hangs

    # --- what is missing, or None -----------------------------------------------------------------

    def _missed(self, call: Call, said: bool, recorded: TruthRecording, room: float) -> str | None:
        now = recorded.since(recorded.time[-1] - MOMENT)
        if call.name in ("stand", "recover") or (call.name == "walk" and not said):
            return self._stands(now, room)
        if call.name == "sit":
            pitch, feet = float(now.rpy[-1, 1]), now.p_world_feet[-1, 2:, 2].mean()
            rear = now.q[-1, 2] - REAR_END * math.sin(pitch) - feet
            if pitch > SIT_PITCH or rear + FOOT_RADIUS > SIT_REAR_HEIGHT:
                return f"pitch {math.degrees(pitch):.0f} deg, rear end at {rear:.2f} m"
            return _unrest(now, room)
        if call.name == "lie_down":
            is_down = now.q[-1, 2] - now.p_world_feet[-1, :, 2].min() + FOOT_RADIUS < LYING_HEIGHT
            return None if is_down and _tilt(now) < 0.5 else "does not lie"
        if call.name in GOALS:
            return self._goes(call, recorded, room)
        if call.name == "high_five":
            return _raised(call, recorded) or self._stands(now, room)
        if call.name == "play":
            return self._plays(call, room) or self._stands(now, room)
        if call.name == "walk" and self._robot.go2.mode is not Mode.WALKING:
            return "does not walk"
        return None if call.name == "wait" else self._robot.truth.fall()

    def _stands(self, now: TruthRecording, room: float) -> str | None:
        model = RobotModel()
        com = model.snapshot(self._robot.plant.truth()).p_world_com
        off = float(com[2] - now.p_world_feet[-1, :, 2].mean()) + FOOT_RADIUS - STAND_HEIGHT
        if abs(off) > HEIGHT * room:
            return f"CoM {1000.0 * off:.0f} mm from its height"
        if _tilt(now) > TILT * room:
            return f"tilt {math.degrees(_tilt(now)):.1f} deg"
        return _unrest(now, room)

    def _goes(self, call: Call, recorded: TruthRecording, room: float) -> str | None:
        """Against where it was when the goal began: when it was at rest, and told to go."""
        q, yaw = recorded.q[self._goal_row], recorded.rpy[self._goal_row, 2]
        turned = float(recorded.rpy[-1, 2] - yaw)
        x, y = (recorded.q[-1, :2] - q[:2]).tolist()
        ahead, left = math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x
        (asked,) = call.arguments
        if call.name == "move_forward":
            place = math.hypot(asked - ahead, left)
            is_met = place < PLACE * room and abs(turned) < HEADING * room
            return None if is_met else f"{1000 * place:.0f} mm, {math.degrees(turned):.2f} deg off"
        off = math.degrees(turned - (asked if call.name == "turn_left" else -asked))
        return None if abs(off) < math.degrees(TURN) * room else f"{off:.2f} deg off"

    def _plays(self, call: Call, room: float) -> str | None:
        """Against its plan, which begins where the feet stand: on the average, and at the end."""
        (name,), robot = call.arguments, self._robot
        recorded = during_motion(robot.go2, robot.truth, name)
        anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), FOOT_RADIUS)
        asked = placed(plan_of(name), recorded.time - recorded.time[0], anchor)
        trunk, turned = trunk_off(asked, recorded), turned_off(asked, recorded)
        touching = (recorded.trunk_force > TOUCH) | (recorded.limb_force > TOUCH)
        touched = float(touching.sum()) * robot.plant.control_period
        limits = (TRUNK_OFF, TRUNK_OFF, TURNED_OFF, TOUCHED)
        shares = np.array([trunk.mean(), trunk[-1], turned.mean(), touched]) / limits
        return None if shares.max() < room else f"shares of what is allowed {np.round(shares, 2)}"

    def _moves(self) -> str | None:
        """Watch the robot, which should rest."""
        self._robot.truth.clear()
        self._robot.go2.wait(WATCHED)
        speed = np.linalg.norm(self._robot.truth.recording().com_velocity, axis=1).max()
        return f"moves at {speed:.3f} m/s" if speed > AT_REST else None


class _Second:
    """A second thread's call."""

    def __init__(self, robot: TrialRobot, name: str, moment: float = 0.0) -> None:
        self._go2, self._name, self._moment = robot.go2, name, moment
        self._raised: BaseException | None = None
        self._thread = threading.Thread(target=self._call, daemon=True)
        self.has_begun = False

    def _call(self) -> None:
        try:
            getattr(self._go2, self._name)()
        except BaseException as error:
            self._raised = error

    def look(self, now: float) -> None:
        """Begin when its moment has come."""
        if self._name and not self.has_begun and now >= self._moment:
            self.has_begun = True
            self._thread.start()
            self._thread.join(0.005)  # all but damp() end in this tick

    def ended(self) -> str:
        """What was wrong with it, when the first call is over."""
        if not self.has_begun:
            return ""
        self._thread.join(HANGS)
        raised, must = self._raised, self._name == "stand"
        if self._thread.is_alive():
            return f"{self._name} in the second thread hangs"
        is_refused = isinstance(raised, ModeError) and self._name in ("stand", "move")
        if is_refused or (raised is None and not must):
            return ""
        return f"{self._name} in the second thread: {raised!r}"


def _made(go2: GO2Controller, call: Call) -> bool | None:
    """What the call says; None if it says nothing."""
    if call.name == "play" and not call.is_wrong:
        return go2.play(plan_of(call.arguments[0]), check=False)
    if call.name in ("stop", "wait"):
        last = go2.last_outcome
        getattr(go2, call.name)(*call.arguments)
        return None if go2.last_outcome is last else go2.last_outcome.ok
    said = getattr(go2, call.name)(*call.arguments)
    return said if isinstance(said, bool) else None


def _errors(call: Call, mode: Mode) -> tuple[bool, tuple[type[Exception], ...]]:
    """Whether there must be an error, and of which kinds, by the documentation."""
    if call.is_wrong:
        return True, (CommandError, ModeError) if mode is Mode.FALLEN else (CommandError,)
    if mode is Mode.FALLEN and call.name not in FREE:
        return True, (ModeError,)
    if call.name == "move" and mode is not Mode.WALKING:
        return True, (ModeError,)
    if call.name == "play" and mode not in (Mode.STANDING, Mode.WALKING):
        return mode is not Mode.MOVING, (StanceMismatch,)
    return False, ()


def _tilt(now: TruthRecording) -> float:
    return float(np.abs(now.rpy[:, :2]).max())


def _unrest(now: TruthRecording, room: float) -> str | None:
    """Why a posture is not at rest on four feet."""
    base, joints = np.abs(now.v[:, :3]).max() / STILL, np.abs(now.v[:, 6:]).max() / JOINTS_STILL
    if max(base, joints) > room:
        return f"base {base:.2f}, joints {joints:.2f} of the speed of what is still"
    return None if now.foot_forces[-1].min() > TOUCH else "a foot is in the air"


def _raised(call: Call, recorded: TruthRecording) -> str | None:
    """The paw above the shoulder, on three feet, for as long as was asked."""
    side, hold = call.arguments
    paw, ticks = SIDES[side], round(0.95 * hold / float(np.diff(recorded.time[-2:])[0]))
    others = [leg for leg in LEGS if leg is not paw]
    shoulder = recorded.q[:, 2] - SHOULDER * np.sin(recorded.rpy[:, 1])
    is_up = recorded.p_world_feet[:, paw, 2] - shoulder > OVER_SHOULDER
    is_up &= (recorded.foot_forces[:, others] > TOUCH).all(axis=1)
    up = longest_run(is_up)
    return None if up.stop - up.start >= ticks else "paw not held over its shoulder on three feet"


ROWS = (
    ("untrue-true", "untrue True", "<= 0"),
    ("untrue-false", "untrue False", "<= 0"),
    ("falls", "falls", "<= 0"),
    ("errors", "undocumented exceptions", "<= 0"),
    ("hangs", "calls that hang", "<= 0"),
)


def measure_sequence(
    trial: Trial, found: TrialResult, world: World, first_seed: int = FIRST_SEED
) -> None:
    """Make the calls of a seed."""
    seed = first_seed + trial.seed
    rng = np.random.default_rng((seed, WORLDS.index(world)))
    calls: list[Call] = []
    with TrialRobot(world.plant(seed)) as robot:
        judge = Judge(robot, world.room)
        with suppress(_Hangs):
            while len(calls) < CALLS:
                calls.append(drawn(rng, robot.go2.mode, world.gaits))
                judge.make(calls[-1])
    found.values |= {name: float(len(wrong)) for name, wrong in judge.found.items()}
    found.failures |= {name: "; ".join(wrong) for name, wrong in judge.found.items() if wrong}
    found.notes["calls"] = " | ".join(map(str, calls))


STUDIES = tuple(
    Study(world.name, {f"{CALLS} calls, {world.item}": ROWS}, measure, sensors=None)
    for world in WORLDS
    for measure in (partial(measure_sequence, world=world),)
)
run = Benchmark(
    "sequences",
    "Random calls in a row, in four worlds: does every answer hold in truth?",
    STUDIES,
    takes="five minutes",
    examples=("--seeds 250", "--rows late --seeds 50"),
).run
