"""The whole-body QP: its decision vector, and the rows that tasks and constraints contribute.

    minimise    sum_i w_i |A_i z - b_i|^2            (tasks)
    subject to  E z = e                              (dynamics of the base, stance feet still)
                lower <= C z <= upper                (friction, normal force, torque, joint limits)

This is inverse dynamics as one weighted QP (Abe, da Silva & Popovic, SCA 2007; de Lasa, Mordatch &
Hertzmann, SIGGRAPH 2010). Torques are no unknowns: they follow from z by the joint rows of the
equations of motion (Herzog et al., Auton. Robots 40, 2016); see ``constraints.torque_map``.

The decision vector z (30,) holds the generalised acceleration (18,: Pinocchio's spatial base
acceleration in the base frame, then the joints) and the contact force of each foot in the world
frame (4 x 3). The force of a foot in swing is no unknown: back ends leave its columns out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import ResidualRow
from go2_wbc.records import Array30
from go2_wbc.reference import Reference
from go2_wbc.robot.state import Snapshot

ACCELERATION = slice(0, 18)
"""a in z: m/s^2 and rad/s^2 of the base in its own frame, then rad/s^2 of the joints."""
FORCES = slice(18, 30)  #: f in z: N in the world frame, foot by foot
SIZE = 30
T = TypeVar("T")


class Rows(NamedTuple):
    """Linear rows A z = b, (k, 30) and (k,)."""

    A: Float[np.ndarray, "k 30"]
    b: Float[np.ndarray, " k"]


class Bounds(NamedTuple):
    """Linear rows lower <= C z <= upper, (k, 30) and (k,) each; infinite where one-sided."""

    C: Float[np.ndarray, "k 30"]
    lower: Float[np.ndarray, " k"]
    upper: Float[np.ndarray, " k"]


class Source:
    """A task or a constraint: what a residual table calls it, and the unit of its rows."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Problem:
    """One assembled QP."""

    snapshot: Snapshot  #: what the rows were made from
    reference: Reference  #: what the rows were made from
    tasks: Rows  #: stacked task rows, not weighted
    weights: Float[np.ndarray, " rows"]  #: (rows,) the weight of each
    equalities: Rows  #: stacked rows of equalities
    bounds: Bounds  #: stacked rows of inequalities
    sources: tuple[Source, ...]  #: who contributed rows, tasks first, then equalities, then bounds
    counts: tuple[int, ...]  #: how many rows each of them contributed

    @property
    def stance(self) -> Bool[np.ndarray, "4"]:
        """Feet whose force is an unknown."""
        return self.reference.stance

    def source(self, kind: type[T]) -> T:
        """The task or constraint of a class."""
        return next(source for source in self.sources if isinstance(source, kind))

    def residuals(self, z: Array30) -> tuple[ResidualRow, ...]:
        """How far ``z`` is from every task, and by how much it breaks every constraint."""
        value = self.bounds.C @ z
        excess = np.maximum(np.maximum(self.bounds.lower - value, value - self.bounds.upper), 0.0)
        errors = np.concatenate(
            [self.tasks.A @ z - self.tasks.b, self.equalities.A @ z - self.equalities.b, excess]
        )
        pieces = np.split(np.abs(errors), np.cumsum(self.counts)[:-1])
        return tuple(
            ResidualRow(source.name, float(piece.max(initial=0.0)), source.unit)
            for source, piece in zip(self.sources, pieces, strict=True)
        )
