"""What a walk is told, its configuration, and what it remembers from tick to tick."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.compilation import subroutine
from go2_wbc.contacts import Gait
from go2_wbc.errors import ConfigError
from go2_wbc.planning import ground, slip, swing
from go2_wbc.planning.gait_clock import Cadence, Clock
from go2_wbc.planning.ground import Ground, RoughConfig
from go2_wbc.planning.mpc import Horizon, MpcConfig
from go2_wbc.planning.sight import Sight
from go2_wbc.planning.slip import Slip
from go2_wbc.planning.swing import FootContact, Step, Swing, SwingConfig
from go2_wbc.planning.trunk import PoseConfig, Trunk
from go2_wbc.records import Array4, Record
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, Retired, past_table, ranged, retires

LEAST_HEIGHT, GREATEST_HEIGHT = 0.18, 0.34  #: CoM heights [m] between which the legs can step


@typed()
@dataclass(frozen=True, slots=True)
@retires(
    load_ramp=Retired(0.03, "LocomotionConfig.mpc.load_ramp counts"),
    contact=past_table("contact", earliest=swing.EARLIEST, step=swing.STEP),
    ground=past_table(
        "ground",
        slope_share=ground.SLOPE_SHARE,
        follow=ground.FOLLOW,
        smooth=ground.SMOOTH,
        most_raise=ground.MOST_RAISE,
        calming=ground.CALMING,
        stumble=ground.STUMBLE,
        delay=ground.DELAY,
    ),
    slip=past_table(
        "slip",
        speed=slip.SLIP_SPEED,
        patience=slip.SLIP_PATIENCE,
        mask=slip.TOUCHDOWN_MASK,
        steepness=slip.MOST_STEEPNESS,
        time_constant=slip.FRICTION_FALL_TIME,
        recovery=slip.FRICTION_RISE,
        least=slip.LEAST_FRICTION,
        most=slip.MOST_FRICTION,
        half_speed=slip.HALF_SPEED,
    ),
)
@ranged(
    POSITIVE,
    compression=NOT_NEGATIVE,
    velocity_feedback=NOT_NEGATIVE,
    normal_force_min=NOT_NEGATIVE,
)
class LocomotionConfig:
    """Numbers of the locomotion planner, from a search on this robot in simulation."""

    height: float = 0.29  #: CoM height [m] above the ground
    compression: float = 0.004
    """By which feet are compressed, or sink into the ground, under the trunk's weight [m]: in
    MuJoCo 1 to 6 mm, by the friction of the joints."""
    linear_acceleration: float = 6.0
    """Greatest change of the commanded velocity [m/s^2], where the ground bears it and commands act
    at once; else reduced by ``ground.haste``."""
    angular_acceleration: float = 4.0  #: greatest change of the commanded turning rate [rad/s^2]
    velocity_feedback: float = 0.12  #: foothold offset [s] per velocity error
    stride_margin: float = 0.4
    """Speed [m/s] beyond the commanded one from which on the stride follows the measured speed. A
    push of 50 N s makes the robot 3.4 m/s fast: with the stance time of 0.5 m/s the trunk then
    travels half a metre, and falls."""
    position_leash: float = 0.08  #: distance [m] that the reference may run ahead of the robot
    yaw_leash: float = 0.3  #: angle [rad] that the heading reference may run ahead
    foothold_reach: float = 0.22
    """Greatest horizontal distance [m] of a foothold from below its hip."""
    normal_force_min: float = 0.0  #: least normal force [N] required of a stance foot
    normal_force_max: float = 400.0  #: greatest normal force [N] allowed on a stance foot
    settle_speed: float = 0.05  #: speed [m/s] below which a robot without command may stop stepping
    capture_margin: float = 0.09
    """Distance [m] of the capture point from the middle of the feet beyond which a standing robot
    starts to step."""
    square_tolerance: float = 0.02
    """Distance [m] of a foot from below its hip at which the robot stands squarely enough to stop
    stepping."""
    ground_friction: float = 0.2
    """Assumed coefficient of the ground until the robot has walked on it. Walking, with and without
    slip, updates the estimate, and the next walk begins with that."""
    swing: SwingConfig = field(default_factory=SwingConfig)  #: shape of the swing
    mpc: MpcConfig = field(default_factory=MpcConfig)  #: the MPC of the contact forces
    pose: PoseConfig = field(default_factory=PoseConfig)
    """How a new pose of the trunk is approached."""
    rough: RoughConfig = field(default_factory=RoughConfig)  #: how it walks on rough ground

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for a height that the legs have not, or forces without a range."""
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


@dataclass(frozen=True, slots=True)
class Walk:
    """The numbers of a walk."""

    config: LocomotionConfig  #: of the planner, with the apex of the gait's swing
    cadence: Cadence  #: the gait
    height: float  #: of the CoM above where feet that stayed round would end [m]
    mass: float  #: of the robot [kg]
    gravity: float  #: [m/s^2]
    foot_radius: float  #: [m]
    p_base_feet_nominal: Float[np.ndarray, "4 3"]
    """Places of the feet below the hips, from the base [m]."""
    stands_beside_com: bool  #: whether at times only the feet of one side, or of one end, stand
    p_base_hips: Float[np.ndarray, "4 3"]
    """Where the thighs' axes meet the legs' planes, in the base frame [m]."""
    link: float  #: length of a thigh, and of a calf [m]
    knees: Array4  #: at which angle [rad] each leg is as straight as it gets

    @staticmethod
    def of(model: RobotModel, gait: Gait, config: LocomotionConfig) -> Walk:
        """Those of a robot that walks with ``gait``."""
        legs = leg_table(model).geometry
        return Walk(
            replace(config, swing=config.swing.at_most(gait.apex)),
            Cadence.of(gait, config.rough),
            config.height_on_feet,
            model.mass,
            model.gravity,
            model.foot_radius,
            model.p_base_feet_nominal,
            gait.stands_beside_com,
            np.array([leg.p_base_hip + [0.0, leg.width, 0.0] for leg in legs]),
            0.5 * (legs[0].thigh + legs[0].calf),
            model.q_upper[2::3],
        )


class Foot(Record):
    """What the planner remembers of a foot: its contact, its swing, and that by sight."""

    contact: FootContact
    swing: Swing
    step: Step


class Rest(Record):
    """How the robot comes to rest."""

    landings: float  #: how often feet have come down since it has had no command
    place: Float[np.ndarray, "2"]  #: where the CoM shall be while the robot rests [m]
    middle: Float[np.ndarray, "3"]  #: of the feet at the last tick at rest [m]


class PlannedForces(Record):
    """What the MPC has planned last."""

    next: float  #: when [s] it plans again
    f_world_feet: Float[np.ndarray, "4 3"]  #: force [N] of each foot while it stands


class Planner(Record):
    """State of the locomotion planner."""

    time: float  #: of the last tick [s]
    is_stepping: bool  #: whether the gait is running
    delay: float  #: after which commands act [s]
    clock: Clock
    trunk: Trunk
    ground: Ground
    slip: Slip
    rest: Rest
    feet: tuple[Foot, Foot, Foot, Foot]
    planned: PlannedForces
    horizon: Horizon  #: what the MPC has looked at last
    sight: Sight


@subroutine
def carried_height(s: Planner, c: Walk) -> float:
    """Height [m] of the CoM above the ground at which it is carried."""
    return c.height + s.sight.lift + s.ground.lift
