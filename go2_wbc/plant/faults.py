"""Faults of a simulated robot, at a time that a test chooses.

    plant.fault("motor", part="FL_calf_joint", at=3.0)
    plant.fault("foot_force", part="RR_foot", value=40.0)

The kinds are in ``FaultKind``. Faults of sensors are put into the readings, before the estimator
gets them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, final

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.sensor_watch import SensorWatch
from go2_wbc.robot.state import RobotState, SensorReading

AXES = ("x", "y", "z")
HELD_TIME = 0.3  #: Time [s] for which a foot is held


class FaultKind(StrEnum):
    """What can break; the value of each is said in brackets."""

    MOTOR = "motor"  #: A joint's motor gives a share of its torque [0: it is dead]
    ENCODER = "encoder"  #: A joint's encoder reads so much more than there is [0.1 rad]
    ENCODER_STUCK = "encoder_stuck"  #: A joint's encoder reads for ever what it read last
    FOOT_FORCE = "foot_force"  #: A foot's sensor reads this [0 N: it is dead]
    GYRO = "gyro"  #: The gyro reads so much more about an axis, x unless said [0.5 rad/s]
    ACCELEROMETER = "accelerometer"  #: The accelerometer, the same [1 m/s^2]
    FOOT_HELD = "foot_held"
    """A foot is held where it is for ``HELD_TIME``, by so much force at the most [200 N]."""
    NOT_A_NUMBER = "not_a_number"
    """A joint's angle, a foot's force, or an axis of the gyro, is nan in one reading."""
    LOST_PACKETS = "lost_packets"  #: This share of the states does not arrive [0.05]


_JOINTS: Mapping[str, int] = {name: index for index, name in enumerate(JOINT_NAMES)}
_FEET: Mapping[str, int] = {name: index for index, name in enumerate(FOOT_NAMES)}
_AXES: Mapping[str, int] = {name: index for index, name in enumerate(AXES)}
_NOTHING: Mapping[str, int] = {"": 0}
_PARTS: Mapping[FaultKind, Mapping[str, int]] = {
    FaultKind.MOTOR: _JOINTS,
    FaultKind.ENCODER: _JOINTS,
    FaultKind.ENCODER_STUCK: _JOINTS,
    FaultKind.FOOT_FORCE: _FEET,
    FaultKind.GYRO: _AXES,
    FaultKind.ACCELEROMETER: _AXES,
    FaultKind.FOOT_HELD: _FEET,
    FaultKind.NOT_A_NUMBER: {**_JOINTS, **_FEET, **_AXES},
    FaultKind.LOST_PACKETS: _NOTHING,
}
_VALUES: Mapping[FaultKind, float] = {
    FaultKind.MOTOR: 0.0,
    FaultKind.ENCODER: 0.1,
    FaultKind.ENCODER_STUCK: 0.0,
    FaultKind.FOOT_FORCE: 0.0,
    FaultKind.GYRO: 0.5,
    FaultKind.ACCELEROMETER: 1.0,
    FaultKind.FOOT_HELD: 200.0,
    FaultKind.NOT_A_NUMBER: np.nan,
    FaultKind.LOST_PACKETS: 0.05,
}
_SHARES = (FaultKind.MOTOR, FaultKind.LOST_PACKETS)


@dataclass(frozen=True, slots=True)
class InjectedFault:
    """Something that breaks."""

    kind: FaultKind  #: how it breaks
    part: str  #: what breaks
    at: float  #: when [s]
    value: float  #: see ``FaultKind``

    @property
    def index(self) -> int:
        """Of the part among those of its sort."""
        return _PARTS[self.kind][self.part]

    @classmethod
    def of(cls, kind: str, part: str, at: float, value: float | None) -> InjectedFault:
        """A fault by its names.

        Raises:
            CommandError: for a kind or a part that does not exist, or a number that is none.
        """
        if kind not in list(FaultKind):
            raise CommandError(unknown_name("kind of fault", kind, [k.value for k in FaultKind]))
        sort = FaultKind(kind)
        if not part and sort in (FaultKind.GYRO, FaultKind.ACCELEROMETER):
            part = AXES[0]
        if part not in _PARTS[sort]:
            raise CommandError(unknown_name(f"part for {kind!r}", part, _PARTS[sort]))
        number = _VALUES[sort] if value is None else value
        if not np.isfinite(at) or not (np.isfinite(number) or value is None):
            raise CommandError(f"a fault needs finite numbers, got at={at!r}, value={value!r}")
        if sort in _SHARES and not 0.0 <= number <= 1.0:
            raise CommandError(f"the value of {kind!r} is a share, 0 to 1, got {value!r}")
        return cls(sort, part, at, number)


@final
class Faults:
    """What is broken on one robot, or will be.

    Attributes:
        known: all of them, in the order in which they were injected.
        watch: of sensors that no estimator reads.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self.watch: SensorWatch | None = None
        self.known: tuple[InjectedFault, ...] = ()
        self._last: SensorReading | None = None
        self._stuck: dict[InjectedFault, float] = {}  # angles [rad] of encoders that stick

    def torque_shares(self, time: float) -> Float[np.ndarray, "12"] | None:
        """Share of its torque that each motor gives at ``time``; None if all are sound."""
        broken = [f for f in self.known if f.kind is FaultKind.MOTOR and f.at <= time]
        if not broken:
            return None
        shares = np.ones(12)
        for fault in broken:
            shares[fault.index] = fault.value
        return shares

    def begun_holds(self, time: float, period: float) -> list[InjectedFault]:
        """The feet that are held from the tick of ``time`` on, of a plant with this period."""
        tick = round(time / period)
        held = (fault for fault in self.known if fault.kind is FaultKind.FOOT_HELD)
        return [fault for fault in held if math.ceil(fault.at / period - 1e-6) == tick]

    def loses(self, time: float, rng: np.random.Generator) -> bool:
        """Whether the state of ``time`` does not arrive."""
        lost = [f.value for f in self.known if f.kind is FaultKind.LOST_PACKETS and f.at <= time]
        return bool(lost) and rng.random() < max(lost)

    def broken(self, reading: SensorReading) -> SensorReading:
        """``reading`` as broken sensors give it; to be called once for each."""
        gyro, accelerometer = reading.gyro.copy(), reading.accelerometer.copy()
        q, v, forces = reading.q_joints.copy(), reading.v_joints.copy(), reading.foot_forces.copy()
        for fault in (fault for fault in self.known if fault.at <= reading.time):
            index = fault.index
            if fault.kind is FaultKind.ENCODER:
                q[index] += fault.value
            elif fault.kind is FaultKind.ENCODER_STUCK and self._last is not None:
                before = float(self._last.q_joints[index])
                angle = before if math.isfinite(before) else float(reading.q_joints[index])
                q[index], v[index] = self._stuck.setdefault(fault, angle), 0.0
            elif fault.kind is FaultKind.FOOT_FORCE:
                forces[index] = fault.value
            elif fault.kind is FaultKind.GYRO:
                gyro[index] += fault.value
            elif fault.kind is FaultKind.ACCELEROMETER:
                accelerometer[index] += fault.value
            elif fault.kind is FaultKind.NOT_A_NUMBER:
                read = q if fault.part in _JOINTS else forces if fault.part in _FEET else gyro
                read[index] = np.nan
                self.known = tuple(other for other in self.known if other is not fault)
        self._last = replace(
            reading,
            gyro=gyro,
            accelerometer=accelerometer,
            q_joints=q,
            v_joints=v,
            foot_forces=forces,
        )
        return self._last

    def save(self) -> Mapping[str, Any]:
        """All that is broken, and known of it."""
        watch = None if self.watch is None else self.watch.save()
        stuck = dict(self._stuck)
        return {"known": self.known, "last": self._last, "stuck": stuck, "watch": watch}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self.known, self._last = saved["known"], saved["last"]
        self._stuck = dict(saved["stuck"])
        if self.watch is not None:
            self.watch.restart()
            if saved["watch"] is not None:
                self.watch.restore(saved["watch"])

    def seen(self, state: RobotState, imu: ImuSample, threshold: float) -> RobotState:
        """``state`` with the joints, forces and rates of broken sensors, put right by the watch.

        For a robot that is told its state: a foot touches where it feels more than ``threshold``.
        """
        if self.watch is None:
            self.watch = SensorWatch(RobotModel(self._description))
        read = state.v[3:6], imu.accelerometer, state.joint_positions, state.joint_velocities
        reading = self.broken(SensorReading(state.time, *read, state.tau, state.foot_forces))
        reading = self.watch.checked(reading, state.q[3:7])
        q, v = state.q.copy(), state.v.copy()
        q[7:], v[3:6], v[6:] = reading.q_joints, reading.gyro, reading.v_joints
        forces = reading.foot_forces
        return replace(state, q=q, v=v, foot_forces=forces, feet_in_contact=forces > threshold)
