"""Random calls under random pushes: does the mode say in time that the robot has fallen?

A row of ``python -m benchmarks balance``. A run makes ``CALLS`` random calls; after every fall the
robot is told to ``recover``, under pushes as well, and goes on. Half of the pushes go through the
middle of the trunk on the level, the others lift or press a hip or the trunk, which tips over also
a robot that lies.

A fall is, in truth, the trunk of a robot that had risen on the ground for ``STUMBLE``, or a tilt of
60 deg; it counts where the mode said until then that the robot was well. The delay is to the mode.
"""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.robots import PUSH_TIME, UNTOLD, heading_force, plant_of
from benchmarks.study import Study, TrialResult
from controller.modes import Mode
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.errors import ModeError
from go2_wbc.plant.mujoco.ground_truth import FALLEN_TILT, TOUCH

FIRST_SEED = 104000
"""Seed of the first trial that is judged; causes were looked for on 64000 to 64999 and 84000 to
84999."""
CALLS = 5
CALLED = ("stand", "sit", "lie_down", "high_five", "walk", "walk", "play", "turn", "recover")
MOTIONS = ("bow", "wave", "push_ups", "march", "rear_up", "jump_up", "bunny_hops")
RECOVERIES = 3  #: How often in a row the robot may try to get up under pushes
HARDEST = 90.0  # Greatest impulse [N s] of a push on the level
LIFTING = (-0.5, 1.0)
"""Range of the upward impulse of the others, over their greatest one on the level."""
PUSHED = ("base", "FL_hip", "FR_hip", "RL_hip", "RR_hip")
PAUSE = (1.0, 6.0)  # Range of the time [s] between two pushes
RISEN = 0.2
"""Height [m] of the base over the lowest foot from which on a trunk has left the ground."""
LEAST_FEET, STOOD = 2, 0.2
"""Feet on the ground and time [s] by which it has not just been lifted by a push."""
STUMBLE = 0.05  #: Time [s] for which a trunk may touch the ground without having fallen
NOTICED = 0.2  # Time [s] in which a fall must be noticed
DOWN = (Mode.FALLEN, Mode.DAMPED)


@dataclass(frozen=True, slots=True)
class Fall:
    """One fall."""

    time: float  #: of the fall in truth, or of the mode that said so before [s]
    delay: float  #: from the fall to the mode that says so [s]; infinite if none did
    mode: Mode  #: what the robot was said to do
    call: str  #: what it was asked to do

    def __str__(self) -> str:
        """In one line, for the notes."""
        return f"{self.call} ({self.mode.value}) at {self.time:.2f} s: {self.delay:.3f} s"


