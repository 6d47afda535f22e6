"""Telemetry: every tick recorded in a ring, peaks over the whole run, and the ground as seen."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import inline_html
from go2_wbc.errors import CommandError
from go2_wbc.geometry import moving_support_margins
from go2_wbc.planning.height_map import CELL, HeightMap, cells, heights_at
from go2_wbc.recording import Recording
from go2_wbc.records import Array3, ArrayNx3, Record, layout_of, packed
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import note_peaks
from go2_wbc.robot.rigid_body import NO_PAYLOAD
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import LARGEST, is_finite_number
from go2_wbc.wbc.constraints import Multipliers
from go2_wbc.wbc.controller import WbcSolution

BLOCK = 4096
"""Ticks whose memory is asked for at once, 2.4 MB: numpy wants huge pages for 4 MB and more, and
the first touch of one of these cost 5.6 ms of a tick (seen on a virtual machine)."""
KEPT_WAY, KEPT_MAPS = 1.0, 60
"""Way [m] after which the map of the ground is kept, before it is overwritten, and of how many such
ways."""


class Tick(Record):
    """What is kept of a tick, as in ``Recording``."""

    time: float
    q: Float[np.ndarray, "19"]
    v: Float[np.ndarray, "18"]
    tau: Float[np.ndarray, "12"]
    forces: Float[np.ndarray, "4"]
    stance: Float[np.ndarray, "4"]
    com: Float[np.ndarray, "3"]
    feet: Float[np.ndarray, "12"]


class Noted(Record):
    """What is kept of the whole-body QP of a tick beside it, where that is asked for."""

    multipliers: Multipliers
    gave_way: bool
    time: float


_TICK = layout_of(Tick)
_TIME = _TICK.fields["time"].start
_Q, _V, _TAU, _FORCES, _STANCE, _COM, _FEET = map(_TICK.slice, Tick.part_names()[1:])
_NOTED = layout_of(Noted)
_MULTIPLIERS = _NOTED.slice("multipliers")
_GAVE_WAY, _NOTED_AT = (_NOTED.fields[name].start for name in ("gave_way", "time"))


class Telemetry:
    """Records ticks; the oldest are dropped when the ring buffer is full.

    Attributes:
        qp_failures: ticks in which the QP had no solution, over the whole run.
        relaxed_ticks: ticks in which the QP was relaxed.
        grave_ticks: those of them with a violation beyond ``wbc.solvers.LIMITS``.
        payload: the estimated payload.
        missed_deadlines: ticks that were not done when the next was due, at the wall clock's pace.
        explains: whether the multipliers of the whole-body QP are recorded, too; may be set at any
            time.
    """

    def __init__(self, model: RobotModel, capacity: int) -> None:
        """Args: capacity: number of ticks that the ring holds."""
        self._model = model
        self._capacity = capacity
        self._blocks: list[Float[np.ndarray, "k size"]] = []
        self._labels = np.empty(capacity, dtype=object)
        self._count, self.explains = 0, False
        self._noted: dict[int, Float[np.ndarray, "k noted"]] = {}
        self._motor, self._peaks = packed(model.motor), np.zeros((3, 12))
        self._v_before: Float[np.ndarray, "12"] | None = None
        self._heights, self._kept_at = HeightMap(), np.full(3, np.inf)
        self._grounds: deque[ArrayNx3] = deque(maxlen=KEPT_MAPS)
        self.payload = NO_PAYLOAD
        self.qp_failures = self.relaxed_ticks = self.grave_ticks = self.missed_deadlines = 0

    def __repr__(self) -> str:
        return f"<Telemetry: {self._count} ticks, {self.relaxed_ticks} relaxed>"

    def record(self, snapshot: Snapshot, stance: Bool[np.ndarray, "4"], label: str) -> None:
        """Add one tick."""
        i, state = self._count % self._capacity, snapshot.state
        block, place = divmod(i, BLOCK)
        if block == len(self._blocks):
            self._blocks.append(np.empty((min(BLOCK, self._capacity - i), _TICK.size)))
        row = self._blocks[block][place]
        row[_TIME], row[_Q], row[_V], row[_TAU] = state.time, state.q, state.v, state.tau
        row[_FORCES], row[_STANCE] = state.foot_forces, stance
        row[_COM], row[_FEET] = snapshot.p_world_com, snapshot.p_world_feet.ravel()
        self._labels[i] = label
        self._count += 1
        v = state.joint_velocities
        before = v if self._v_before is None else self._v_before
        note_peaks(state.tau, v, before, self._motor, self._peaks)
        self._v_before = v.copy()  # a plant may reuse its arrays

    def note(self, solution: WbcSolution | None) -> None:
        """Add the multipliers of the tick that was recorded last; None if it had no solution."""
        block, place = divmod((self._count - 1) % self._capacity, BLOCK)
        rows = self._noted.get(block)
        if rows is None:
            rows = np.full((len(self._blocks[block]), _NOTED.size), np.nan)
            self._noted[block] = rows
        row = rows[place]
        row[_MULTIPLIERS] = np.nan if solution is None else solution.multipliers.row
        row[_GAVE_WAY] = solution is not None and solution.is_relaxed
        row[_NOTED_AT] = self._blocks[block][place, _TIME]

    def see(self, heights: HeightMap, p_world_base: Array3) -> None:
        """Note what the ground is like around the robot."""
        self._heights = heights
        if not math.dist(p_world_base, self._kept_at) < KEPT_WAY:
            self._grounds.append(cells(heights))
            self._kept_at = p_world_base

    @property
    def peak_torque_ratio(self) -> float:
        """Greatest |tau| / limit of any joint so far."""
        return float(np.max(self._peaks[0] / self._model.torque_limits))

    @property
    def peak_motor_ratio(self) -> float:
        """Greatest |tau| of any joint so far, over what its motor gives at its speed.

        That is the speed in the tick before the torque was measured, from which on it acted; what
        is available counts as at least ``robot.motor.LEAST_SHARE`` of the peak.
        """
        return float(np.max(self._peaks[2]))

    @property
    def peak_speed_ratio(self) -> float:
        """Greatest |joint velocity| / limit of any joint so far."""
        return float(np.max(self._peaks[1] / self._model.speed_limits))

    def samples(self, rate: float = 100.0, since: float = -math.inf) -> Samples:
        """What the ring holds from ``since`` [s] on, thinned to about ``rate`` samples a second.

        Raises:
            CommandError: if ``rate`` is not a positive number.
        """
        if not (is_finite_number(rate) and 0.0 < float(rate) <= LARGEST):
            raise CommandError(f"rate must be positive, got {rate!r:.80}")
        order = np.arange(max(0, self._count - self._capacity), self._count)
        rows = order % self._capacity
        times = self._taken(rows, slice(0, 1))[:, 0]
        first = np.searchsorted(times, since)
        rows, times = rows[first:], times[first:]
        noted = self._strongest(rows, times, step := _step(times, rate))
        rows = rows[::step]
        labels = tuple(str(label) for label in self._labels[rows])
        taken = self._taken(rows, slice(None))
        recording = Recording(
            time=taken[:, _TIME],
            q=taken[:, _Q],
            v=taken[:, _V],
            tau=taken[:, _TAU],
            foot_forces=taken[:, _FORCES],
            stance=taken[:, _STANCE] > 0.0,
            p_world_com=taken[:, _COM],
            support_margin=np.full(len(rows), np.nan),
            labels=labels,
            robot=self._model.description.profile.name,
            **noted,
        )
        grounds = (cells(self._heights), *reversed(self._grounds))
        return Samples(recording, taken[:, _FEET].reshape(-1, 4, 3), grounds)

    def _strongest(
        self, rows: Int[np.ndarray, " n"], times: Float[np.ndarray, " n"], step: int
    ) -> dict[str, Any]:
        """What was noted of every ``step`` ticks: a limit that binds in one of them is not lost."""
        if not (self._noted and len(rows)):
            return {}
        noted = np.full((len(rows), _NOTED.size), np.nan)
        blocks, places = np.divmod(rows, BLOCK)
        for block, kept in self._noted.items():
            noted[blocks == block] = kept[places[blocks == block]]
        noted[noted[:, _NOTED_AT] != times] = np.nan  # of a tick that was overwritten
        starts = range(0, len(rows), step)
        least, most = np.fmin.reduceat(noted, starts), np.fmax.reduceat(noted, starts)
        strongest = np.where(-least > most, least, most)
        gave_way = strongest[:, _GAVE_WAY] > 0.0
        return {"multipliers": strongest[:, _MULTIPLIERS], "gave_way": gave_way}

    def _taken(self, rows: Int[np.ndarray, " n"], columns: slice) -> Float[np.ndarray, "n k"]:
        blocks, places = np.divmod(rows, BLOCK)
        taken = np.empty((len(rows), _TICK.size))[:, columns]
        for block in np.unique(blocks):
            taken[blocks == block] = self._blocks[block][places[blocks == block], columns]
        return taken


def _step(times: Float[np.ndarray, " n"], rate: float) -> int:
    """Of how many ticks one is taken for about ``rate`` samples a second."""
    if len(times) < 2:
        return 1
    return max(1, round((len(times) - 1) / max(rate * float(times[-1] - times[0]), 1.0)))


@dataclass(frozen=True, slots=True)
class Samples:
    """Copied ticks whose support margins are still to be computed, away from the control loop."""

    unfinished: Recording  #: the recording, its support margins nan
    p_world_feet: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) foot centres [m]
    grounds: tuple[Float[np.ndarray, "_ 3"], ...]
    """Cells of ground that were seen, the newest map first."""

    def recording(self) -> Recording:
        """The finished recording."""
        stance, p_com = self.unfinished.stance, self.unfinished.p_world_com[:, :2]
        margins = np.full(len(stance), np.nan)
        for feet in (mode for mode in np.unique(stance, axis=0) if mode.sum() >= 3):
            rows = (stance == feet).all(axis=1)
            p_feet = self.p_world_feet[rows][:, feet, :2]
            margins[rows] = moving_support_margins(p_feet, p_com[rows])
        ground = np.concatenate(self.grounds)
        _, newest = np.unique(np.floor(ground[:, :2] / CELL), axis=0, return_index=True)
        return replace(self.unfinished, support_margin=margins, ground=ground[newest])


@final
class SeenTerrain:
    """Heights of the ground in the world of ``go2.state``, in cells of 2.5 cm, 4 m around.

    Attributes:
        blocked: what the robot has stopped in front of, in plain words; "" if its way is free.
    """

    _repr_html_ = inline_html

    def __init__(self, heights: HeightMap, blocked: str) -> None:
        """Look at ``heights``, which change as the robot walks on."""
        self._heights, self.blocked = heights, blocked

    @typed(error=CommandError)
    def height(self, x: float, y: float) -> float:
        """Of the ground at a place [m]; nan where nothing has been seen."""
        z = np.empty(1)
        heights_at(self._heights, np.array([[x, y]], dtype=float), z)
        return float(z[0])

    def points(self) -> Float[np.ndarray, "n 3"]:
        """Middles of all cells that have been seen [m]."""
        return cells(self._heights)

    def __repr__(self) -> str:
        z = self.points()[:, 2]
        way = f"blocked: {self.blocked}" if self.blocked else "way free"
        if not len(z):
            return f"<SeenTerrain: nothing seen, {way}>"
        area = len(z) * CELL**2
        return f"<SeenTerrain: {area:.1f} m^2, {z.min():.2f} to {z.max():.2f} m, {way}>"
