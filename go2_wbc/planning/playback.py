"""Playing a plan where the robot stands: placed in the world, corrected, and compared.

``Playback`` is what the robot plays with, a kernel; ``ReadablePlayback`` says the same in Python.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import acos
from typing import Any

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import CORRECTION, LANDING, PLAYBACK, REFERENCE
from go2_wbc.planning.correction import CorrectionConfig, SteadyStateCorrection, tracked_position
from go2_wbc.planning.landing import Landings, ReadableLanding, landing_numbers
from go2_wbc.reference import Anchor, Footsteps, LegTask, Reference
from go2_wbc.robot.rotations import log_rotation
from go2_wbc.robot.snapshot import Snapshot

_SAG, _LEAN = PLAYBACK.start["sag"], PLAYBACK.start["lean"]
_MISSED, _ERROR = PLAYBACK.start["missed"], PLAYBACK.start["landing_error"]


@dataclass(frozen=True, slots=True)
class Deviation:
    """How far a robot has been off its plan, on the average over the ticks so far.

    Attributes:
        place: of the tracked point [m].
        attitude: angle of the trunk [rad].
        joints: angle [rad] of the worst joint of a raised leg, over the ticks that had one.
    """

    place: float
    attitude: float
    joints: float


class PlanFollower(ABC):
    """Turns a plan's references, one a tick, into what is tracked in the world."""

    @abstractmethod
    def follow(
        self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, t: float, dt: float
    ) -> Reference:
        """The reference in the world.

        Args:
            plan: row of the plan's reference, in the motion's frame (``MotionPlan.row_at``).
            snapshot: of this tick.
            t: seconds from the plan's start at which it stands there.
            dt: seconds since the last tick.
        """

    @property
    @abstractmethod
    def anchor(self) -> Anchor:
        """Where the plan is now: landings move it."""

    @property
    @abstractmethod
    def landings(self) -> Landings:
        """What came of the landings of feet that step."""

    @property
    @abstractmethod
    def deviation(self) -> Deviation:
        """How far the robot has been off the plan, the correction left out."""

    @property
    @abstractmethod
    def sag_and_lean(self) -> tuple[float, float]:
        """Now: depth [m] of the tracked point below the plan, and angle [rad] of the verticals."""


class Playback(PlanFollower):
    """Follows a plan by the compiled kernel."""

    def __init__(
        self,
        anchor: Anchor,
        footsteps: Footsteps | None = None,
        config: CorrectionConfig | None = None,
    ) -> None:
        """Follow a plan at ``anchor``, without correction at first."""
        from go2_wbc.kernels.playing import follow, follow_steps

        config = config or CorrectionConfig()
        self._follow, self._follow_steps = follow, follow_steps
        self._steps = None if footsteps is None else _tables(footsteps)
        self._correction = CORRECTION.pack(
            [config.rate, config.window, config.limit, config.handed_over]
        )
        self._contact = np.zeros(4)
        self._state = np.zeros(PLAYBACK.size)
        for name in ("anchor", "origin"):
            PLAYBACK.view(self._state, name)[:] = [*anchor.p_world, anchor.yaw]
        PLAYBACK.view(self._state, "touchdown")[:] = -np.inf

    def follow(
        self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, t: float, dt: float
    ) -> Reference:
        """See ``PlanFollower.follow``."""
        row = np.zeros(REFERENCE.size)
        steps, correction, state = self._steps, self._correction, self._state
        if steps is None:
            self._follow(plan, snapshot.row, dt, correction, state, row)
        else:
            contact = self._contact
            contact[:] = snapshot.state.feet_in_contact
            self._follow_steps(plan, snapshot.row, t, dt, contact, *steps, correction, state, row)
        return Reference.of_row(row)

    @property
    def anchor(self) -> Anchor:
        """See ``PlanFollower.anchor``."""
        x, y, z, yaw = PLAYBACK.view(self._state, "anchor").tolist()
        return Anchor(np.array([x, y, z]), yaw)

    @property
    def landings(self) -> Landings:
        """See ``PlanFollower.landings``."""
        return Landings(int(self._state[_MISSED]), float(self._state[_ERROR]))

    @property
    def deviation(self) -> Deviation:
        """See ``PlanFollower.deviation``."""
        _, place, attitude, joints, *_ = PLAYBACK.views(self._state)
        return Deviation(float(place), float(attitude), float(joints))

    @property
    def sag_and_lean(self) -> tuple[float, float]:
        """See ``PlanFollower.sag_and_lean``."""
        return float(self._state[_SAG]), float(self._state[_LEAN])


class ReadablePlayback(PlanFollower):
    """The same as ``Playback``, step by step."""

    def __init__(
        self,
        anchor: Anchor,
        footsteps: Footsteps | None = None,
        config: CorrectionConfig | None = None,
    ) -> None:
        """Follow a plan at ``anchor``, without correction at first."""
        self._anchor = anchor
        self._landing = None if footsteps is None else ReadableLanding(anchor, footsteps)
        self._correction = SteadyStateCorrection(config)
        self._places: list[float] = []
        self._attitudes: list[float] = []
        self._joints: list[float] = []
        self._sag_and_lean = 0.0, 0.0

    def follow(
        self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, t: float, dt: float
    ) -> Reference:
        """See ``PlanFollower.follow``."""
        reference = Reference.of_row(plan)
        if self._landing is None:
            reference = reference.placed(self._anchor)
        else:
            reference = self._landing.landed(reference, snapshot, t)
        self._note(reference, snapshot)
        counts = dt if reference.stance.any() else 0.0  # nothing can be corrected in flight
        body = self._correction.corrected(reference.body, snapshot, counts)
        return replace(reference, body=body)

    @property
    def anchor(self) -> Anchor:
        """See ``PlanFollower.anchor``."""
        return self._anchor if self._landing is None else self._landing.anchor

    @property
    def landings(self) -> Landings:
        """See ``PlanFollower.landings``."""
        return Landings(0, 0.0) if self._landing is None else self._landing.landings

    def _note(self, reference: Reference, snapshot: Snapshot) -> None:
        body = reference.body
        place = np.linalg.norm(body.p_world - tracked_position(snapshot, body.point))
        turn = log_rotation(body.R_world_base @ snapshot.R_world_base.T)
        sag = (body.p_world - tracked_position(snapshot, body.point))[2]
        between_verticals = float(body.R_world_base[2] @ snapshot.R_world_base[2])
        self._sag_and_lean = float(sag), acos(min(max(between_verticals, -1.0), 1.0))
        self._places.append(float(place))
        self._attitudes.append(float(np.linalg.norm(turn)))
        raised = np.repeat([task is LegTask.JOINTS for task in reference.legs], 3)
        if raised.any():
            off = np.abs(reference.q_joints - snapshot.state.joint_positions)[raised]
            self._joints.append(float(off.max()))

    @property
    def deviation(self) -> Deviation:
        """See ``PlanFollower.deviation``."""
        means = [float(np.mean(off or [0.0])) for off in self._lists]
        return Deviation(*means)

    @property
    def sag_and_lean(self) -> tuple[float, float]:
        """See ``PlanFollower.sag_and_lean``."""
        return self._sag_and_lean

    @property
    def _lists(self) -> tuple[list[float], list[float], list[float]]:
        return self._places, self._attitudes, self._joints


_Tables = tuple[Any, Any, Any, Any, Any]


def _tables(footsteps: Footsteps) -> _Tables:
    contacts = footsteps.contacts
    events = np.array(contacts.times)
    numbers = LANDING.pack(landing_numbers(footsteps))
    return events, contacts.since, contacts.until, footsteps.unloads, numbers
