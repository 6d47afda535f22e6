"""Ground truth: a plant that passes everything on and records what MuJoCo says after every tick."""

from __future__ import annotations

import math
import time
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.legs import JOINT_NAMES
from go2_wbc.plant.base import Plant, Scan
from go2_wbc.plant.mujoco.forces import Contacts, foot_contacts, touches_itself
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, PartFault, RobotState

FALLEN_TILT = math.radians(60.0)
"""Tilt of the trunk from which on the robot has fallen, whatever the controller thinks."""
TOUCH = 1.0  #: Force [N] between trunk and ground that counts as a touch


@dataclass(frozen=True, slots=True)
class TruthRecording:
    """What MuJoCo said, one row per tick, at the end of that tick."""

    time: Float[np.ndarray, " n"]  #: plant time [s]
    q: Float[np.ndarray, "n 19"]  #: configuration as in ``RobotState``
    v: Float[np.ndarray, "n 18"]  #: velocity as in ``RobotState``
    rpy: Float[np.ndarray, "n 3"]  #: attitude of the base [rad], yaw unwrapped
    tau: Float[np.ndarray, "n 12"]  #: joint torques [N m] that acted
    tau_asked: Float[np.ndarray, "n 12"]
    """Those that the command asked for when the tick began [N m], before the motors' limits; 0 in a
    row that no command led to."""
    foot_forces: Float[np.ndarray, "n 4"]  #: normal forces [N] on the feet
    p_world_com: Float[np.ndarray, "n 3"]  #: centre of mass [m], by MuJoCo
    p_world_feet: Float[np.ndarray, "n 4 3"]  #: centres of the feet [m], by MuJoCo
    p_world_contacts: Float[np.ndarray, "n 4 3"]  #: contact points of the feet [m], nan in the air
    v_world_contacts: Float[np.ndarray, "n 4 3"]
    """Tangential velocity [m/s] of the feet's material there, 0 in the air."""
    trunk_force: Float[np.ndarray, " n"]  #: normal force [N] between the trunk and the ground
    limb_force: Float[np.ndarray, " n"]  #: the same for the legs without their feet
    touches_itself: Bool[np.ndarray, " n"]  #: whether two links touch that must not

    def part(self, rows: slice | Int[np.ndarray, " m"]) -> TruthRecording:
        """Some of the ticks."""
        return TruthRecording(*(getattr(self, name)[rows] for name in TruthRecording.__slots__))

    def since(self, time: float) -> TruthRecording:
        """The ticks after ``time`` [s]."""
        return self.part(slice(int(np.searchsorted(self.time, time, side="right")), None))

    @property
    def com_velocity(self) -> Float[np.ndarray, "m 3"]:
        """Velocity of the centre of mass [m/s] ahead, left, up of the heading; m = n - 1 ticks.

        The difference of MuJoCo's positions over each control period: exact in the mean.
        """
        v_world = np.diff(self.p_world_com, axis=0) / np.diff(self.time)[:, None]
        yaw = 0.5 * (self.rpy[1:, 2] + self.rpy[:-1, 2])
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, z = v_world.T
        return np.column_stack([c * x + s * y, c * y - s * x, z])

    def torque_shares(self, model: RobotModel) -> Float[np.ndarray, " n"]:
        """Largest |tau| of any joint at every tick, as a share of what ``model.motor`` gives.

        That depends on the joint's speed and direction at the start of the tick.
        """
        return model.motor.share(self.tau, self._v_before).max(axis=1)

    @property
    def _v_before(self) -> Float[np.ndarray, "n 12"]:
        """Joint velocities [rad/s] at the start of every tick."""
        return np.vstack([self.v[:1], self.v[:-1]])[:, 6:]

    def peak_speed_share(self, model: RobotModel) -> float:
        """Largest |joint velocity| / limit of any joint."""
        return float((np.abs(self.v[:, 6:]) / model.speed_limits).max())

    def joint_distance(self, model: RobotModel) -> float:
        """Least distance [rad] of any joint to its limit; negative beyond it."""
        return float(self.joint_distances(model).min())

    def joint_distances(self, model: RobotModel) -> Float[np.ndarray, " n"]:
        """The same at every tick."""
        q = self.q[:, 7:]
        return np.minimum(q - model.q_lower, model.q_upper - q).min(axis=1)


