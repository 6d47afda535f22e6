"""Which sensor is broken, by what the others say, and what it should have read.

Every reading passes here before the estimator. A sensor that contradicts the others for a while is
named, and corrected if they determine its value. The residuals:

    encoder jumps    q - q_last - v dt                            the jump is subtracted afterwards
    encoder stuck    q and v stay while the leg's others do not   nothing replaces it
    foot's force     against f = -J^-T (tau - M dv/dt)            replaced by f
    IMU              against feet that stand: ``imu_watch``       the error is subtracted
    noise            of speeds and gyro: ``speed_noise``          from angles and time

with J and M of a leg alone, in the base frame. Forces are judged while the legs carry the robot. A
reading that is not a number is replaced by the previous one. Sound readings are passed on
unchanged, to the bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.algebra.linear import cross, dot, plus_scaled, put, triple
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.records import V3, Array3, Array4, Array4x3, Array12, Record, numbers_of, packed
from go2_wbc.robot.imu_watch import (
    SHAKEN,
    STRUCK,
    THROWN,
    UPSET,
    WatchedImu,
    judge_accelerometer,
    judge_gyro,
    judge_jump,
    note_bearing,
    note_push,
    note_turn,
)
from go2_wbc.robot.leg_kinematics import LegGeometry, Legs, leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.speed_noise import MOST_JOINTS, SpeedNoise, calm_gyro, calm_joints, noise_of_gyro
from go2_wbc.robot.state import PartFault, SensorReading

JUMP = 0.05
"""rad; a joint's angle differs by less from what its speed says, however hard the foot lands."""
LONGEST_STEP, USUAL_STEP = 0.05, 0.002
"""Time [s] between two readings of one stretch, and that taken for the first one's."""
DOUBT = 0.01  #: Time [s] after which a joint that reads the very same says nothing of the IMU
STUCK_TIME = 0.1
"""An encoder is stuck if it has read the very same for so long [s], while its leg's others have
changed: noise alone lets none stay for more than 8 ms, not even at rest."""
SMOOTHING = 0.008  #: Time constant [s] of the joints' accelerations
LOADED, FREE = 20.0, 10.0
"""Force [N] by a leg's torques above which its foot stands; 99 % that swing bear less than 7."""
LANDED = 0.03
"""Time [s] for which a foot has stood that tells of the IMU: one that comes down hard slides and is
pressed flat. In 9 minutes of reversals of 2 m/s a sound IMU was named 7 times without."""
ON_A_PAIR = 0.5
"""Share of the time that counts against the gyro while two feet tell: one pair may slide."""
UNFELT, SENSED = 3.0, 25.0
"""Force [N] below which a sensor says that the foot is free, and above which it says it stands."""
FORCE_TIME, SAME_TIME = 0.12, 0.25
"""Time [s] for which they contradict each other, and in which a living sensor changes."""
NOISY, MOST_NOISE, NOISE_TIME = 1.5, 4.0, 0.2
"""Mean of |f - 2 f_1 + f_2|, up to so much [N], over this time [s], above which a sensor has noise:
its own is 2.6. While such a one changes it lives, whatever its leg bears: a calf may lie on a box.
Others say the same while the load stays: they are judged once that changes."""
CHANGED = 15.0  #: By so much [N]
SOUND_TIME = 0.1
"""A sensor that was named is sound after all if it has changed with the load, within ``CHANGED``,
for so long [s]: its foot was held in the air, say, and its leg pressed on what held it. Once: one
that comes and goes is broken."""
RUBBING = 2.0
"""N m s/rad; joints damped so, as in MuJoCo Menagerie's Go2, may not be taken for loads."""
CARRIED, UPRIGHT = 0.7, 0.9
"""Share of the robot's weight that its legs bear while it stands or walks, and the cosine of its
greatest tilt then: legs of one that lies or tumbles strike what they do not stand on."""
STANDING = np.tile([0.0, 0.8, -1.6], 4)  #: Joint angles [rad] of a robot that stands, roughly


