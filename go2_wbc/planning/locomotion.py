"""Velocity command -> Reference: footholds, swing feet and the body's path of a gait.

Every quantity is in the world frame unless its name says otherwise; commands are in the heading
frame (z up, x along the reference's yaw).

- Footholds: Raibert (Legged Robots That Balance, 1986, ch. 2). A foot that is put down
  ``v T / 2`` ahead of its hip is below it in the middle of the stance time ``T``, so it neither
  speeds the trunk up nor slows it down; ``k (v - v_ref)`` more takes out the velocity error.
- Body: the command is integrated to a pose. A body that only followed a velocity would keep a
  steady error of place and heading. The pose is held within reach (a leash) of the measured one,
  so that a robot that is held does not store up a way to jump afterwards. It is the CoM's, with
  the snapshot's payload, and the footholds are moved as that moves the CoM.
- Ground: its height is learnt from the feet that should stand, each where its contact is first
  measured. A foot that comes down late has no contact yet when it should; taken for landed, it
  would raise the ground, and with it the trunk, step by step.
- Stepping without a command: the capture point (Pratt et al., Capture Point, Humanoids 2006),
  ``p + v / omega`` with ``omega = sqrt(g / h)``, is where an inverted pendulum of height ``h``
  would come to rest above its foot; too far from the feet's middle, they must be moved there.
"""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field, fields

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import TIE, ContactPhase, Gait, standing
from go2_wbc.errors import ConfigError
from go2_wbc.kernels.layout import MPC_NODES
from go2_wbc.legs import LEGS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.contact import ContactConfig, FootContacts
from go2_wbc.planning.gait_clock import GaitClock
from go2_wbc.planning.gait_planner import GaitPlanner
from go2_wbc.planning.ground import GroundConfig, GroundPlane
from go2_wbc.planning.mpc import MpcConfig
from go2_wbc.planning.pose import LEVEL, BodyPose, PoseConfig
from go2_wbc.planning.preview import Course, ForcePlanner, beyond
from go2_wbc.planning.slip import SlipConfig, SlipObserver
from go2_wbc.planning.swing import Swing, SwingConfig
from go2_wbc.planning.trunk import TrunkLimits, TrunkPath
from go2_wbc.reference import LegTask, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import turned, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative, require_positive, warn_retired

LEAST_HEIGHT, GREATEST_HEIGHT = 0.18, 0.34
"""CoM heights [m] between which the legs can step."""
MID_SWING = 0.2
"""Share of a swing before and after its middle in which a foot that has contact stumbles."""
_TINY = 1e-9
"""Length [m] that stands in for zero where one divides by it."""
_RETIRED_RAMP = 0.03
"""Time [s] that ``LocomotionConfig.load_ramp`` was by default."""


