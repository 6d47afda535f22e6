"""Checks of dynamic spans: by their own dynamics, at their own knots.

Support polygon and zero-moment point do not apply in flight or on one or two feet, and a spline
across a change of contacts would imply forces that do not exist. Here the plan must obey the
equations of motion, M a + h = S' tau + J' f, step by step, with forces that the ground can give,
independently of what the solver reports. Angles, speeds, torques, heights and collisions of the
spans are checked with those of the rest of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from go2_wbc.recording import true_runs
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from motions.dynamics.dynamic_trajectory import BALANCING_FEET, centred, feet_at
from motions.dynamics.plan_audit import defects, drift
from motions.feasibility.forces import FEET, JOINTS, PRESSED, Case, Forces
from motions.feasibility.goal_errors import Misses, misses_of
from motions.feasibility.report import Series
from motions.plan.compiled_plan import LEAST_FEET, CompiledPlan, DynamicSpan
from motions.plan.trajectory import Trajectory

_ROWS = (*(f"trunk {axis}" for axis in ("x", "y", "z", "roll", "pitch", "yaw")), *JOINTS)
_Columns = Float[np.ndarray, "n k"]
NEAR = 0.8  #: Share of a tolerance from which on a warning is due: own choice
STEP = 1e-3  #: Greatest difference [m, rad] of a state from where the speeds lead
DEFECT = 0.5  #: Greatest remainder [N, N m] of the equations of motion: 0.3 % of the weight
CURVE = 0.03  #: Greatest distance [m, rad] of the curves that are played from the states
PULL = 1.0  #: Greatest force [N] that a foot would need without ground
FRICTION_SHARE = 1.1
"""What solved plans may use of the floor's friction: they are solved for 0.5, and reach 0.55."""
SLIP = 0.02  #: Distance [m] that a standing foot may move, and be off the ground
TOUCHDOWN = 1.0  #: Greatest speed [m/s] of a foot that comes down
SETTLING = 0.3
"""Time [s] on three feet or four in which the trunk comes to its plan, before there are two."""
FEW_FEET = 0.7
"""Longest time [s] on two feet without that: of pairs lifted at once, 0.86 s were done, 40 mm off,
and 0.96 s were not."""
UNLIKE = 0.22
"""Greatest share by which the mass may differ from that it was solved for: with 2 kg, 0.13, a rear
is still done, with 4 kg it falls. Of 14 jumps and lifts of the train half that differ by 0.15 to
0.23 all were done, from 0.24 on half of six."""


def with_spans(forces: Forces, path: Trajectory, plan: CompiledPlan, model: RobotModel) -> Forces:
    """``forces`` along ``path`` with the plan's own where it is dynamic."""
    contact, tau, missing = forces.contact.copy(), forces.tau.copy(), forces.missing.copy()
    v = path.v[:, 6:].copy()
    for span in plan.dynamic:
        rows = (path.times >= span.start) & (path.times < span.end)
        if not rows.any():
            continue
        found = span.at(path.times[rows], model)
        contact[rows], tau[rows], missing[rows] = found.forces, found.tau, 0.0
        v[rows] = found.v_motors
    return replace(forces, contact=contact, tau=tau, missing=missing, v_motors=v)


def judged(plan: CompiledPlan, case: Case) -> list[Series]:
    """All checks of the dynamic spans of ``plan``; causes before what follows from them."""
    judges = [_Judge(span, plan, case) for span in plan.dynamic]
    kinds: Sequence[Callable[[_Judge], Series]] = (
        _Judge.load, _Judge.steps, _Judge.equations, _Judge.curves, _Judge.contact_force,
        _Judge.cone, _Judge.standing, _Judge.balance, _Judge.touchdown, _Judge.place, _Judge.turn,
    )  # fmt: skip
    return [_joined([kind(judge) for judge in judges]) for kind in kinds]


def _joined(parts: Sequence[Series]) -> Series:
    """One check of several spans."""
    tables = ("times", "values", "limits", "margins")
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in tables}
    return replace(parts[0], **whole)