class WatchedSensors(Record):
    """What is remembered from reading to reading."""

    has_begun: float  #: 1 once there has been one
    step: float  #: the last time between two [s]
    whole: float  #: how many came since one was lost: what turned meanwhile is not judged
    q: Array12  #: the last angles [rad], as they were read
    v: Array12  #: the last speeds [rad/s], as they were read
    shift: Array12  #: what is taken off the angles [rad]
    dv: Array12  #: smoothed accelerations of the joints [rad/s^2]
    same: Array12  #: for how long a joint has read the very same [s]
    force: Array4  #: the last of each foot [N], as it was read
    rise: Array4  #: its last change [N]
    noise: Float[np.ndarray, "2 4"]
    """Of the force, while a foot is free and while it stands; see ``NOISY`` [N]."""
    force_same: Array4  #: for how long it has been the very same [s]
    load: Array4  #: of the leg, when that began [N]
    stood: Array4  #: for how long a foot has borne its leg's load [s]
    against: Array4  #: for how long a foot's force has contradicted the leg's torques [s]
    agreed: Array4  #: how long it has done so since it was named [s]; -inf once sound
    gyro: Array3  #: the last, as it was read
    accelerometer: Array3  #: the last, as it was read
    speed_noise: SpeedNoise  #: of the joints' speeds and the gyro
    imu: WatchedImu  #: the IMU against feet that stand
    stuck: Array12  #: 1 for an encoder that is
    jumped: Array12  #: 1 for an encoder whose shift is not 0
    force_is_wrong: Array4  #: 1 for a foot's force that is
    gyro_is_off: float  #: 1 if it is
    accelerometer_is_off: float  #: 1 if it is