@dataclass(frozen=True, slots=True)
class LocomotionConfig:
    """Numbers of the locomotion planner, from a search on this robot in simulation.

    Attributes:
        height: CoM height [m] above the ground.
        compression: by which feet under the trunk's weight are pressed flat, or into the ground,
            [m]: in MuJoCo 1 to 6 mm, by the friction of the joints.
        linear_acceleration: greatest change of the commanded velocity [m/s^2].
        angular_acceleration: greatest change of the commanded turning rate [rad/s^2].
        velocity_feedback: foothold offset [s] per velocity error.
        stride_margin: speed [m/s] that the robot may have beyond the commanded one before the
            stride follows it. A push of 50 N s throws it to 3.4 m/s: on a foot that stands as long
            as at 0.5 m/s the trunk then travels half a metre, and falls.
        position_leash: distance [m] that the reference may run ahead of the robot.
        yaw_leash: angle [rad] that the heading reference may run ahead.
        foothold_reach: greatest horizontal distance [m] of a foothold from below its hip.
        normal_force_min: least normal force [N] asked of a stance foot.
        normal_force_max: greatest normal force [N] allowed on a stance foot.
        settle_speed: speed [m/s] below which a robot without command may stop stepping.
        capture_margin: distance [m] of the capture point from the middle of the feet beyond
            which a standing robot starts to step.
        square_tolerance: distance [m] of a foot from below its hip at which the robot stands
            squarely enough to stop stepping.
        swing: shape of the swing.
        slip: estimate of the friction.
        contact: when measured contacts count.
        ground: estimate of its slope and roughness.
        mpc: planning of the forces ahead.
        pose: how a new pose of the trunk is approached.

    ``load_ramp`` is retired: ``mpc.load_ramp`` is the one that counts.
    """

    height: float = 0.29
    compression: float = 0.004
    linear_acceleration: float = 1.5
    angular_acceleration: float = 4.0
    velocity_feedback: float = 0.12
    stride_margin: float = 0.4
    position_leash: float = 0.08
    yaw_leash: float = 0.3
    foothold_reach: float = 0.22
    normal_force_min: float = 0.0
    normal_force_max: float = 400.0
    load_ramp: InitVar[float] = _RETIRED_RAMP
    settle_speed: float = 0.05
    capture_margin: float = 0.09
    square_tolerance: float = 0.02
    swing: SwingConfig = field(default_factory=SwingConfig)
    slip: SlipConfig = field(default_factory=SlipConfig)
    contact: ContactConfig = field(default_factory=ContactConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    mpc: MpcConfig = field(default_factory=MpcConfig)
    pose: PoseConfig = field(default_factory=PoseConfig)

    def __post_init__(self, load_ramp: float) -> None:
        """Raise ConfigError for a number that is out of range."""
        if load_ramp != _RETIRED_RAMP:
            warn_retired("LocomotionConfig.load_ramp", "LocomotionConfig.mpc.load_ramp counts")
        zero_is_valid = {"velocity_feedback", "normal_force_min", "compression"}
        parts = {"swing", "slip", "contact", "ground", "mpc", "pose"}
        positive = {f.name for f in fields(self)} - zero_is_valid - parts
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

    @property
    def height_on_feet(self) -> float:
        """CoM height [m] above where feet that stayed round would end."""
        return self.height + self.compression

    @property
    def trunk_limits(self) -> TrunkLimits:
        """How fast the trunk's reference changes, and how far it may run ahead."""
        rate = np.array([self.linear_acceleration] * 2 + [self.angular_acceleration])
        return TrunkLimits(rate, self.position_leash, self.yaw_leash, self.pose)


class LocomotionPlanner(GaitPlanner):
    """The planner in its readable form, to which ``compiled.CompiledPlanner`` is held."""

    _trunk: TrunkPath
    _slip: SlipObserver
    _contacts: FootContacts
    _ground: GroundPlane

    def __init__(self, model: RobotModel, gait: Gait, config: LocomotionConfig) -> None:
        """Prepare a planner; ``start`` sets it on its way."""
        self._model = model
        self._config = config
        self._forces = ForcePlanner(model, config.mpc)
        self._clock = GaitClock(gait)
        self.change_gait(gait)
        self._is_stepping = False
        self._has_started = False

    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state, standing."""
        self._trunk = TrunkPath(snapshot, self._config.trunk_limits)
        self._slip = SlipObserver(self._config.slip)
        self._contacts = FootContacts(self._config.contact)
        self._has_started, self._is_stepping = True, False
        self._clock.restart()
        self._forces.start()
        self._last_time = snapshot.state.time
        self._ground = GroundPlane(snapshot, self._model.foot_radius, self._config.ground)
        self._swings = [Swing(foot) for foot in snapshot.p_world_feet]
        self._was_stance = np.ones(4, dtype=bool)
        self._is_awaited = np.zeros(4, dtype=bool)

    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``; see ``GaitPlanner``."""
        self._clock.change(gait)
        self._swing = self._config.swing.at_most(gait.apex)
        self._forces.start()

    @property
    def velocity(self) -> Float[np.ndarray, "3"]:
        """Ramped command; see ``GaitPlanner``."""
        return self._trunk.velocity.copy() if self._has_started else np.zeros(3)

    @property
    def is_stepping(self) -> bool:
        """Whether the gait is running; not before ``start``."""
        return self._is_stepping

    @property
    def heading(self) -> float:
        """Yaw [rad] of the reference; 0 before ``start``."""
        return self._trunk.yaw if self._has_started else 0.0

    def square_up(self, snapshot: Snapshot) -> bool:
        """Start stepping unless every foot is below its hip; returns whether they all are."""
        self._is_stepping = not self._is_square(snapshot)
        self._clock.restart()
        return not self._is_stepping

    def update(
        self, snapshot: Snapshot, command: VelocityCommand, pose: BodyPose = LEVEL
    ) -> Reference:
        """The reference of this tick; see ``GaitPlanner``."""
        dt = snapshot.state.time - self._last_time
        self._last_time = snapshot.state.time
        self._advance_phase(snapshot, command, dt)
        self._trunk.integrate(snapshot, command, pose, dt)
        self._ground.carry(snapshot)
        self._trunk.correct_height(snapshot, self._ground.height + self._config.height_on_feet, dt)
        phase = self._phase(snapshot, command, dt)
        self._contacts.update(snapshot, phase, self._ground.above(snapshot.p_world_feet), dt)
        stance = self._contacts.stance
        self._slip.update(snapshot, stance, dt)
        self._note_liftoffs(snapshot, phase)
        p, v, a = self._feet(snapshot, phase)
        legs = tuple(LegTask.STANCE if s else LegTask.SWING for s in stance)
        q = snapshot.state.joint_positions
        load = self._contacts.load_share(phase, self._config.mpc.load_ramp)
        body = self._trunk.target(self._ground, self._config.height_on_feet)
        reference = Reference(
            body=self._trunk.levelled(body, snapshot, dt, is_stepping=self._is_stepping),
            legs=legs,
            normal_force_min=self._config.normal_force_min * load,
            normal_force_max=self._config.normal_force_max * load,
            p_world_feet=p,
            v_world_feet=v,
            a_world_feet=a,
            q_joints=q,
            v_joints=np.zeros(12),
            a_joints=np.zeros(12),
            friction=self._friction,
        )
        if not self._is_stepping:
            return reference
        course = self._course(snapshot, command, pose, phase)
        return self._forces.update(snapshot, course, reference)

    @property
    def _friction(self) -> float:
        """Greatest coefficient that feet may count on, seen in the world's axes."""
        return self._ground.level_friction(self._slip.friction, self._config.slip.least)

    def _phase(self, snapshot: Snapshot, command: VelocityCommand, dt: float) -> ContactPhase:
        if not self._is_stepping:
            return standing().at(0.0)
        x, y, turn = self._trunk.velocity
        arm = np.hypot(*self._model.p_base_feet_nominal[0, :2])
        wanted = float(np.hypot(x, y))
        thrown = float(np.linalg.norm(snapshot.v_world_com[:2])) - self._config.stride_margin
        self._clock.adapt(
            dt,
            max(wanted, thrown) + float(arm * abs(turn)),
            is_resting=command.is_zero and self._trunk.is_settled,
            is_thrown=thrown > wanted,
        )
        return self._clock.now()

    def _course(
        self, snapshot: Snapshot, command: VelocityCommand, pose: BodyPose, phase: ContactPhase
    ) -> Course:
        config = self._config
        remaining = np.where(phase.stance, 0.0, phase.remaining)
        error = snapshot.v_world_com[:2] - self._trunk.world_velocity[:2]
        return Course(
            gait=self._clock.gait,
            time=self._clock.time,
            yaw=self._trunk.yaw,
            position=self._trunk.place(self._ground, config.height_on_feet),
            velocity=self._trunk.velocity,
            command=np.array([command.linear_x, command.linear_y, command.angular_z]),
            lean=self._trunk.pose.pose,
            leaning=self._trunk.pose.ahead(pose, config.mpc.step, MPC_NODES),
            acceleration=config.trunk_limits.rate,
            footholds=self._footholds(snapshot, remaining),
            ground=self._ground,
            friction=self._friction,
            excess=beyond(error, config.stride_margin),
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
        return bool(slow and self._trunk.is_settled and self._is_square(snapshot))

    def _is_square(self, snapshot: Snapshot) -> bool:
        """Whether the feet form the nominal rectangle; their mean may be off: the body moves."""
        offsets = snapshot.p_world_feet[:, :2] - self._nominal_feet(snapshot, self._clock.rest)
        offsets -= offsets.mean(axis=0)
        return bool(np.linalg.norm(offsets, axis=1).max() < self._config.square_tolerance)

    def _must_step(self, snapshot: Snapshot) -> bool:
        """Whether the capture point ``p + v / sqrt(g / h)`` is too far from the feet's middle."""
        omega = np.sqrt(self._model.gravity / self._config.height_on_feet)
        capture = snapshot.p_world_com[:2] + snapshot.v_world_com[:2] / omega
        middle = snapshot.p_world_feet[:, :2].mean(axis=0)
        return bool(np.linalg.norm(capture - middle) > self._config.capture_margin)

    def _note_liftoffs(self, snapshot: Snapshot, phase: ContactPhase) -> None:
        """Remember where feet leave the ground; learn of it where they meet it."""
        stance, contact = phase.stance, snapshot.state.feet_in_contact
        for leg in np.flatnonzero(self._was_stance & ~stance):
            self._swings[leg] = Swing.from_ground(snapshot.p_world_feet[leg], self._ground)
        self._is_awaited = (self._is_awaited | ~self._was_stance) & stance
        landed = self._is_awaited & contact
        if landed.any():
            self._ground.learn(snapshot.p_world_feet, landed)
        is_middle = np.abs(phase.progress - 0.5) <= MID_SWING + TIE
        for leg in np.flatnonzero(contact & ~stance & is_middle):
            self._ground.stumble()
            self._swings[leg] = self._swings[leg].resumed(
                snapshot.p_world_feet[leg], float(phase.progress[leg]), self._ground
            )
        self._is_awaited &= ~landed
        self._was_stance = stance.copy()

    def _nominal_feet(self, snapshot: Snapshot, gait: Gait) -> Float[np.ndarray, "4 2"]:
        """Points [m] on the ground below the hips of a level trunk with the measured heading.

        A payload moves them as it does the CoM, which so stays above the feet's middle.
        """
        R = yaw_rotation(snapshot.state.yaw - self._trunk.pose.pose[3])
        feet = gait.placed(self._model.p_base_feet_nominal) @ R.T
        return snapshot.state.p_world_base[:2] + feet[:, :2] + snapshot.com_shift[:2]

    def _footholds(
        self, snapshot: Snapshot, remaining: Float[np.ndarray, "4"]
    ) -> Float[np.ndarray, "4 2"]:
        """Touchdown points [m]: ``p_hip + v t + v T / 2 + k (v - v_ref) - (h / g) w x v_ref``.

        ``t`` is the ``remaining`` time [s] of the swing, in which the hip moves on, ``T`` the
        stance time. Besides with ``v``, that of the CoM, the hips move on circles about the base,
        by ``w t`` and ``w T / 2``: along their tangents the feet of a turn at 6 rad/s went 5 cm
        outside of them in mid-swing. In a curve a trunk of height ``h`` needs the force
        ``m w x v_ref``, whose moment about the CoM the feet balance that much farther outside. The
        last three terms together are clipped to ``foothold_reach``.
        """
        config = self._config
        v = snapshot.v_world_com[:2]
        v_ref = self._trunk.world_velocity[:2]
        hips = self._nominal_feet(snapshot, self._clock.gait)
        arms = hips - snapshot.state.p_world_base[:2]
        half, rate = self._clock.gait.stance_time / 2, self._trunk.velocity[2]
        there = turned(arms, rate * remaining)
        travel = v * half + turned(there, np.full(4, rate * half)) - there
        travel += config.velocity_feedback * (v - v_ref)
        lean = rate * config.height_on_feet / self._model.gravity
        travel += lean * np.array([v_ref[1], -v_ref[0]])
        length = np.linalg.norm(travel, axis=1, keepdims=True)
        reach = config.foothold_reach
        travel *= np.minimum(1.0, reach / np.maximum(length, _TINY))
        return hips - arms + there + travel + v * remaining[:, None]

    def _feet(
        self, snapshot: Snapshot, phase: ContactPhase
    ) -> tuple[Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"]]:
        p, v, a = snapshot.p_world_feet.copy(), np.zeros((4, 3)), np.zeros((4, 3))
        if self._contacts.stance.all():
            return p, v, a
        remaining = np.where(phase.stance, 0.0, phase.remaining)
        goals = self._footholds(snapshot, remaining)
        for leg in LEGS:
            if not self._contacts.stance[leg]:
                height = self._ground.at(goals[leg]) + self._model.foot_radius
                p[leg], v[leg], a[leg] = self._swings[leg].at(
                    np.array([*goals[leg], height]),
                    float(phase.progress[leg]),
                    self._clock.gait.swing_time,
                    self._swing,
                )
        return p, v, a
