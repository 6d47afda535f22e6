"""Ticks in which one limit is in the way, and which: it was put there.

Each begins with a tick in which no limit binds, and tightens one limit, or asks one thing too much,
until the QP saturates or has no solution. The cause is known from what was changed.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.reference import LegTask, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from tests.engine_helpers import FOUR_FEET, MODES, THREE_FEET, random_reference, random_state

JOINT_WORDS = [name.removesuffix("_joint") for name in JOINT_NAMES]
MODEL = RobotModel()
PLAIN = WholeBodyController(MODEL)
STANDING = tuple(mode for mode in MODES if mode.count(LegTask.STANCE) > 1)
LIVELY = 2.0  #: Scale [m/s^2] of the accelerations that are asked for
Tick = tuple[Snapshot, Reference]


@dataclass(frozen=True)
class Situation:
    """A tick, who solves it, and which names of a limit say what was done to it."""

    wbc: WholeBodyController
    snapshot: Snapshot
    reference: Reference
    causes: tuple[str, ...]

    def is_tight(self) -> bool:
        """Whether a limit is in the way at all."""
        try:
            return bool(np.any(self.wbc.solve(self.snapshot, self.reference).multipliers.row))
        except QpInfeasible:
            return True


def free_ticks(rng: np.random.Generator, modes: tuple[tuple[LegTask, ...], ...]) -> Iterator[Tick]:
    """Random ticks in which no limit binds and the feet that stand are at rest."""
    while True:
        state, legs = random_state(rng), modes[rng.integers(len(modes))]
        v, J = state.v.copy(), MODEL.snapshot(state).J_contacts
        for leg in (leg for leg in LEGS if legs[leg] is LegTask.STANCE):
            v[leg.velocities] = np.linalg.solve(J[leg][:, leg.velocities], -J[leg][:, :6] @ v[:6])
        snapshot = MODEL.snapshot(replace(state, v=v))
        reference = random_reference(snapshot, legs, LIVELY, rng)
        reference = replace(
            reference, normal_force_min=np.full(4, 5.0), normal_force_max=np.full(4, 250.0)
        )
        if not Situation(PLAIN, snapshot, reference, ()).is_tight():
            yield snapshot, reference


def weak_motor(rng: np.random.Generator) -> Iterator[Situation]:
    """A motor gives a part of what is needed of it."""
    for snapshot, reference in free_ticks(rng, STANDING):
        tau = np.abs(PLAIN.solve(snapshot, reference).tau)
        joint = int(rng.choice(np.flatnonzero(tau > 0.5 * np.median(tau))))
        peak, model = MODEL.motor.peak.copy(), RobotModel()
        peak[joint] = rng.uniform(0.2, 0.7) * tau[joint]
        model.motor = MODEL.motor.with_peak(peak)
        causes = (f"torque limit of {JOINT_WORDS[joint]}",)
        yield Situation(WholeBodyController(model), snapshot, reference, causes)


def pressed(rng: np.random.Generator) -> Iterator[Situation]:
    """A motor gives a part of what the least forces need, which are most of what the feet bear."""
    for snapshot, reference in free_ticks(rng, STANDING):
        solution = PLAIN.solve(snapshot, reference)
        tau, least = np.abs(solution.tau), np.maximum(0.8 * solution.forces[:, 2], 0.0)
        bearing = np.repeat(reference.stance, 3) & (tau > 0.5 * np.median(tau))
        joint = int(rng.choice(np.flatnonzero(bearing)))
        peak, model = MODEL.motor.peak.copy(), RobotModel()
        peak[joint] = rng.uniform(0.05, 0.3) * tau[joint]
        model.motor = MODEL.motor.with_peak(peak)
        changed = replace(reference, normal_force_min=least)
        causes = (f"torque limit of {JOINT_WORDS[joint]}",)
        yield Situation(WholeBodyController(model), snapshot, changed, causes)


def slippery(rng: np.random.Generator) -> Iterator[Situation]:
    """The floor gives a part of the friction that is used."""
    for snapshot, reference in free_ticks(rng, STANDING):
        f = PLAIN.solve(snapshot, reference).forces[reference.stance]
        used = float((np.abs(f[:, :2]).max(axis=1) / f[:, 2]).max())
        if used > 0.1:
            config = WbcConfig(friction=max(rng.uniform(0.3, 0.7) * used, 0.051))
            causes = tuple(f"friction of {LEGS[leg].name}" for leg in range(4))
            yield Situation(WholeBodyController(MODEL, config=config), snapshot, reference, causes)


def force_cap(rng: np.random.Generator) -> Iterator[Situation]:
    """A foot may bear a part of its load."""
    for snapshot, reference in free_ticks(rng, STANDING):
        f = PLAIN.solve(snapshot, reference).forces[:, 2]
        leg, most = int(rng.choice(np.flatnonzero(f > 15.0))), reference.normal_force_max.copy()
        most[leg] = rng.uniform(0.2, 0.8) * f[leg]
        causes = (f"greatest normal force of {LEGS[leg].name}",)
        yield Situation(PLAIN, snapshot, replace(reference, normal_force_max=most), causes)


def least_force(rng: np.random.Generator) -> Iterator[Situation]:
    """A foot shall bear more than it does, up to what no leg can."""
    for snapshot, reference in free_ticks(rng, STANDING):
        f = PLAIN.solve(snapshot, reference).forces[:, 2]
        leg, least = int(rng.choice(np.flatnonzero(f > 15.0))), reference.normal_force_min.copy()
        least[leg] = rng.choice([1.5 * f[leg], 200.0, 700.0])
        most = np.maximum(reference.normal_force_max, 1000.0)
        causes = (f"least normal force of {LEGS[leg].name}",)
        changed = replace(reference, normal_force_min=least, normal_force_max=most)
        yield Situation(PLAIN, snapshot, changed, causes)


def crossed(rng: np.random.Generator) -> Iterator[Situation]:
    """A foot's least force lies above its greatest."""
    for snapshot, reference in free_ticks(rng, STANDING):
        leg = int(rng.choice(np.flatnonzero(reference.stance)))
        least, most = reference.normal_force_min.copy(), reference.normal_force_max.copy()
        least[leg], most[leg] = 60.0, 40.0
        changed = replace(reference, normal_force_min=least, normal_force_max=most)
        foot = LEGS[leg].name
        causes = (f"least normal force of {foot}", f"greatest normal force of {foot}")
        yield Situation(PLAIN, snapshot, changed, causes)


