"""Velocity command -> Reference: footholds, swing feet and the body's path of a gait.

Every quantity is in the world frame unless its name says otherwise; commands are in the heading
frame (z up, x along the reference's yaw).

- Footholds: Raibert (Legged Robots That Balance, 1986, ch. 2). A foot that is put down
  ``v T / 2`` ahead of its hip is below it in the middle of the stance time ``T``, so it neither
  speeds the trunk up nor slows it down; ``k (v - v_ref)`` more takes out the velocity error.
- Body: the command is integrated to a pose. A body that only followed a velocity would keep a
  steady error of place and heading. The pose is held within reach (a leash) of the measured one,
  so that a robot that is held does not store up a way to jump afterwards.
- Ground: its height is learnt from the feet that should stand, each where its contact is first
  measured. A foot that comes down late has no contact yet when it should; taken for landed, it
  would raise the ground, and with it the trunk, step by step.
- Stepping without a command: the capture point (Pratt et al., Capture Point, Humanoids 2006),
  ``p + v / omega`` with ``omega = sqrt(g / h)``, is where an inverted pendulum of height ``h``
  would come to rest above its foot; too far from the feet's middle, they must be moved there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.contacts import ContactPhase, Gait, standing
from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.correction import SteadyStateCorrection
from go2_wbc.planning.gait_clock import GaitClock
from go2_wbc.planning.gait_planner import GaitPlanner
from go2_wbc.planning.mpc import MpcConfig
from go2_wbc.planning.preview import Course, ForcePlanner
from go2_wbc.planning.swing import SwingConfig, swing_foot
from go2_wbc.reference import BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative, require_positive

SETTLED_COMMAND = 1e-3
"""Ramped velocity command [m/s, rad/s] below which it counts as arrived at zero."""
LEAST_HEIGHT, GREATEST_HEIGHT = 0.18, 0.34
"""CoM heights [m] between which the legs can step."""
GROUND_SHARE = 0.3
"""Share of a landing foot's height that goes into the estimate of the ground's height."""
_TINY = 1e-9
"""Length [m] that stands in for zero where one divides by it."""


@dataclass(frozen=True, slots=True)
class LocomotionConfig:
    """Numbers of the locomotion planner, from a search on this robot in simulation.

    Attributes:
        height: CoM height [m] above the feet's contact points.
        linear_acceleration: greatest change of the commanded velocity [m/s^2].
        angular_acceleration: greatest change of the commanded turning rate [rad/s^2].
        velocity_feedback: foothold offset [s] per velocity error.
        position_leash: distance [m] that the reference may run ahead of the robot.
        yaw_leash: angle [rad] that the heading reference may run ahead.
        foothold_reach: greatest horizontal distance [m] of a foothold from below its hip.
        normal_force_min: least normal force [N] asked of a stance foot.
        normal_force_max: greatest normal force [N] allowed on a stance foot.
        load_ramp: time [s] over which a foot takes up that force after touchdown and gives it up
            before lift-off.
        settle_speed: speed [m/s] below which a robot without command may stop stepping.
        capture_margin: distance [m] of the capture point from the middle of the feet beyond
            which a standing robot starts to step.
        square_tolerance: distance [m] of a foot from below its hip at which the robot stands
            squarely enough to stop stepping.
        swing: shape of the swing.
        mpc: planning of the forces ahead.
    """

    height: float = 0.29
    linear_acceleration: float = 1.5
    angular_acceleration: float = 4.0
    velocity_feedback: float = 0.12
    position_leash: float = 0.08
    yaw_leash: float = 0.3
    foothold_reach: float = 0.22
    normal_force_min: float = 0.0
    normal_force_max: float = 400.0
    load_ramp: float = 0.03
    settle_speed: float = 0.05
    capture_margin: float = 0.09
    square_tolerance: float = 0.02
    swing: SwingConfig = field(default_factory=SwingConfig)
    mpc: MpcConfig = field(default_factory=MpcConfig)

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        zero_is_valid = {"velocity_feedback", "normal_force_min"}
        positive = {f.name for f in fields(self)} - zero_is_valid - {"swing", "mpc"}
        require_positive(self, *sorted(positive))
        require_not_negative(self, *sorted(zero_is_valid))
        if not LEAST_HEIGHT <= self.height <= GREATEST_HEIGHT:
            raise ConfigError(
                f"LocomotionConfig.height must be {LEAST_HEIGHT} to {GREATEST_HEIGHT} m, "
                f"got {self.height!r}"
            )
        if self.normal_force_min >= self.normal_force_max:
            raise ConfigError(
                f"normal_force_min must be below normal_force_max, got {self.normal_force_min} "
                f"and {self.normal_force_max} N"
            )

    def plans_forces(self, gait: Gait) -> bool:
        """Whether ``gait`` is walked with the forces planned ahead."""
        return self.mpc.enabled or gait.needs_mpc

    def ramp(self, gait: Gait) -> float:
        """Time [s] over which a foot of ``gait`` takes up its load."""
        return self.mpc.load_ramp if self.plans_forces(gait) else self.load_ramp


class LocomotionPlanner(GaitPlanner):
    """The planner in its readable form, to which ``compiled.CompiledPlanner`` is held."""

    def __init__(self, model: RobotModel, gait: Gait, config: LocomotionConfig) -> None:
        """Prepare a planner; ``start`` sets it on its way."""
        self._model = model
        self._config = config
        self._clock = GaitClock(gait, None)
        self.change_gait(gait)
        self._velocity = np.zeros(3)
        self._is_stepping = False
        self._yaw = 0.0

    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state, standing."""
        self._yaw = snapshot.state.yaw
        self._position = snapshot.p_world_com[:2].copy()
        self._velocity = np.zeros(3)
        self._is_stepping = False
        self._clock.restart()
        if self._forces is not None:
            self._forces.start()
        self._last_time = snapshot.state.time
        self._ground = float(np.mean(snapshot.p_world_feet[:, 2])) - self._model.foot_radius
        self._liftoff = snapshot.p_world_feet.copy()
        self._was_stance = np.ones(4, dtype=bool)
        self._is_awaited = np.zeros(4, dtype=bool)
        self._correction = SteadyStateCorrection()
        self._height_offset = 0.0

    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``; see ``GaitPlanner``."""
        config = self._config
        plans_forces = config.plans_forces(gait)
        self._clock.change(gait, gait.stride if plans_forces else None)
        self._ramp = config.ramp(gait)
        self._forces = ForcePlanner(self._model, config.mpc) if plans_forces else None

    @property
    def velocity(self) -> Float[np.ndarray, "3"]:
        """Ramped command; see ``GaitPlanner``."""
        return self._velocity.copy()

    @property
    def is_stepping(self) -> bool:
        """Whether the gait is running; not before ``start``."""
        return self._is_stepping

    @property
    def heading(self) -> float:
        """Yaw [rad] of the reference; 0 before ``start``."""
        return self._yaw

    def square_up(self, snapshot: Snapshot) -> bool:
        """Start stepping unless every foot is below its hip; returns whether they all are."""
        self._is_stepping = not self._is_square(snapshot)
        self._clock.restart()
        return not self._is_stepping

    def update(self, snapshot: Snapshot, command: VelocityCommand) -> Reference:
        """The reference of this tick for the wanted ``command`` (already inside the envelope)."""
        dt = snapshot.state.time - self._last_time
        self._last_time = snapshot.state.time
        self._advance_phase(snapshot, command, dt)
        self._integrate(snapshot, command, dt)
        self._correct_height(snapshot, dt)
        phase = self._phase(command, dt)
        self._note_liftoffs(snapshot, phase.stance)
        p, v, a = self._feet(snapshot, phase)
        legs = tuple(LegTask.STANCE if s else LegTask.SWING for s in phase.stance)
        q = snapshot.state.joint_positions
        load = phase.load_share(self._ramp)
        reference = Reference(
            body=self._body(),
            legs=legs,
            normal_force_min=self._config.normal_force_min * load,
            normal_force_max=self._config.normal_force_max * load,
            p_world_feet=p,
            v_world_feet=v,
            a_world_feet=a,
            q_joints=q,
            v_joints=np.zeros(12),
            a_joints=np.zeros(12),
        )
        if self._forces is None or not self._is_stepping:
            return reference
        return self._forces.update(snapshot, self._course(snapshot, command, phase), reference)

    def _phase(self, command: VelocityCommand, dt: float) -> ContactPhase:
        if not self._is_stepping:
            return standing().at(0.0)
        x, y, turn = self._velocity
        arm = np.hypot(*self._model.p_base_feet_nominal[0, :2])
        is_resting = command.is_zero and self._is_settled()
        self._clock.adapt(dt, float(np.hypot(x, y) + arm * abs(turn)), is_resting=is_resting)
        return self._clock.now()

    def _course(self, snapshot: Snapshot, command: VelocityCommand, phase: ContactPhase) -> Course:
        config = self._config
        remaining = np.where(phase.stance, 0.0, phase.remaining)
        return Course(
            gait=self._clock.gait,
            time=self._clock.time,
            yaw=self._yaw,
            position=np.array(
                [*self._position, self._ground + config.height + self._height_offset]
            ),
            velocity=self._velocity,
            command=np.array([command.linear_x, command.linear_y, command.angular_z]),
            acceleration=np.array([config.linear_acceleration] * 2 + [config.angular_acceleration]),
            footholds=self._footholds(snapshot, remaining),
            ground=self._ground,
        )

    def _advance_phase(self, snapshot: Snapshot, command: VelocityCommand, dt: float) -> None:
        if self._is_stepping:
            self._clock.time += dt
            if command.is_zero and self._is_landing() and self._may_stop(snapshot):
                self._is_stepping = False
        elif not command.is_zero or self._must_step(snapshot):
            self._is_stepping = True
            self._clock.restart()

    def _is_landing(self) -> bool:
        """Whether feet touch down at this tick and no other one is in the air."""
        stance = self._clock.now().stance
        has_landed = (stance & ~self._was_stance).any()
        return bool(has_landed and (stance | self._was_stance).all())

    def _may_stop(self, snapshot: Snapshot) -> bool:
        slow = np.linalg.norm(snapshot.v_world_com[:2]) < self._config.settle_speed
        return bool(slow and self._is_settled() and self._is_square(snapshot))

    def _is_square(self, snapshot: Snapshot) -> bool:
        """Whether the feet form the nominal rectangle; their mean may be off: the body moves."""
        offsets = snapshot.p_world_feet[:, :2] - self._nominal_feet(snapshot)
        offsets -= offsets.mean(axis=0)
        return bool(np.linalg.norm(offsets, axis=1).max() < self._config.square_tolerance)

    def _is_settled(self) -> bool:
        return bool(np.abs(self._velocity).max() < SETTLED_COMMAND)

    def _must_step(self, snapshot: Snapshot) -> bool:
        """Whether the capture point ``p + v / sqrt(g / h)`` is too far from the feet's middle."""
        omega = np.sqrt(self._model.gravity / self._config.height)
        capture = snapshot.p_world_com[:2] + snapshot.v_world_com[:2] / omega
        middle = snapshot.p_world_feet[:, :2].mean(axis=0)
        return bool(np.linalg.norm(capture - middle) > self._config.capture_margin)

    def _integrate(self, snapshot: Snapshot, command: VelocityCommand, dt: float) -> None:
        """Ramp the velocity towards ``command``, integrate it to the pose, and apply the leash.

        The velocity is in the heading frame; the heading is integrated first and turns it.
        """
        config = self._config
        wanted = np.array([command.linear_x, command.linear_y, command.angular_z])
        rate = np.array([config.linear_acceleration] * 2 + [config.angular_acceleration])
        self._velocity += np.clip(wanted - self._velocity, -rate * dt, rate * dt)
        self._yaw += self._velocity[2] * dt
        lead = wrap_angle(self._yaw - snapshot.state.yaw)
        self._yaw += np.clip(lead, -config.yaw_leash, config.yaw_leash) - lead
        self._position = self._position + self._world_velocity()[:2] * dt
        offset = self._position - snapshot.p_world_com[:2]
        distance = float(np.linalg.norm(offset))
        if distance > config.position_leash:
            self._position = snapshot.p_world_com[:2] + offset * (config.position_leash / distance)

    def _correct_height(self, snapshot: Snapshot, dt: float) -> None:
        """Integrate the CoM's height error: a payload makes the robot sag for good."""
        sag = self._ground + self._config.height - snapshot.p_world_com[2]
        error = np.array([0.0, 0.0, sag, 0.0, 0.0, 0.0])
        self._height_offset = float(self._correction.update(error, dt)[2])

    def _world_velocity(self) -> Float[np.ndarray, "3"]:
        return yaw_rotation(self._yaw) @ np.array([self._velocity[0], self._velocity[1], 0.0])

    def _body(self) -> BodyTarget:
        height = self._ground + self._config.height + self._height_offset
        return BodyTarget(
            point=TrackedPoint.COM,
            p_world=np.array([*self._position, height]),
            v_world=self._world_velocity(),
            a_world=np.zeros(3),
            R_world_base=yaw_rotation(self._yaw),
            w_world=np.array([0.0, 0.0, self._velocity[2]]),
            dw_world=np.zeros(3),
        )

    def _note_liftoffs(self, snapshot: Snapshot, stance: Bool[np.ndarray, "4"]) -> None:
        """Remember where feet leave the ground; low-pass its height where they meet it."""
        lifted = self._was_stance & ~stance
        self._liftoff[lifted] = snapshot.p_world_feet[lifted]
        self._is_awaited = (self._is_awaited | ~self._was_stance) & stance
        landed = self._is_awaited & snapshot.state.feet_in_contact
        if landed.any():
            height = float(np.mean(snapshot.p_world_feet[landed, 2])) - self._model.foot_radius
            self._ground += GROUND_SHARE * (height - self._ground)
        self._is_awaited &= ~landed
        self._was_stance = stance.copy()

    def _nominal_feet(self, snapshot: Snapshot) -> Float[np.ndarray, "4 2"]:
        """Points [m] on the ground below the hips of a level trunk with the measured heading."""
        R = yaw_rotation(snapshot.state.yaw)
        feet = self._model.p_base_feet_nominal @ R.T
        return snapshot.state.p_world_base[:2] + feet[:, :2]

    def _footholds(
        self, snapshot: Snapshot, remaining: Float[np.ndarray, "4"]
    ) -> Float[np.ndarray, "4 2"]:
        """Touchdown points [m]: ``p_hip + v t + v T / 2 + k (v - v_ref)``.

        ``t`` is the ``remaining`` time [s] of the swing, in which the hip moves on, ``T`` the
        stance time. ``v`` is the velocity of each hip: the CoM's and ``w x r`` of the turn about
        the base. The last two terms together are clipped to ``foothold_reach``.
        """
        config = self._config
        v = snapshot.v_world_com[:2]
        v_ref = self._world_velocity()[:2]
        hips = self._nominal_feet(snapshot)
        arms = hips - snapshot.state.p_world_base[:2]
        spin = self._velocity[2] * np.column_stack([-arms[:, 1], arms[:, 0]])
        velocity = v + spin
        travel = velocity * self._clock.gait.stance_time / 2 + config.velocity_feedback * (
            v - v_ref
        )
        length = np.linalg.norm(travel, axis=1, keepdims=True)
        reach = config.foothold_reach
        travel *= np.minimum(1.0, reach / np.maximum(length, _TINY))
        return hips + travel + velocity * remaining[:, None]

    def _feet(
        self, snapshot: Snapshot, phase: ContactPhase
    ) -> tuple[Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"]]:
        p, v, a = snapshot.p_world_feet.copy(), np.zeros((4, 3)), np.zeros((4, 3))
        swinging = ~phase.stance
        if not swinging.any():
            return p, v, a
        remaining = np.where(swinging, phase.remaining, 0.0)
        goals = self._footholds(snapshot, remaining)
        progress = phase.progress
        touchdown_height = self._ground + self._model.foot_radius
        for leg in LEGS:
            if swinging[leg]:
                goal = np.array([*goals[leg], touchdown_height])
                p[leg], v[leg], a[leg] = swing_foot(
                    self._liftoff[leg],
                    goal,
                    float(progress[leg]),
                    self._clock.gait.swing_time,
                    self._config.swing,
                )
        return p, v, a