@dataclass(frozen=True, slots=True)
class WatchNumbers:
    """What the robot is, to those who watch it."""

    legs: Legs  #: their lengths
    foot_radius: float  #: [m]
    inertia: Float[np.ndarray, "4 3 3"]  #: of each leg about its joints, standing [kg m^2]
    weight: float  #: of the robot [N]
    gravity: float  #: [m/s^2]
    p_base_imu: Array3  #: place of the IMU in the base frame [m]

    @classmethod
    def of(cls, model: RobotModel) -> WatchNumbers:
        """Of ``model``'s robot."""
        pin_model = model.pin_model
        q = pin.neutral(pin_model)
        q[7:] = STANDING
        M = pin.crba(pin_model, pin_model.createData(), q)
        M = np.triu(M) + np.triu(M, 1).T
        blocks = [M[k : k + 3, k : k + 3] for k in range(6, 18, 3)]
        weight, imu = model.mass * model.gravity, model.p_base_imu
        sizes = model.foot_radius, np.array(blocks), weight, model.gravity, imu
        return cls(leg_table(model), *sizes)


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
    s.whole = s.whole + 1.0 if dt < 1.5 * s.step else 0.0
    s.step = dt
    for j in range(12):
        is_same = r.q_joints[j] == s.q[j] and r.v_joints[j] == s.v[j]
        s.same[j] = s.same[j] + dt if is_same else 0.0
    for j in range(12):
        first, others = 3 * (j // 3), 0.0
        for k in range(first, first + 3):
            others = max(others, s.same[k]) if k != j else others
        if s.same[j] > STUCK_TIME and others < DOUBT:
            s.stuck[j] = 1.0
    turned, square = np.empty(12), 0.0
    for j in range(12):
        turned[j] = (r.q_joints[j] - s.q[j]) / dt
        jump = r.q_joints[j] - s.q[j] - 0.5 * (r.v_joints[j] + s.v[j]) * dt
        if abs(jump) <= JUMP:
            square += min((jump / dt) ** 2, MOST_JOINTS**2) / 12.0
        else:
            turned[j] = r.v_joints[j]
            if s.whole > 1.0:
                s.shift[j] += jump
                s.jumped[j] = 1.0 if abs(s.shift[j]) > 0.5 * JUMP else 0.0
        s.q[j], s.v[j] = r.q_joints[j], r.v_joints[j]
        r.q_joints[j] -= s.shift[j]
    calm_joints(s.speed_noise, r, turned, square, dt)
    for j in range(12):
        s.dv[j] += gain * ((r.v_joints[j] - s.speed_noise.v[j]) / dt - s.dv[j])
        s.speed_noise.v[j] = r.v_joints[j]


@subroutine
def leg_motion(leg: LegGeometry, q: V3, u: V3, tau: V3) -> tuple[V3, V3, V3, float]:
    """Place [m] and velocity [m/s] of a foot from its base, and the force on it by the torques [N].

    ``tau`` without what moves the leg itself: f = -J^-T tau, with the columns c of J: J^-T =
    [c1 x c2, c2 x c0, c0 x c1] / det J. The last is by how much joints that rub may belie its z
    [N]: ``RUBBING`` |u| in the place of tau. All in the base frame.
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
    rubbing = abs(u[0] * a[2]) + abs(u[1] * b[2]) + abs(u[2] * c[2])
    place = leg.p_base_hip
    return (
        (place[0] + x, place[1] + y, place[2] + z),
        velocity,
        force,
        RUBBING * abs(scale) * rubbing,
    )


@subroutine
def less_rolling(q: V3, u: V3, velocity: V3, w: V3, up: V3, radius: float) -> V3:
    """Of a foot's centre, without its rolling on the ground: v - w_calf x (r e_z)."""
    c1, s1, bend = np.cos(q[0]), np.sin(q[0]), u[1] + u[2]
    turning = (w[0] + u[0], w[1] + c1 * bend, w[2] + s1 * bend)
    return plus_scaled(velocity, -radius, cross(turning, up))


@subroutine
def watch_force(
    s: WatchedSensors,
    r: SensorReading,
    leg: int,
    borne: float,
    slack: float,
    carries: bool,
    dt: float,
) -> None:
    """Hold a foot's sensor against what its leg bears, give or take ``slack`` [N]."""
    force = r.foot_forces[leg]
    rise, felt = force - s.force[leg], 1 if force > UNFELT else 0
    if rise == 0.0:
        s.force_same[leg] += dt
    else:
        s.force_same[leg], s.load[leg] = 0.0, borne
        has_landed = (s.force[leg] > UNFELT) != (felt == 1)
        share = 0.0 if has_landed else 1.0 - np.exp(-dt / NOISE_TIME)
        s.noise[felt, leg] += share * (
            min(abs(rise - s.rise[leg]), MOST_NOISE) - s.noise[felt, leg]
        )
    s.force[leg], s.rise[leg] = force, rise
    is_noisy = max(s.noise[0, leg], s.noise[1, leg]) > NOISY
    is_dead = force < UNFELT and borne - slack > (FREE if is_noisy else LOADED)
    is_against = is_dead or (force > SENSED and borne + slack < FREE)
    is_against = is_against and carries and (rise == 0.0 or not is_noisy)
    s.against[leg] = s.against[leg] + dt if is_against else 0.0
    has_changed = felt == 1 and abs(borne - s.load[leg]) > CHANGED
    is_same = s.force_same[leg] > SAME_TIME and (has_changed or s.noise[felt, leg] > NOISY)
    if carries and (is_same or s.against[leg] > FORCE_TIME):
        s.force_is_wrong[leg] = 1.0
    agrees = carries and force > SENSED and abs(force - borne) < CHANGED
    agrees = agrees and s.force_is_wrong[leg] > 0.0 and s.force_same[leg] < DOUBT
    s.agreed[leg] = s.agreed[leg] + dt if agrees else min(s.agreed[leg], 0.0)
    if s.agreed[leg] > SOUND_TIME:
        s.force_is_wrong[leg], s.agreed[leg] = 0.0, -np.inf
    if s.force_is_wrong[leg] > 0.0:
        r.foot_forces[leg] = borne if borne > LOADED else 0.0


@subroutine
def watch_legs(s: WatchedSensors, r: SensorReading, c: WatchNumbers, up: V3, dt: float) -> None:
    """Hold the feet's forces against the legs' torques, and the IMU against feet that stand."""
    m = s.imu
    jump = plus_scaled(triple(r.gyro), -1.0, triple(s.gyro))
    for i in range(3):
        s.gyro[i], s.accelerometer[i] = r.gyro[i], r.accelerometer[i]
        r.gyro[i] -= m.gyro_off[i]
        r.accelerometer[i] -= m.force_off[i]
    w = triple(r.gyro)
    places, speeds = np.empty((4, 3)), np.empty((4, 3))
    borne, slack, loads = np.empty(4), np.empty(4), np.empty(4)
    push, per_mass = (0.0, 0.0, 0.0), c.gravity / c.weight
    for leg in range(4):
        j = slice(3 * leg, 3 * leg + 3)
        q, v = triple(r.q_joints[j]), triple(r.v_joints[j])
        tau = triple(r.tau[j] - c.inertia[leg] @ s.dv[j])
        place, u, force, slack[leg] = leg_motion(c.legs.geometry[leg], q, v, tau)
        put(place, places[leg])
        put(less_rolling(q, v, u, w, up, c.foot_radius), speeds[leg])
        borne[leg] = force[2]
        if r.foot_forces[leg] > UNFELT or s.force_is_wrong[leg] > 0.0:  # a stretched leg errs
            push = plus_scaled(push, per_mass, force)
    moved = plus_scaled(triple(r.accelerometer), -c.gravity, up)
    note_push(m, push, triple(r.accelerometer), dt)
    is_up = up[2] > UPRIGHT
    is_borne = is_up and borne.sum() > CARRIED * c.weight
    is_thrown = dot(moved, moved) > THROWN**2
    m.upset = UPSET if is_thrown else max(m.upset - dt, 0.0)
    is_told = not is_thrown and noise_of_gyro(s.speed_noise) == 0.0
    note_bearing(m, is_up and is_told, is_borne, dt)
    for leg in range(4):
        watch_force(s, r, leg, borne[leg], slack[leg], is_borne, dt)
        stands = r.foot_forces[leg] > SENSED or borne[leg] - slack[leg] > LOADED
        is_felt = r.foot_forces[leg] > UNFELT  # one that is lifted presses, and moves
        bears = is_felt and stands and borne[leg] > LOADED and is_sound(s, leg)
        s.stood[leg] = s.stood[leg] + dt if bears else 0.0
        m.struck = STRUCK if max(borne[leg], r.foot_forces[leg]) > c.weight else m.struck
        loads[leg] = borne[leg] if bears and m.unborne == 0.0 else 0.0
    m.is_found, m.turn[:] = 0.0, 0.0
    judge_jump(m, jump, bool(np.any((s.stood > 0.0) & (s.stood <= SHAKEN))), dt)
    watch_imu(s, r, c, places, speeds, loads, up, dt)


@subroutine
def watch_imu(
    s: WatchedSensors,
    r: SensorReading,
    c: WatchNumbers,
    places: Array4x3,
    speeds: Array4x3,
    loads: Array4,
    up: V3,
    dt: float,
) -> None:
    """Let feet that stand judge the IMU: those with a load [N]; all in the base frame."""
    m, w, v = s.imu, triple(r.gyro), (0.0, 0.0, 0.0)
    landed = np.where(s.stood > LANDED, loads, 0.0)
    for one in range(4):
        if landed[one] > 0.0:
            arm = plus_scaled(triple(places[one]), -1.0, triple(c.p_base_imu))
            along = plus_scaled(cross(w, arm), 1.0, triple(speeds[one]))
            v = plus_scaled(v, -landed[one] / landed.sum(), along)
        for other in range(one):
            if loads[one] > 0.0 and loads[other] > 0.0:
                between = plus_scaled(triple(places[one]), -1.0, triple(places[other]))
                apart = plus_scaled(triple(speeds[one]), -1.0, triple(speeds[other]))
                has_landed = landed[one] > 0.0 and landed[other] > 0.0
                note_turn(m, between, apart, w, has_landed)
    count = np.sum(landed > 0.0)
    stands = bool(count > 1)  # one foot may roll or slip
    judge_gyro(m, 0.0 if not stands else ON_A_PAIR if count == 2 else 1.0, dt)
    judge_accelerometer(m, triple(r.accelerometer), w, v, up, c.gravity, stands, dt)
    s.gyro_is_off, s.accelerometer_is_off = m.gyro_is_off, m.force_is_off


@subroutine
def is_sound(s: WatchedSensors, leg: int) -> bool:
    """Whether the encoders of a leg are alive."""
    worst = 0.0
    for k in range(3):
        worst = max(worst, s.same[3 * leg + k], s.stuck[3 * leg + k])
    return worst < DOUBT


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

    ``quaternion`` (x y z w): of the base, as last known. Returns how many parts are broken.
    """
    r.gyro[:], r.accelerometer[:], r.tau[:] = gyro, accelerometer, tau
    r.q_joints[:], r.v_joints[:], r.foot_forces[:] = q_joints, v_joints, foot_forces
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    if s.has_begun > 0.0:
        take_last_for_nan(s, r)
        watch_encoders(s, r, dt)
    else:
        s.has_begun, s.step, s.whole = 1.0, dt, 2.0
        s.q[:], s.v[:], s.speed_noise.v[:] = r.q_joints, r.v_joints, r.v_joints
        r.q_joints[:] -= s.shift
    calm_gyro(s.speed_noise, r, dt)
    watch_legs(s, r, c, up, dt)
    broken = s.gyro_is_off + s.accelerometer_is_off
    broken += s.stuck.sum() + s.jumped.sum() + s.force_is_wrong.sum()
    return int(broken)


class SensorWatch:
    """Judges the readings of one robot.

    Attributes:
        faults: what is broken, in the order in which it was noticed.
        speed_noise: of the joints' speeds and the gyro.
    """

    def __init__(self, model: RobotModel) -> None:
        self._numbers = packed(WatchNumbers.of(model))
        zeros = np.zeros(12)
        still = SensorReading(0.0, zeros[:3], zeros[:3], zeros, zeros, zeros, zeros[:4])
        self._reading = packed(still)
        self.restart()

    @property
    def misturned(self) -> Array3 | None:
        """How far [rad] an error of the IMU, just found, has turned whoever believed it."""
        m = self._state.imu
        return m.turn.copy() if m.is_found else None

    def restart(self) -> None:
        """Forget everything: all parts are taken for sound."""
        self._state, self._time = WatchedSensors(), -np.inf
        self.speed_noise = self._state.speed_noise
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
        if watch_sensors(self._state, *told, self._numbers, dt, self._reading) or self.faults:
            self._name(reading.time)
        row = numbers_of(self._reading).copy()
        return SensorReading(reading.time, *(row[part] for part in _OF_READING))

    def _name(self, time: float) -> None:
        """Note what is newly broken, and which foot's sensor is sound after all."""
        flags = self._state.row[_FLAGS]
        known = np.where(_IS_FOOT, flags, np.maximum(flags, self._flags))
        if np.array_equal(known, self._flags):
            return
        sound = {_PARTS[k][0] for k in np.flatnonzero(known < self._flags)}
        new = tuple(PartFault(*_PARTS[k], since=time) for k in np.flatnonzero(known > self._flags))
        self.faults = (*(fault for fault in self.faults if fault.part not in sound), *new)
        self._flags = known

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
    *((name, "reads the same while its leg's others change", False) for name in JOINT_NAMES),
    *((name, "reads another angle than it turned to", True) for name in JOINT_NAMES),
    *((name, "feels another force than its leg bears", True) for name in FOOT_NAMES),
    ("gyro", "turns otherwise than the feet that stand", True),
    ("accelerometer", "feels otherwise than the feet that stand move", True),
)
"""What each flag of ``WatchedSensors`` says, in their order."""
_IS_FOOT = np.array([part in FOOT_NAMES for part, *_ in _PARTS])
_FLAGS = slice(-len(_PARTS), None)
