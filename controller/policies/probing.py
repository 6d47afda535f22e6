"""The probe: a second of simulation per trial tells if a policy's sidecar is right, or what is not.

A policy was trained until it walked well with the correct sidecar. So of all possible sidecars the
correct one is that with which it walks best: follows the command, level and without bouncing. The
probe lets the policy take over from a trot for a second, with its sidecar and with one change at a
time: another order of the joints, inverted signs, a scale or a gain times a factor. Each run begins
in the same state, and has the score (lower is better)

    |v - v_des| / 0.1 + |w_z - w_des| / 0.2             mean velocity [m/s], turning rate [rad/s]
    + rms w_xy / 0.3 + rms v_z / 0.1 + rms tilt / 0.05  [rad/s], [m/s], [rad]

over its last two thirds, and 10 or more if it falls. If one change has by far the best score, what
it changes is wrong in the sidecar.

The probe does not find errors in values that the policy hardly uses (half the joint velocities are
enough for the clone), two errors at once, default poses, clips, history, and clocks half a stride
off.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from controller.observation import STANCE, STANCE_HEIGHT
from controller.policies.cloning import Teacher
from controller.policies.policy import Player, Policy
from controller.policies.sidecar import Sidecar
from go2_wbc.brief import brief
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.plant import SavedPhysics
from go2_wbc.robot.model import RobotModel

SECOND = 1.0
COMMAND = VelocityCommand(0.5, 0.1, 0.3)  #: Or what of it the policy was trained on
LEAD = 1.44  #: Time [s] of the trot before: four strides
FALLEN, LOW = 0.7, 0.17  #: Tilt [rad] and height [m] at which a run ends
UNITS = np.array([0.1, 0.1, 0.2, 0.1, 0.3, 0.05])
"""Of a mark: velocity ahead and aside [m/s], turning [rad/s], bouncing [m/s], rolling and pitching
[rad/s], tilt [rad]."""
FALL = 10.0  #: Mark of a fall at the end of the second; twice that for one at once
FACTORS = (0.1, 0.16, 0.25, 0.4, 0.63, 1.6, 2.5, 4.0, 6.3, 10.0)
FINER = (0.8, 0.9, 1.12, 1.25)  #: What is tried around the best factor
CLEAR = 1.65
"""By how many times the mark must be better with something changed, for it to be named. Of a right
sidecar of a policy that nobody trained it was 1.53; of 70 wrong ones of the clone 1.70 and more."""


@dataclass(frozen=True, slots=True)
class Change:
    """A sidecar in which one thing is changed."""

    key: str  #: of what is, in the file
    told: str  #: how it then reads
    sidecar: Sidecar  #: with the change
    factor: float = 0.0  #: of a number that is multiplied, else 0

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Finding:
    """What the probe makes of a sidecar."""

    mark: float  #: of the run as the sidecar says; smaller is better
    best: float  #: of the run that was best
    change: Change | None  #: what is then changed; None if nothing is found to be wrong

    __repr__ = brief

    def __bool__(self) -> bool:
        """Whether nothing is found to be wrong: it walks, and nothing changed makes it better."""
        return self.change is None and self.mark < FALL

    def __str__(self) -> str:
        """In plain words."""
        if self.change is None and not self:
            return "it falls, whatever one thing is changed: more is wrong, or it cannot walk"
        if self.change is None:
            return f"nothing wrong is seen (mark {self.mark:.2g})"
        return (
            f"{self.change.key} is wrong: it walks far better with {self.change.told} "
            f"(mark {self.best:.2g}, and {self.mark:.2g} as it is)"
        )


def probe(policy: Policy) -> Finding:
    """What is wrong with the sidecar of ``policy``, if anything; takes about ten seconds.

    Only of a Go2's.
    """
    track = Track(policy.sidecar)
    given = track.mark(policy)

    def marked(change: Change) -> float:
        return track.mark(Policy(policy.name, change.sidecar, policy.network))

    marks = [(marked(change), change) for change in changes(policy.sidecar)]
    mark, best = min(marks, key=lambda item: item[0])
    if best.factor:
        finer = [scaled(policy.sidecar, best.key, best.factor * factor) for factor in FINER]
        mark, best = min([(mark, best), *((marked(f), f) for f in finer)], key=lambda item: item[0])
    is_clear = given > CLEAR * mark and mark < FALL
    return Finding(given, min(given, mark), best if is_clear else None)


class Track:
    """A simulated trot that policies take over, always in the same state."""

    def __init__(self, sidecar: Sidecar) -> None:
        """Trot by a command that ``sidecar`` permits."""
        self._model, self._plant = RobotModel(), MujocoPlant()
        self._command = sidecar.commands.clip(COMMAND)
        plant = self._plant
        plant.place(np.array([0.0, 0.0, STANCE_HEIGHT, 0.0, 0.0, 0.0, 1.0, *STANCE * 4]))
        teacher = Teacher(self._model, plant.read())
        while plant.time < LEAD:
            plant.write(teacher.ask(plant.read(), self._command))
        self._phase = teacher.phase
        self._start: SavedPhysics = plant.save()

    def mark(self, policy: Policy) -> float:
        """How badly it walks."""
        plant, asked = self._plant, self._command
        plant.restore(self._start)
        player = Player(policy, self._model.q_lower, self._model.q_upper)
        player.restart(self._phase)
        start, rows = plant.time, []
        while (time := plant.time - start) < SECOND:
            state = plant.read()
            plant.write(player.command(state, asked))
            rows.append([*state.v[:6], state.R_world_base[2] @ state.v[:3], state.tilt])
            if state.tilt > FALLEN or state.q[2] < LOW:
                return FALL * (2.0 - time / SECOND)
        last = np.array(rows[len(rows) // 3 :])
        mean, square = last.mean(axis=0), np.sqrt((last**2).mean(axis=0))
        off = [
            mean[0] - asked.linear_x,
            mean[1] - asked.linear_y,
            mean[5] - asked.angular_z,
            square[6],
            np.hypot(square[3], square[4]),
            square[7],
        ]
        return float(np.abs(off / UNITS).sum())


def changes(side: Sidecar) -> Iterator[Change]:
    """Every sidecar that could be meant instead.

    Of gravity also that of length 1, which it has in most: a clone fell that was told 3 % more.
    """
    yield from _orders(side)
    yield from _signs(side)
    scales = [f"scale of {term.name}" for term in side.terms]
    for key in ("action.scale", "action.kp", "action.kd", *scales):
        for factor in FACTORS:
            yield scaled(side, key, factor)
    for key in ("action.scale", *scales):
        if "clock" not in key:
            yield scaled(side, key, -1.0)
    for term in side.terms:
        if term.name == "gravity" and term.scale[0] != 1.0:
            yield scaled(side, "scale of gravity", 1.0 / float(term.scale[0]))


def _orders(side: Sidecar) -> Iterator[Change]:
    """Leg by leg, or kind by kind of joint, with the legs in any order."""
    for legs in permutations(range(4)):
        numbers = 3 * np.array(legs)[:, None] + np.arange(3)
        for order, told in ((numbers.ravel(), "leg by leg"), (numbers.T.ravel(), "kind by kind")):
            if (order != side.order).any():
                names = ", ".join(LEGS[leg].name for leg in legs)
                yield Change("joints.order", f"{names}, {told}", replace(side, order=order))


def _signs(side: Sidecar) -> Iterator[Change]:
    """Turned: a joint, a kind of joint, also of one side or end only, or all of them."""
    kinds = np.arange(12) % 3
    legs = {"": (0, 1, 2, 3), "left ": (0, 2), "right ": (1, 3), "front ": (0, 1), "rear ": (2, 3)}
    groups = {"all joints": np.ones(12, dtype=bool)}
    for i, kind in enumerate(("hips", "thighs", "calves")):
        for where, which in legs.items():
            groups[f"{where}{kind}"] = (kinds == i) & np.isin(np.arange(12) // 3, which)
    for i, name in enumerate(JOINT_NAMES):
        groups[name] = np.arange(12) == i
    for name, group in groups.items():
        signs = np.where(group[side.order], -side.signs, side.signs)
        yield Change("joints.signs", f"{name} turned", replace(side, signs=signs))


def scaled(side: Sidecar, key: str, factor: float) -> Change:
    """With the numbers of a ``key`` times a ``factor``."""
    told = f"{factor:.2g} times that"
    name = key.removeprefix("action.")
    if name != key:
        name = {"scale": "action_scale"}.get(name, name)
        return Change(key, told, replace(side, **{name: factor * getattr(side, name)}), factor)
    terms = tuple(
        replace(term, scale=factor * term.scale) if key == f"scale of {term.name}" else term
        for term in side.terms
    )
    return Change(key, told, replace(side, terms=terms), factor)