def slow_joint(rng: np.random.Generator) -> Iterator[Situation]:
    """A joint of a raised leg may turn more slowly than it is to."""
    for snapshot, reference in free_ticks(rng, THREE_FEET):
        raised = np.flatnonzero(~reference.stance)[0]
        joint, model = 3 * int(raised) + int(rng.integers(3)), RobotModel()
        v = snapshot.state.joint_velocities + 0.02 * PLAIN.solve(snapshot, reference).qdd[6:]
        model.speed_limits[joint] = rng.uniform(0.3, 0.7) * abs(v[joint])
        causes = (f"speed limit of {JOINT_WORDS[joint]}", f"braking of {JOINT_WORDS[joint]}")
        yield Situation(WholeBodyController(model), snapshot, reference, causes)


def end_of_joint(rng: np.random.Generator) -> Iterator[Situation]:
    """A joint, of any leg, comes to an end that lies nearer than usual."""
    for snapshot, reference in free_ticks(rng, STANDING):
        joint, model = int(rng.integers(12)), RobotModel()
        v, q = snapshot.state.joint_velocities, snapshot.state.joint_positions
        room = v[joint] ** 2 / 400.0 * rng.uniform(0.0, 1.0)
        if v[joint] > 0:
            model.q_upper[joint] = q[joint] + room
        else:
            model.q_lower[joint] = q[joint] - room
        word = JOINT_WORDS[joint]
        causes = (f"position limit of {word}", f"braking of {word}")
        yield Situation(WholeBodyController(model), snapshot, reference, causes)


def contact_in_the_air(rng: np.random.Generator) -> Iterator[Situation]:
    """A foot shall stand that flies."""
    for snapshot, reference in free_ticks(rng, THREE_FEET):
        leg = int(np.flatnonzero(~reference.stance)[0])
        state, joints = snapshot.state, slice(6 + 3 * leg, 9 + 3 * leg)
        v, J = state.v.copy(), snapshot.J_contacts[leg]
        direction = rng.normal(size=3)
        wanted = rng.uniform(4.0, 10.0) * direction / np.linalg.norm(direction)
        v[joints] = np.linalg.solve(J[:, joints], wanted - J[:, :6] @ v[:6])
        if (np.abs(v[joints]) > 0.8 * MODEL.speed_limits[:3]).any():
            continue
        flying = MODEL.snapshot(replace(state, v=v))
        changed = replace(reference, legs=FOUR_FEET)
        yield Situation(PLAIN, flying, changed, (f"contact of {LEGS[leg].name}",))


KINDS: tuple[Callable[[np.random.Generator], Iterator[Situation]], ...] = (
    *(weak_motor, pressed, slippery, force_cap, least_force, crossed),
    *(slow_joint, end_of_joint, contact_in_the_air),
)


def situations(kind: Callable[..., Iterator[Situation]], count: int, seed: int) -> list[Situation]:
    """``count`` of a kind that are tight."""
    found = list[Situation]()
    for situation in kind(np.random.default_rng(seed)):
        if situation.is_tight():
            found.append(situation)
        if len(found) == count:
            break
    return found
