"""Playing a plan where the robot stands: placed in the world, corrected, and compared.

``Playback`` is what the robot plays with, a kernel; ``ReadablePlayback`` says the same in Python.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import acos

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import CORRECTION, PLAYBACK, REFERENCE
from go2_wbc.planning.correction import CorrectionConfig, SteadyStateCorrection, tracked_position
from go2_wbc.reference import Anchor, LegTask, Reference
from go2_wbc.robot.rotations import log_rotation
from go2_wbc.robot.snapshot import Snapshot

_SAG, _LEAN = PLAYBACK.start["sag"], PLAYBACK.start["lean"]


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
    def follow(self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, dt: float) -> Reference:
        """The reference in the world.

        Args:
            plan: row of the plan's reference, in the motion's frame (``MotionPlan.row_at``).
            snapshot: of this tick.
            dt: seconds since the last tick.
        """

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

    def __init__(self, anchor: Anchor, config: CorrectionConfig | None = None) -> None:
        """Follow a plan at ``anchor``, without correction at first."""
        from go2_wbc.kernels.playing import follow

        config = config or CorrectionConfig()
        self._follow = follow
        self._anchor = np.array([*anchor.p_world, anchor.yaw])
        self._correction = CORRECTION.pack([config.rate, config.window, config.limit])
        self._state = np.zeros(PLAYBACK.size)

    def follow(self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, dt: float) -> Reference:
        """See ``PlanFollower.follow``."""
        row = np.empty(REFERENCE.size)
        self._follow(plan, snapshot.row, self._anchor, dt, self._correction, self._state, row)
        return Reference.of_row(row)

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

    def __init__(self, anchor: Anchor, config: CorrectionConfig | None = None) -> None:
        """Follow a plan at ``anchor``, without correction at first."""
        self._anchor = anchor
        self._correction = SteadyStateCorrection(config)
        self._places: list[float] = []
        self._attitudes: list[float] = []
        self._joints: list[float] = []
        self._sag_and_lean = 0.0, 0.0

    def follow(self, plan: Float[np.ndarray, " size"], snapshot: Snapshot, dt: float) -> Reference:
        """See ``PlanFollower.follow``."""
        reference = Reference.of_row(plan).placed(self._anchor)
        self._note(reference, snapshot)
        body = self._correction.corrected(reference.body, snapshot, dt)
        return replace(reference, body=body)

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