class Watch:
    """Pushes at random moments, and compares what the mode says with the truth, every tick.

    Attributes:
        falls: those that are over: the mode has said so.
        call: what the robot is asked to do.
        may_lie: whether it was told to lie down.
    """

    def __init__(self, robot: TrialRobot, rng: np.random.Generator | None) -> None:
        """Watch ``robot``, whose plant calls ``look``; without ``rng`` nobody pushes."""
        self._robot, self._rng = robot, rng
        self._next = math.inf if rng is None else float(rng.uniform(*PAUSE))
        self._touches_since = self._fell = math.inf
        self._said = self._fell_as = robot.go2.mode
        self._stands_since = math.inf
        self._has_risen = False
        self.falls: list[Fall] = []
        self.call, self.may_lie = "", False

    @property
    def all_falls(self) -> list[Fall]:
        """The falls, and one that was not noticed until now."""
        if math.isinf(self._fell):
            return self.falls
        return [*self.falls, Fall(self._fell, math.inf, self._fell_as, self.call)]

    def look(self) -> None:
        """Once a tick."""
        mode, now = self._robot.go2.mode, self._robot.plant.time
        if self._rng is not None and now >= self._next:
            self._push(now, self._rng)
        if mode not in DOWN:
            self._judge(mode, now)
        else:
            if (mode is Mode.FALLEN or math.isfinite(self._fell)) and self._said not in DOWN:
                fell = min(self._fell, now)
                before = self._said if math.isinf(self._fell) else self._fell_as
                self.falls.append(Fall(fell, now - fell, before, self.call))
            self._touches_since = self._fell = self._stands_since = math.inf
            self._has_risen = False
        self._said = mode

    def _push(self, now: float, rng: np.random.Generator) -> None:
        plant = self._robot.plant
        angle, impulse = rng.uniform((0.0, 0.0), (2.0 * math.pi, HARDEST)).tolist()
        force, where = heading_force(angle, impulse), "base"
        if rng.random() < 0.5:
            force[2] = rng.uniform(*LIFTING) * HARDEST / PUSH_TIME
            where = str(rng.choice(PUSHED))
        plant.push(force, PUSH_TIME, where)
        self._next = now + float(rng.uniform(*PAUSE))

    def _judge(self, mode: Mode, now: float) -> None:
        plant = self._robot.plant
        state = plant.truth()
        touches = plant.base_contact_force > TOUCH
        height = float(state.q[2] - plant.p_world_feet[:, 2].min())
        stands = height > RISEN and not touches and state.feet_in_contact.sum() >= LEAST_FEET
        self._stands_since = min(self._stands_since, now) if stands else math.inf
        has_stood = now - self._stands_since > STOOD
        has_risen = mode.is_upright and not self.may_lie
        self._has_risen = has_risen and (self._has_risen or has_stood)
        is_down = self._has_risen and touches
        self._touches_since = min(self._touches_since, now) if is_down else math.inf
        lies = now - self._touches_since > STUMBLE
        if math.isinf(self._fell) and (lies or state.tilt > FALLEN_TILT):
            self._fell, self._fell_as = (self._touches_since if lies else now), mode


def measure_disturbed(trial: Trial, found: TrialResult) -> None:
    """Call at random, push at random, and let the robot recover from every fall."""
    rng = np.random.default_rng(FIRST_SEED + trial.seed)
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        watch = Watch(robot, rng)
        robot.truth.on_tick = watch.look
        for _ in range(CALLS):
            make(robot, watch, str(rng.choice(CALLED)), rng)
            for _ in range(RECOVERIES):
                if robot.go2.mode not in DOWN:
                    break
                make(robot, watch, "recover", rng)
        robot.go2.wait(1.0)
        if len(watch.all_falls) > len(watch.falls):  # it fell just now: it may yet be noticed
            robot.go2.wait(2.0 * NOTICED)
        falls = watch.all_falls  # what comes now is the end
    longest = max((fall.delay for fall in falls), default=0.0)
    found.values = {"delay": longest, "falls": float(len(falls))}
    found.notes["falls"] = "; ".join(map(str, falls))
    if longest > NOTICED:
        found.failures["delay"] = "; ".join(str(f) for f in falls if f.delay > NOTICED)


def make(robot: TrialRobot, watch: Watch, what: str, rng: np.random.Generator) -> None:
    """One call that may end in a fall, and time after it."""
    go2 = robot.go2
    watch.may_lie, watch.call = what == "lie_down", what
    try:
        if what == "walk":
            gait = str(rng.choice([*GAITS, "auto"]))
            watch.call = f"walk {gait}"
            go2.walk(gait)
            x, turn, y = rng.uniform((-1.0, -1.5, -0.5), (1.5, 1.5, 0.5)).tolist()
            go2.move(x, turn, linear_y=y)
        elif what == "play":
            watch.call = motion = str(rng.choice(MOTIONS))
            if go2.stand():
                go2.play(motion, check=False)
        elif what == "turn":
            go2.turn_left(float(rng.uniform(-1.5, 1.5)))
        else:
            getattr(go2, what)()
        go2.wait(float(rng.uniform(0.2, 1.5)))
    except ModeError:  # it fell in between, and says so
        return


ROWS = (("delay", "longest delay of notice", f"<= {NOTICED:g} s"), ("falls", "falls", ""))
STUDY = Study("disturbed", {"random calls and pushes": ROWS}, measure_disturbed, seed_factor=50)