class _Judge:
    """Judges one span of a plan."""

    def __init__(self, span: DynamicSpan, whole: CompiledPlan, case: Case) -> None:
        self._span, self._whole, self._case = span, whole, case
        self._plan, self._model = span.trajectory, case.model
        self._places, speeds = feet_at(self._plan.q, self._plan.v, case.model)
        self._speeds = np.linalg.norm(speeds, axis=2)

    def load(self) -> Series:
        """Share by which the mass differs from that it was solved for: push-off does not know."""
        share = abs(self._case.heavy.mass / self._model.mass - 1.0)
        off = np.full((len(self._plan.times), 1), share)
        return self._at_knots("mass solved for", "", ("trunk",), off, UNLIKE)

    def steps(self) -> Series:
        """Each state must follow from the one before by its speed: m, rad."""
        plan, pin_model = self._plan, self._model.pin_model
        off = np.zeros((len(plan.times), 3))
        for row, dt in enumerate(np.diff(plan.times).tolist()):
            there = pin.integrate(pin_model, plan.q[row], dt * plan.v[row + 1])
            miss = np.abs(pin.difference(pin_model, there, plan.q[row + 1]))
            off[row + 1] = np.maximum.reduceat(miss, (0, 3, 6))
        subjects = ("trunk", "trunk turning", "joints")
        return self._at_knots("steps", "m, rad", subjects, off, STEP)

    def equations(self) -> Series:
        """What is left of the equations of motion at every knot: N, N m."""
        off = defects(self._plan, self._model)
        return self._at_knots("equations", "N, N m", _ROWS, off, DEFECT)

    def curves(self) -> Series:
        """How far the curves that are played are from the span's states: m, rad."""
        plan, model = self._plan, self._model
        q = centred(plan, model)
        values = self._whole.curves(np.minimum(self._span.start + plan.times, self._whole.duration))
        com = np.array([model.center_of_mass(row) for row in q])
        R = [pin.Quaternion(row[3:7]).toRotationMatrix() for row in q]
        turns = [
            np.abs(log_rotation(rotation_from_rpy(*rpy).T @ own)).max()
            for rpy, own in zip(values[:, 3:6].tolist(), R, strict=True)
        ]
        off = np.column_stack(
            [
                np.abs(values[:, :3] - com).max(axis=1),
                turns,
                np.abs(values[:, 6:18] - q[:, 7:]).max(axis=1),
            ]
        )
        subjects = ("CoM", "trunk turning", "joints")
        return self._at_knots("curves", "m, rad", subjects, off, CURVE)

    def contact_force(self) -> Series:
        """The ground does not pull, and gives nothing to a foot in the air: N."""
        plan = self._plan
        pull = np.where(plan.stance, -plan.forces[:, :, 2], np.linalg.norm(plan.forces, axis=2))
        return self._at_knots("ground pulls", "N", FEET, pull, PULL)

    def cone(self) -> Series:
        """Tangential over normal force of the feet that press."""
        forces = self._plan.forces
        normal = forces[:, :, 2]
        pressed = normal > PRESSED
        ratio = np.linalg.norm(forces[:, :, :2], axis=2) / np.where(pressed, normal, 1.0)
        most = FRICTION_SHARE * self._case.world.friction
        return self._at_knots("friction cone", "", FEET, ratio, most, pressed)

    def standing(self) -> Series:
        """How far a standing foot is from where it came down, and from the ground: m."""
        places, stance = self._places, self._plan.stance
        height = np.zeros((len(places), 4))
        height[1:] = stance * np.abs(places[1:, :, 2] - self._model.foot_radius)
        off = np.maximum(drift(places, stance), height)
        return self._at_knots("standing feet", "m", FEET, off, SLIP)

    def balance(self) -> Series:
        """Time on two feet or one that were not stood for long enough before: s.

        A robot stands some millimetres off its plan. On three feet or four it is brought to it; on
        two that grows like a fall, exp(t / sqrt(0.29 m / g)).
        """
        contacts = self._whole.contacts
        feet, events = contacts.modes.sum(axis=1), np.append(contacts.times, np.inf)
        times = self._span.start + self._plan.times
        since = np.zeros((len(times), 1))
        for few in true_runs((feet > 0) & (feet <= BALANCING_FEET)):
            start, end = few.start, few.stop
            first = max([row for row in range(start) if feet[row] < LEAST_FEET], default=-1) + 1
            if events[start] - events[first] < SETTLING:
                inside = (times >= events[start]) & (times < events[end])
                since[inside, 0] = times[inside] - events[start]
        return self._at_knots("few feet", "s", ("trunk",), since, FEW_FEET)

    def touchdown(self) -> Series:
        """Speed of the feet when they come down: m/s."""
        stance, lands = self._plan.stance, np.zeros(self._speeds.shape, dtype=bool)
        lands[1:-1] = stance[1:] & ~stance[:-1]
        return self._at_knots("touchdown", "m/s", FEET, self._speeds, TOUCHDOWN, lands)

    def place(self) -> Series:
        """Distance from what was asked at the ends of phases: mm."""
        tolerance = 1e3 * self._span.tolerance.position
        return self._asked("off by", "mm", tolerance, 1e3 * self._misses().away)

    def turn(self) -> Series:
        """Angle between the trunk and what was asked, whole turns counted: deg."""
        tolerance = float(np.degrees(self._span.tolerance.angle))
        return self._asked("turned off by", "deg", tolerance, np.degrees(self._misses().turned))

    def _asked(self, check: str, unit: str, tolerance: float, values: _Columns) -> Series:
        where, times = ~np.isnan(values), self._span.start + self._misses().times
        what = (check, unit, ("trunk", *FEET), np.nan_to_num(values), tolerance)
        return self._case.series(*what, where=where, tight=(1.0 - NEAR) * tolerance, times=times)

    def _misses(self) -> Misses:
        return misses_of(self._span, self._places, self._model)

    def _at_knots(
        self, check: str, unit: str, subjects: tuple[str, ...], values: _Columns, limit: float,
        where: Bool[np.ndarray, "n k"] | bool = True,
    ) -> Series:  # fmt: skip
        times = self._span.start + self._plan.times[: len(values)]
        return self._case.series(check, unit, subjects, values, limit, where=where, times=times)
