"""A motion, ready to be played: what motions are compiled to, and what a robot plays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.contacts import ContactSchedule
from go2_wbc.legs import Leg
from go2_wbc.reference import Reference


class Posture(Enum):
    """Resting postures between which motions lead."""

    LIE = "lie"
    SIT = "sit"
    STAND = "stand"


Stance = Posture  #: The former name of ``Posture``, kept for scripts that use it


@dataclass(frozen=True, slots=True)
class Footsteps:
    """What is known of a plan whose feet step to places, so that they can land when they do."""

    contacts: ContactSchedule  #: who stands when
    swings: Bool[np.ndarray, "m 4"]
    """(m, 4) at each event of ``contacts``, the feet in the air that follow their places."""
    unloads: Float[np.ndarray, "m 4"]
    """(m, 4) when [s] each foot that stands lifts off next, if it gives up its load before that;
    inf if it pushes off."""
    ramp: float
    """Time [s] over which a foot takes up its load after touchdown and gives it up before
    lift-off."""
    normal_force_min: float  #: least normal force [N] of a stance foot
    normal_force_max: float  #: greatest normal force [N] of a stance foot


@dataclass(frozen=True, slots=True)
class PlanFeedback:
    """How a solved plan brings the robot back to its state, at one instant."""

    q: Float[np.ndarray, "19"]  #: planned configuration, in the motion's frame
    v: Float[np.ndarray, "18"]  #: planned velocity, in the motion's frame
    gains: Float[np.ndarray, "12 36"]
    """Feedback of the state's error (as Pinocchio's ``difference`` of planned and measured q, then
    of v) into torques: tau - gains @ error [N m]."""


@dataclass(frozen=True, slots=True)
class HeldFoot:
    """A foot that must be held up."""

    name: str  #: of the span
    leg: Leg  #: whose foot
    start: float  #: from when on [s]
    end: float  #: until when [s]
    height: float  #: planned for its centre above the ground [m]


class MotionPlan(ABC):
    """A motion, ready to be played: a reference for every instant, in the motion's own frame.

    Attributes:
        name: what users call it.
        entry, exit: stances in which it starts and ends.
        duration: [s].
    """

    name: str
    entry: Posture
    exit: Posture
    duration: float

    @property
    def is_dynamic(self) -> bool:
        """Whether there are phases that fewer than three feet carry: flight, or two feet.

        Such a motion cannot be stopped in the middle, and is refused on hardware unless allowed.
        """
        return False

    @abstractmethod
    def at(self, t: float) -> Reference:
        """The reference ``t`` seconds after the start; the ends are held outside [0, duration]."""

    def row_at(self, t: float) -> Float[np.ndarray, " size"]:
        """The numbers of ``at(t)`` in one row; a plan that can fill it by a kernel does so."""
        return self.at(t).row

    @property
    def has_dynamic_spans(self) -> bool:
        """Whether some of it is solved by the whole robot's dynamics."""
        return False

    def feedback_at(self, t: float) -> PlanFeedback | None:
        """The feedback ``t`` seconds after the start; None where it was not solved for two feet."""
        del t
        return None

    @property
    def footsteps(self) -> Footsteps | None:
        """How its feet step; None if none does: each comes down where it stood."""
        return None

    @property
    def held_feet(self) -> tuple[HeldFoot, ...]:
        """Its acceptance: feet that must be measured at their heights, for it to count as done."""
        return ()
