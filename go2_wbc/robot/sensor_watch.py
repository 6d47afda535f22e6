"""Which sensor is broken, by what the others say, and what it should have read.

Every reading passes here before the estimator. One that contradicts the others for a while is
named, and put right where they tell what it should have been. The residuals:

    encoder jumps    q - q_last - v dt                            the jump is taken off from then on
    encoder stuck    q and v stay while the leg's others turn     nothing replaces it
    foot's force     against f = -J^-T (tau - M dv/dt)            replaced by f
    gyro             d/dt (p_i - p_j) + w x (p_i - p_j) = 0 of    the error is taken off
                     feet that stand, least squares over time

with J and M of a leg alone, in the base frame, and p_i the point of a foot that touches: its centre
rolls by w_calf x (r e_z). Forces are judged while the legs carry the robot, the gyro by what its
error explains of the feet's residual: feet that slip do not turn together. A reading that is not a
number is taken for the one before. A healthy robot's readings leave as they came, to the bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.algebra.linear import cross, plus_scaled, put, triple
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.records import V3, Array3, Array3x3, Array4, Array12, Record, numbers_of, packed
from go2_wbc.robot.leg_kinematics import LegGeometry, Legs, leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import PartFault, SensorReading

JUMP = 0.05
"""rad; a joint's angle differs by less from what its speed says, however hard the foot lands."""
LONGEST_STEP, USUAL_STEP = 0.05, 0.002
"""Time [s] between two readings of one stretch, and that taken for the first one's."""
DOUBT = 0.01
"""Time [s] after which a joint that reads the very same says nothing of the IMU."""
STUCK_TIME, STUCK_TRAVEL = 0.1, 0.03
"""An encoder is stuck if it has read the very same for so long [s], while the other joints of its
leg have turned so far [rad]."""
SMOOTHING = 0.008
"""Time constant [s] of the joints' accelerations."""
LOADED, FREE = 20.0, 10.0
"""Force [N] by a leg's torques above which its foot stands, and below which it does not: of those
that swing in a trot 99 % seem to bear less than 7 N."""
UNFELT, SENSED = 3.0, 25.0
"""Force [N] below which a sensor says that the foot is free, and above which it says it stands."""
FORCE_TIME, SAME_TIME = 0.06, 0.25
"""Time [s] for which they contradict each other, and in which a living sensor changes."""
SETTLING = 0.08
"""Time constant [s] over which the gyro is judged."""
GYRO_LIMIT, GYRO_LASTS = 0.22, 0.07
"""Error of the gyro [rad/s] that is named, if it lasts so long [s]."""
SETTLING_AND_LASTING = SETTLING + GYRO_LASTS
"""How long [s] an error has been there when it is found, more or less."""
EXPLAINED = 0.8
"""Share of the feet's squared residual that an error of the gyro explains, if it is one. A foot
that slides off an edge and the one that stands with it seem to turn, too: with 0.3 a gyro was named
within 20 s in 6 of 7 walks over boxes of 8 cm, with this in none."""
CARRIED, UPRIGHT = 0.7, 0.85
"""Share of the robot's weight that its legs bear while it stands or walks, and the cosine of its
greatest tilt then: legs of one that lies or tumbles strike what they do not stand on."""
CALM = 0.05
"""Time [s] after which one that has come to its feet is judged by them."""
STANDING = np.tile([0.0, 0.8, -1.6], 4)
"""Joint angles [rad] of a robot that stands, roughly."""
UNSEEN = 0.5
"""m^2 that is added to what feet tell of each axis of the gyro's error, and draws it towards 0: two
feet tell nothing of a turn about the line between them. A pair adds 0.1 to 0.25 in each tick."""
FINER = 1.0 / 3.0
"""Share of the gyro's limit above which what is left of its error is taken off, too."""


