"""Numbers of the whole-body controller."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import SolverUnavailable, unknown_name
from go2_wbc.records import Array3
from go2_wbc.reference import LEAST_WEIGHT, MOST_WEIGHT
from go2_wbc.robot.motor import JointFriction
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, Rule, between, ranged
from go2_wbc.wbc.solvers import SOLVERS
from go2_wbc.world import RANGES

WEIGHTS = (1e-3, 1e3)
"""Least and greatest weight of a task. At all 16 corners of these ranges four solvers agree within
5e-4 N m on 39 random problems; with 1e-4 to 1e4, some report success with 9 N m between them."""
FORCE_WEIGHTS = (LEAST_WEIGHT, MOST_WEIGHT)
"""Least and greatest weight of the force regularisation, measured along."""

WEIGHT = between(*WEIGHTS)
WEIGHT_OR_NONE = Rule(WEIGHT.what, lambda value: value == 0.0 or WEIGHT.holds(value))
GREATEST_GAIN = 1e6
"""(2 / dt)^2 [1/s^2] at 500 ticks a second: a loop with more than that swings itself up."""


@typed()
@dataclass(frozen=True, slots=True)
@ranged(between(0.0, GREATEST_GAIN))
class Gains:
    """Proportional [1/s^2] and derivative [1/s] gain of a task, per axis."""

    kp: tuple[float, float, float]
    kd: tuple[float, float, float]

    @staticmethod
    def uniform(kp: float, kd: float) -> Gains:
        """The same gain on three axes."""
        return Gains((kp, kp, kp), (kd, kd, kd))

    @property
    def arrays(self) -> tuple[Array3, Array3]:
        """kp and kd as arrays."""
        return np.array(self.kp), np.array(self.kd)


@dataclass(frozen=True, slots=True)
@ranged(WEIGHT, limit_horizon=POSITIVE, friction=between(*RANGES["friction"]))
class DynamicWbcConfig:
    """Replacements for plans with flight phases or one or two stance feet, tuned on five seeds.

    Attributes:
        position_weight, orientation_weight: task weights. On two feet the force that moves the body
            also turns it. If the attitude is kept, the trunk falls over its feet: with 10 and 10
            the CoM of a rear-up of 25 deg is 110 mm off at its end. With these weights the robot
            ends 10 mm off; with 300 the attitude is 6 deg off on average.
        swing_weight: task weight. In flight only the legs turn the trunk: with the usual weight,
            which keeps its attitude, feet are 50 mm off their footholds when they land, the robot
            lands twice as far off, and motors are saturated for 2 to 6 times as long.
        limit_horizon: time [s] in which a joint-limit bound must be met. With 0.02 s the knees may
            not speed up as fast as a jump needs, which costs a quarter of its height.
        friction: mu of the cone of planned forces, and of the pyramid of others: 5 % less than the
            floor of 0.5 that such plans are solved for, to leave a margin for feedback. With 0.6,
            landing feet slid up to 30 mm on that floor.
    """

    position_weight: float = 150.0
    orientation_weight: float = 1.0
    swing_weight: float = 100.0
    limit_horizon: float = 0.01
    friction: float = 0.475


@typed()
@dataclass(frozen=True, slots=True)
@ranged(
    POSITIVE,
    position_weight=WEIGHT_OR_NONE,
    orientation_weight=WEIGHT_OR_NONE,
    swing_weight=WEIGHT,
    flight_weight=WEIGHT,
    friction=between(*RANGES["friction"]),
    posture_weight=WEIGHT,
    force_weight=between(*FORCE_WEIGHTS),
    torque_share=SHARE,
    speed_share=SHARE,
    stance_damping=NOT_NEGATIVE,
    joint_margin=NOT_NEGATIVE,
)
class WbcConfig:
    """Numbers of the whole-body controller.

    Gains are accelerations per unit of error [1/s^2] and [1/s]; they and the weights come from a
    search on this robot in simulation. Every field can be overridden in a TOML file.

    Attributes:
        solver: QP solver: active_set (compiled), daqp, proxqp or quadprog.
        body_position: CoM or base, world axes.
        body_orientation: base, base axes.
        swing_foot: Cartesian swing.
        leg_posture: joint-space legs. With (400, 36) joint friction holds a paw close to the ground
            16 mm off its position, a stamp from 0.3 m 30 mm; now 11 and 13.
        position_weight, orientation_weight, swing_weight, posture_weight: task weights, 1e-3 to
            1e3; the first two may be 0, but a leg in the air needs a goal.
        flight_weight: greatest weight of the orientation in flight, 1e-3 to 1e3. Only the legs turn
            the trunk then. With its usual weight, feet that swung forward at 3.3 m/s landed 0.1 m
            behind their footholds, and the robot fell over them.
        force_weight: of the force regularisation, 1e-6 to 100, or accuracy is lost.
        friction: mu of the friction pyramid.
        keeps_cone: whether a foot with a planned force keeps within the cone of ``friction``, where
            the pyramid allows 1.4 times as much on its diagonal. Plans with flights do: feet with
            little load after a landing slid 15 mm.
        torque_share: share of the motors' torque that may be used, at every speed.
        speed_share: share of the URDF's joint speed limit that may be used.
        stance_damping: damping rate [1/s] of the velocity of stance contact points.
        braking: joint deceleration [rad/s^2] that the joint limits assume.
        limit_horizon: time [s] in which a joint-limit bound must be met.
        joint_margin: distance [rad] that the joints keep from their position limits.
        joint_friction: friction of the joints, fed forward.
        dynamic: replacements for plans with flight phases or one or two stance feet.
    """

    solver: str = "active_set"
    body_position: Gains = Gains((60.0, 60.0, 100.0), (15.0, 15.0, 20.0))
    body_orientation: Gains = Gains((200.0, 200.0, 80.0), (25.0, 25.0, 18.0))
    swing_foot: Gains = Gains.uniform(500.0, 40.0)
    leg_posture: Gains = Gains.uniform(900.0, 54.0)
    position_weight: float = 1.0
    orientation_weight: float = 10.0
    swing_weight: float = 1.0
    flight_weight: float = 0.05
    posture_weight: float = 1.0
    force_weight: float = 1e-4
    friction: float = 0.6
    keeps_cone: bool = False
    torque_share: float = 1.0
    speed_share: float = 1.0
    stance_damping: float = 20.0
    braking: float = 200.0
    limit_horizon: float = 0.02
    joint_margin: float = 0.0
    joint_friction: JointFriction = field(default_factory=JointFriction)
    dynamic: DynamicWbcConfig = field(default_factory=DynamicWbcConfig)

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise SolverUnavailable for an unknown solver; lists the valid ones."""
        if self.solver not in SOLVERS:
            raise SolverUnavailable(unknown_name("QP solver", self.solver, SOLVERS))

    @property
    def for_dynamics(self) -> WbcConfig:
        """The same numbers, for plans with flights or few feet."""
        special = self.dynamic
        return replace(
            self,
            position_weight=special.position_weight,
            orientation_weight=special.orientation_weight,
            flight_weight=special.orientation_weight,
            swing_weight=special.swing_weight,
            limit_horizon=special.limit_horizon,
            friction=min(special.friction, self.friction),
            keeps_cone=True,
        )