@final
class GroundTruth(Plant):
    """Passes everything on to a ``MujocoPlant`` and records its state since the last ``clear``.

    Attributes:
        start: plant time [s] of the last ``clear``.
        cpu_time: processor time [s] that recording has taken.
        on_tick: called after every tick, for events in the middle of a call; or None.
    """

    def __init__(self, plant: MujocoPlant) -> None:
        self._plant = plant
        self.robot, self.joint_damping = plant.robot, plant.joint_damping
        joint = plant.model.joint(JOINT_NAMES[0])  # a file of a user may name the base otherwise
        self._base = plant.model.body_rootid[plant.model.jnt_bodyid[joint.id]]
        self.on_tick: Callable[[], None] | None = None
        self.cpu_time = 0.0
        self.clear()

    @property
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""
        return self._plant.control_period

    @property
    def motors_obey(self) -> bool:
        """As the plant's do."""
        return self._plant.motors_obey

    @property
    def sensor_faults(self) -> tuple[PartFault, ...]:
        """Those of the plant."""
        return self._plant.sensor_faults

    @property
    def body_contact_force(self) -> float | None:
        """See ``Plant.body_contact_force``."""
        return self._plant.body_contact_force

    def read(self) -> RobotState:
        """The measured state."""
        return self._plant.read()

    def scan(self) -> Scan | None:
        """See ``Plant.scan``."""
        return self._plant.scan()

    def write(self, command: JointCommand) -> None:
        """Apply ``command`` for one control period, and record what came of it."""
        state = self._plant.truth()
        self._plant.write(command)
        self._record(command.asked(state.joint_positions, state.joint_velocities))
        if self.on_tick is not None:
            self.on_tick()

    def close(self) -> None:
        """End the plant."""
        self._plant.close()

    def clear(self) -> None:
        """Forget what was recorded; begin again with the present state."""
        self.start = self._plant.time
        self._instants: list[_Instant] = []
        self._record(np.zeros(12))

    def fall(self) -> str | None:
        """Why the robot counts as fallen at this moment, or None."""
        state = self._plant.truth()
        if not np.isfinite(state.q).all() or state.tilt > FALLEN_TILT:
            return f"fell by t={state.time:.2f} s: tilt {math.degrees(state.tilt):.0f} deg"
        if self._plant.base_contact_force > TOUCH:
            return f"the trunk is on the ground at t={state.time:.2f} s"
        return None

    @property
    def p_world_com(self) -> Float[np.ndarray, "3"]:
        """Centre of mass [m] now, by MuJoCo."""
        return self._plant.data.subtree_com[self._base].copy()

    def recording(self, since: float = -math.inf) -> TruthRecording:
        """The ticks since the last ``clear``, or after a time [s]; at least the last one."""
        began = time.thread_time()
        first = bisect_right(self._instants, since, key=lambda instant: instant.state.time)
        recorded = _recording(self._instants[first:] or self._instants[-1:])
        self.cpu_time += time.thread_time() - began
        return recorded

    def _record(self, tau_asked: Float[np.ndarray, "12"]) -> None:
        began = time.thread_time()
        plant = self._plant
        forces = plant.base_contact_force, plant.limb_contact_force
        feet = plant.p_world_feet
        self._instants.append(_Instant(plant.truth(), tau_asked, feet, forces, plant.contacts()))
        self.cpu_time += time.thread_time() - began


class _Instant(NamedTuple):
    """What a tick leaves behind: copies only, so that recording it takes little of the tick.

    ``forces`` are those of trunk and limbs [N].
    """

    state: RobotState
    tau_asked: Float[np.ndarray, "12"]
    p_world_feet: Float[np.ndarray, "4 3"]
    forces: tuple[float, float]
    contacts: Contacts


def _recording(instants: Sequence[_Instant]) -> TruthRecording:
    """What ``instants`` say, evaluated together."""
    states, contacts = [i.state for i in instants], [i.contacts for i in instants]
    rpy = np.array([state.rpy for state in states])
    rpy[:, 2] = np.unwrap(rpy[:, 2])
    points, velocities = foot_contacts(contacts)
    return TruthRecording(
        time=np.array([state.time for state in states]),
        q=np.array([state.q for state in states]),
        v=np.array([state.v for state in states]),
        rpy=rpy,
        tau=np.array([state.tau for state in states]),
        tau_asked=np.array([i.tau_asked for i in instants]),
        foot_forces=np.array([state.foot_forces for state in states]),
        p_world_com=np.array([contact.p_world_com for contact in contacts]),
        p_world_feet=np.array([i.p_world_feet for i in instants]),
        p_world_contacts=points,
        v_world_contacts=velocities,
        trunk_force=np.array([i.forces[0] for i in instants]),
        limb_force=np.array([i.forces[1] for i in instants]),
        touches_itself=touches_itself(contacts),
    )