class WatchedSensors(Record):
    """What is remembered from reading to reading.

    Attributes:
        has_begun: 1 once there has been one.
        q, v: the last angles [rad] and speeds [rad/s], as they were read.
        shift: what is taken off the angles [rad].
        dv: smoothed accelerations of the joints [rad/s^2].
        same: for how long a joint has read the very same [s].
        travel: how far the other joints of its leg have turned since [rad].
        force: the last of each foot [N], as it was read.
        force_same: for how long it has been the very same [s].
        against: for how long a foot's force has contradicted the leg's torques [s].
        stood: for how long its legs have carried it [s].
        turning, turned, residual: normal equations of the gyro's error, and the squared residual.
        gyro_off, gyro_time: the error that is taken off [rad/s], for how long there has been one.
        gyro, accelerometer: the last, as they were read.
        gyro_jump: the last error that was taken off [rad/s].
        tilt_is_off: 1 in the moment in which the gyro's error is taken off.
        stuck, force_is_wrong, gyro_is_off: 1 for what is broken.
        jumped: 1 for an encoder whose shift is not 0.
    """

    has_begun: float
    q: Array12
    v: Array12
    shift: Array12
    dv: Array12
    same: Array12
    travel: Array12
    force: Array4
    force_same: Array4
    against: Array4
    stood: float
    turning: Array3x3
    turned: Array3
    residual: float
    gyro_off: Array3
    gyro_time: float
    gyro: Array3
    accelerometer: Array3
    gyro_jump: Array3
    tilt_is_off: float
    stuck: Array12
    jumped: Array12
    force_is_wrong: Array4
    gyro_is_off: float


@dataclass(frozen=True, slots=True)
class WatchNumbers:
    """What the robot is, to those who watch it.

    Attributes:
        legs: their lengths.
        foot_radius: [m].
        inertia: of each leg about its joints, standing [kg m^2].
        weight: of the robot [N].
    """

    legs: Legs
    foot_radius: float
    inertia: Float[np.ndarray, "4 3 3"]
    weight: float

    @classmethod
    def of(cls, model: RobotModel) -> WatchNumbers:
        """Of ``model``'s robot."""
        pin_model = model.pin_model
        q = pin.neutral(pin_model)
        q[7:] = STANDING
        M = pin.crba(pin_model, pin_model.createData(), q)
        M = np.triu(M) + np.triu(M, 1).T
        blocks = [M[k : k + 3, k : k + 3] for k in range(6, 18, 3)]
        return cls(
            leg_table(model), model.foot_radius, np.array(blocks), model.mass * model.gravity
        )


@subroutine
def take_last_for_nan(s: WatchedSensors, r: SensorReading) -> None:
    """What is not a number becomes what it was."""
    for k in range(3):
        if not np.isfinite(r.gyro[k]):
            r.gyro[k] = s.gyro[k]
        if not np.isfinite(r.accelerometer[k]):
            r.accelerometer[k] = s.accelerometer[k]
    for j in range(12):
        if not np.isfinite(r.q_joints[j]):
            r.q_joints[j] = s.q[j]
        if not np.isfinite(r.v_joints[j]):
            r.v_joints[j] = s.v[j]
        if not np.isfinite(r.tau[j]):
            r.tau[j] = 0.0
    for leg in range(4):
        if not np.isfinite(r.foot_forces[leg]):
            r.foot_forces[leg] = s.force[leg]


