"""What the state estimator is told of its sensors and of feet: see ``robot.estimator``."""

from __future__ import annotations

from dataclasses import dataclass

from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError
from go2_wbc.validation import POSITIVE, ranged


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class EstimatorConfig:
    """Standard deviations of what the filter is told, and when a foot counts as on the ground.

    Own tuning in simulation, from the values of MIT's published code for the Cheetah 3 on.
    """

    acceleration: float = 0.2  #: of the accelerometer, per sample [m/s^2]
    foot_drift: float = 0.05  #: speed of a standing foot that rolling does not explain [m/s]
    drift_share: float = 0.2
    """The same, by which it grows with the foot's speed along the trunk [m/s per m/s]: turning feet
    creep so that the trunk seems to turn faster."""
    settled_drift: float = 0.005  #: that speed once the foot has stood for ``settled_time`` [m/s]
    settled_time: float = 0.45
    """Time [s] after which a foot has settled: no stride of a gait stands so long."""
    place: float = 0.002  #: of a foot's place by kinematics [m]
    velocity: float = 0.05  #: of the velocity by one standing foot [m/s]
    velocity_share: float = 0.05
    """The same, by which it grows with the foot's speed along the trunk."""
    height: float = 0.005
    """Of the ground where a foot comes down, against the level it stands on [m]."""
    uneven: float = 0.04
    """Distance [m] from every level that is known at which a foot has come down on another one.
    Heavy legs sink by 20 mm into MuJoCo's floor as they land; taken for steps, that left the height
    to feet which spring back, and it drifted by 0.1 m/s."""
    terrace: float = 0.012
    """Distance [m] from a known level up to which a foot may stand on it. Between that and
    ``uneven`` the ground is not in levels: no height is taken in for a while."""
    uneven_time: float = 1.0
    """Time [s] after which it counts as level again, where it is then. With 2 s the height was left
    to feet that spring back for 1 m behind what is uneven: 2 cm."""
    contact_force: float = 10.0
    """Force [N] above which a foot counts as touching: five deviations of its noise. A foot felt in
    the middle of its swing is taken for a stone: the trunk of a trot on the level went up and down
    by 20 mm."""
    trusted_force: float = 30.0  #: force [N] from which on a foot is fully believed to stand
    rest: float = 0.3  #: of the assumption that a robot whose feet carry nothing lies still [m/s]
    lying_time: float = 0.1
    """Time [s] after which a robot is taken to lie that neither its feet carry nor falls freely."""
    gyro: float = 0.02  #: of the gyro, per sample [rad/s]
    gyro_bias: float = 0.02  #: of its bias at the start [rad/s]
    gyro_bias_walk: float = 1e-4  #: by which that changes in a second [rad/s]
    accelerometer_bias: float = 0.05  #: of the accelerometer's bias at the start [m/s^2]
    accelerometer_bias_walk: float = 1e-3  #: by which that changes in a second [m/s^2]
    learning_speed: float = 1.0
    """Speed of the trunk [m/s] at which half of what corrects the biases is believed. A foot creeps
    ahead as it comes down and back as it pushes off, in step with the trunk's bouncing: fast, that
    looks like a tilt, and a bias that hides it."""
    tilt: float = 0.02  #: of roll and pitch at the start, by the accelerometer [rad]
    slip: float = 3.0
    """Deviations of a standing foot's velocity above which it is taken for slipping."""
    still_time: float = 0.3  #: time [s] after which what reads as rest is taken for it
    still_joints: float = 0.03
    """Root of the mean square of the joints' smoothed velocities at rest [rad/s]."""
    still_turning: float = 0.12  #: angular velocity at rest [rad/s]
    still_force: float = 0.6
    """By which the accelerometer's length differs from gravity at rest [m/s^2]."""
    still_velocity: float = 0.02  #: of the velocity at rest [m/s]
    still_gyro: float = 0.05  #: of the gyro's bias by one reading at rest, swaying included [rad/s]
    still_drift: float = 0.0005  #: speed of a foot at rest [m/s]
    touchdown_slip: float = 1.5  #: speed of a foot's centre when it has just come down [m/s]
    touchdown_time: float = 0.009  #: in which that decays by 1 / e [s]
    vertical: float = 0.1  #: speed at which a standing foot is pressed flat and springs back [m/s]
    vertical_share: float = 0.1
    """The same, by which it grows with the trunk's speed [m/s per m/s]: at speed a pitch is as good
    a reason for what feet spring back."""
    landing: float = 5.0
    """What is added to ``vertical`` at touchdown [m/s]: a foot that comes down hard sinks in and
    springs back, and pulled the height down by 1 cm at each step of stairs."""
    landing_time: float = 0.05  #: in which that decays by 1 / e [s]
    compliance: float = 5e-5
    """By which a foot's sphere is pressed flat [m/N]; it rolls on its middle."""
    creep: float = 0.025
    """Speed [m/s] by which a walking robot's feet creep downhill, times the slope's sine: 9 mm/s on
    20 deg, by MuJoCo's soft friction. Along a plane nothing else shows it."""
    longest_step: float = 0.1  #: time [s] between two readings after which the filter begins anew

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for forces the wrong way round."""
        if self.trusted_force <= self.contact_force:
            raise ConfigError(
                f"trusted_force must be above contact_force ({self.contact_force:g} N), "
                f"got {self.trusted_force:g} N"
            )