@subroutine
def watch_encoders(s: WatchedSensors, r: SensorReading, dt: float) -> None:
    """Take jumps off the angles, and notice what has stopped."""
    gain = 1.0 - np.exp(-dt / SMOOTHING)
    for j in range(12):
        first, turned = 3 * (j // 3), 0.0
        for k in range(first, first + 3):
            turned += abs(r.q_joints[k] - s.q[k]) if k != j else 0.0
        if r.q_joints[j] == s.q[j] and r.v_joints[j] == s.v[j]:
            s.same[j] += dt
            s.travel[j] += turned
        else:
            s.same[j], s.travel[j] = 0.0, 0.0
        if s.same[j] > STUCK_TIME and s.travel[j] > STUCK_TRAVEL:
            s.stuck[j] = 1.0
    for j in range(12):
        jump = r.q_joints[j] - s.q[j] - 0.5 * (r.v_joints[j] + s.v[j]) * dt
        if abs(jump) > JUMP:
            s.shift[j] += jump
            s.jumped[j] = 1.0 if abs(s.shift[j]) > 0.5 * JUMP else 0.0
        s.dv[j] += gain * ((r.v_joints[j] - s.v[j]) / dt - s.dv[j])
        s.q[j], s.v[j] = r.q_joints[j], r.v_joints[j]
        r.q_joints[j] -= s.shift[j]


@subroutine
def leg_motion(leg: LegGeometry, q: V3, u: V3, tau: V3) -> tuple[V3, V3, V3]:
    """Place [m] and velocity [m/s] of a foot from its base, and the force on it by the torques [N].

    ``tau`` without what moves the leg itself: f = -J^-T tau, with the columns c of J: J^-T =
    [c1 x c2, c2 x c0, c0 x c1] / det J. All in the base frame.
    """
    c1, s1, c2, s2 = np.cos(q[0]), np.sin(q[0]), np.cos(q[1]), np.sin(q[1])
    c3, s3 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
    down = leg.thigh * c2 + leg.calf * c3
    x, y, z = (
        -leg.thigh * s2 - leg.calf * s3,
        leg.width * c1 + down * s1,
        leg.width * s1 - down * c1,
    )
    axis = (0.0, c1, s1)
    hip = (0.0, -z, y)
    thigh = cross(axis, (x, down * s1, -down * c1))
    calf = cross(axis, (-leg.calf * s3, leg.calf * c3 * s1, -leg.calf * c3 * c1))
    a, b, c = cross(thigh, calf), cross(calf, hip), cross(hip, thigh)
    det = hip[0] * a[0] + hip[1] * a[1] + hip[2] * a[2]
    scale = -1.0 / det if abs(det) > 1e-6 else 0.0  # a stretched leg tells nothing
    velocity = (
        hip[0] * u[0] + thigh[0] * u[1] + calf[0] * u[2],
        hip[1] * u[0] + thigh[1] * u[1] + calf[1] * u[2],
        hip[2] * u[0] + thigh[2] * u[1] + calf[2] * u[2],
    )
    force = (
        scale * (tau[0] * a[0] + tau[1] * b[0] + tau[2] * c[0]),
        scale * (tau[0] * a[1] + tau[1] * b[1] + tau[2] * c[1]),
        scale * (tau[0] * a[2] + tau[1] * b[2] + tau[2] * c[2]),
    )
    place = leg.p_base_hip
    return (place[0] + x, place[1] + y, place[2] + z), velocity, force


@subroutine
def less_rolling(q: V3, u: V3, velocity: V3, w: V3, up: V3, radius: float) -> V3:
    """Of a foot's centre, without its rolling on the ground: v - w_calf x (r e_z)."""
    c1, s1, bend = np.cos(q[0]), np.sin(q[0]), u[1] + u[2]
    turning = (w[0] + u[0], w[1] + c1 * bend, w[2] + s1 * bend)
    return plus_scaled(velocity, -radius, cross(turning, up))


@subroutine
def watch_force(
    s: WatchedSensors, r: SensorReading, leg: int, borne: float, carries: bool, dt: float
) -> None:
    """Hold a foot's sensor against ``borne``, the force by the leg's torques [N]."""
    force = r.foot_forces[leg]
    is_same = force == s.force[leg] and force > UNFELT and carries
    s.force_same[leg] = s.force_same[leg] + dt if is_same else 0.0
    is_against = (force < UNFELT and borne > LOADED) or (force > SENSED and borne < FREE)
    s.against[leg] = s.against[leg] + dt if is_against and carries else 0.0
    s.force[leg] = force
    if s.against[leg] > FORCE_TIME or s.force_same[leg] > SAME_TIME:
        s.force_is_wrong[leg] = 1.0
    if s.force_is_wrong[leg] > 0.0:
        r.foot_forces[leg] = borne if borne > LOADED else 0.0


@subroutine
def note_turn(s: WatchedSensors, between: V3, apart: V3, w: V3) -> None:
    """Add what two feet that stand say of the gyro's error d: apart + (w - d) x between = 0.

    With e = apart + w x between it is d x between = e, so that A d = b with
    A = between^2 1 - between between' and b = between x e.
    """
    moved = cross(w, between)
    e = (apart[0] + moved[0], apart[1] + moved[1], apart[2] + moved[2])
    b = cross(between, e)
    length = between[0] * between[0] + between[1] * between[1] + between[2] * between[2]
    s.residual += e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    for i in range(3):
        s.turned[i] += b[i]
        s.turning[i, i] += length
        for k in range(3):
            s.turning[i, k] -= between[i] * between[k]


@subroutine
def gyro_error(s: WatchedSensors) -> V3:
    """The least squares' answer, drawn towards 0 where the feet tell nothing."""
    A, b = s.turning, s.turned
    c0 = (A[0, 0] + UNSEEN, A[1, 0], A[2, 0])
    c1 = (A[0, 1], A[1, 1] + UNSEEN, A[2, 1])
    c2 = (A[0, 2], A[1, 2], A[2, 2] + UNSEEN)
    r0, r1, r2 = cross(c1, c2), cross(c2, c0), cross(c0, c1)
    det = c0[0] * r0[0] + c0[1] * r0[1] + c0[2] * r0[2]
    return (
        (r0[0] * b[0] + r0[1] * b[1] + r0[2] * b[2]) / det,
        (r1[0] * b[0] + r1[1] * b[1] + r1[2] * b[2]) / det,
        (r2[0] * b[0] + r2[1] * b[1] + r2[2] * b[2]) / det,
    )


@subroutine
def watch_legs(s: WatchedSensors, r: SensorReading, c: WatchNumbers, up: V3, dt: float) -> None:
    """Hold the feet's forces against the legs' torques, and the gyro against feet that stand."""
    for i in range(3):
        s.gyro[i], s.accelerometer[i] = r.gyro[i], r.accelerometer[i]
        r.gyro[i] -= s.gyro_off[i]
    w = triple(r.gyro)
    places, speeds, borne = np.empty((4, 3)), np.empty((4, 3)), np.empty(4)
    for leg in range(4):
        j = slice(3 * leg, 3 * leg + 3)
        q, v = triple(r.q_joints[j]), triple(r.v_joints[j])
        tau = triple(r.tau[j] - c.inertia[leg] @ s.dv[j])
        place, u, force = leg_motion(c.legs.geometry[leg], q, v, tau)
        borne[leg] = force[2]
        put(place, places[leg])
        put(less_rolling(q, v, u, w, up, c.foot_radius), speeds[leg])
    stands = borne.sum() > CARRIED * c.weight and up[2] > UPRIGHT
    s.stood = s.stood + dt if stands else 0.0
    if s.stood < CALM:
        forget_turns(s, 0.0)
    carries = s.stood > 0.0
    for leg in range(4):
        watch_force(s, r, leg, borne[leg], carries, dt)
    forget_turns(s, np.exp(-dt / SETTLING))
    for one in range(4):
        for other in range(one):
            if min(borne[one], borne[other]) > LOADED and are_sound(s, one, other):
                between = plus_scaled(triple(places[one]), -1.0, triple(places[other]))
                apart = plus_scaled(triple(speeds[one]), -1.0, triple(speeds[other]))
                note_turn(s, between, apart, w)
    judge_gyro(s, dt)


@subroutine
def are_sound(s: WatchedSensors, one: int, other: int) -> bool:
    """Whether the encoders of two legs are alive."""
    worst = 0.0
    for k in range(3):
        worst = max(worst, s.same[3 * one + k], s.same[3 * other + k])
        worst = max(worst, s.stuck[3 * one + k], s.stuck[3 * other + k])
    return worst < DOUBT


@subroutine
def forget_turns(s: WatchedSensors, keep: float) -> None:
    """Let what feet have said count less."""
    s.residual *= keep
    for i in range(3):
        s.turned[i] *= keep
        for k in range(3):
            s.turning[i, k] *= keep


@subroutine
def judge_gyro(s: WatchedSensors, dt: float) -> None:
    """Name it once its error has lasted, and take the error off."""
    error = gyro_error(s)
    explained = error[0] * s.turned[0] + error[1] * s.turned[1] + error[2] * s.turned[2]
    limit = GYRO_LIMIT * FINER if s.gyro_is_off > 0.0 else GYRO_LIMIT
    amount = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    is_off = amount > limit and explained > EXPLAINED * s.residual
    s.gyro_time = s.gyro_time + dt if is_off else 0.0
    s.tilt_is_off = 0.0
    if s.gyro_time > GYRO_LASTS:
        s.gyro_is_off, s.gyro_time, s.tilt_is_off = 1.0, 0.0, 1.0
        for i in range(3):
            s.gyro_off[i] += error[i]
            s.gyro_jump[i] = error[i]
        forget_turns(s, 0.0)


@kernel
def watch_sensors(
    s: WatchedSensors,
    gyro: Foreign[Array3],
    accelerometer: Foreign[Array3],
    q_joints: Foreign[Array12],
    v_joints: Foreign[Array12],
    tau: Foreign[Array12],
    foot_forces: Foreign[Array4],
    quaternion: Foreign[Array4],
    c: WatchNumbers,
    dt: float,
    r: SensorReading,
) -> int:
    """Judge a reading, ``dt`` seconds after the last one, and fill ``r`` with what it should be.

    The first six are as in ``SensorReading``; ``quaternion`` (x y z w) is the orientation of the
    base, as last known. Returns how many parts are broken.
    """
    r.gyro[:], r.accelerometer[:], r.tau[:] = gyro, accelerometer, tau
    r.q_joints[:], r.v_joints[:], r.foot_forces[:] = q_joints, v_joints, foot_forces
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    if s.has_begun > 0.0:
        take_last_for_nan(s, r)
        watch_encoders(s, r, dt)
    else:
        s.has_begun = 1.0
        for j in range(12):
            s.q[j], s.v[j] = r.q_joints[j], r.v_joints[j]
            r.q_joints[j] -= s.shift[j]
    watch_legs(s, r, c, up, dt)
    broken = s.gyro_is_off
    for j in range(12):
        broken += s.stuck[j] + s.jumped[j]
    for leg in range(4):
        broken += s.force_is_wrong[leg]
    return int(broken)


class SensorWatch:
    """Judges the readings of one robot.

    Attributes:
        faults: what is broken, in the order in which it was noticed.
    """

    def __init__(self, model: RobotModel) -> None:
        """Watch ``model``'s robot."""
        self._numbers = packed(WatchNumbers.of(model))
        zeros = np.zeros(12)
        still = SensorReading(0.0, zeros[:3], zeros[:3], zeros, zeros, zeros, zeros[:4])
        self._reading = packed(still)
        self.restart()

    @property
    def misturned(self) -> Array3 | None:
        """How far [rad] an error of the gyro, just found, has turned whoever believed it."""
        s = self._state
        return SETTLING_AND_LASTING * s.gyro_jump if s.tilt_is_off else None

    def restart(self) -> None:
        """Forget everything: all parts are taken for sound."""
        self._state, self._time = WatchedSensors(), -np.inf
        self._flags = np.zeros(len(_PARTS))
        self.faults: tuple[PartFault, ...] = ()

    def checked(self, reading: SensorReading, quaternion: Array4) -> SensorReading:
        """``reading`` as it should be, on a base that was last turned so (x y z w)."""
        dt = reading.time - self._time
        if not 0.0 < dt < LONGEST_STEP:
            self._state.has_begun, dt = 0.0, USUAL_STEP
        self._time = reading.time
        imu, joints = (reading.gyro, reading.accelerometer), (reading.q_joints, reading.v_joints)
        told = (*imu, *joints, reading.tau, reading.foot_forces, quaternion)
        if watch_sensors(self._state, *told, self._numbers, dt, self._reading):
            self._name(reading.time)
        row = numbers_of(self._reading).copy()
        return SensorReading(reading.time, *(row[part] for part in _OF_READING))

    def _name(self, time: float) -> None:
        """Note what is newly broken."""
        flags = self._state.row[_FLAGS]
        new = np.flatnonzero(flags > self._flags)
        if len(new):
            self._flags = np.maximum(flags, self._flags)
            self.faults += tuple(PartFault(*_PARTS[k], since=time) for k in new)

    def save(self) -> Mapping[str, Any]:
        """All that the next readings are judged by."""
        row = self._state.row.copy()
        return {"row": row, "time": self._time, "flags": self._flags, "faults": self.faults}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self._state.row[:] = saved["row"]
        self._time, self._flags, self.faults = saved["time"], saved["flags"], saved["faults"]


_OF_READING = tuple(slice(first, last) for first, last in pairwise((1, 4, 7, 19, 31, 43, 47)))
"""Where the arrays of a reading stand in its row."""
_PARTS = (
    *((name, "reads the same while its leg moves", False) for name in JOINT_NAMES),
    *((name, "reads another angle than it turned to", True) for name in JOINT_NAMES),
    *((name, "feels another force than its leg bears", True) for name in FOOT_NAMES),
    ("gyro", "turns otherwise than the feet that stand", True),
)
"""What each flag of ``WatchedSensors`` says, in their order."""
_FLAGS = slice(-len(_PARTS), None)
