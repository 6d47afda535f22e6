"""Mass and place of what the robot carries, from the forces that its standing feet bear.

The payload is what the balance of forces lacks (Tournois et al., Online Payload Identification for
Quadruped Robots, IROS 2017), here of the robot in motion: with the torques tau that acted since the
last tick and the acceleration a that came of them, a leg's rows of the equations of motion give the
force of its foot, and the base's rows what is left over,

    J_l' f_l = M_l a + h_l - tau_l + friction,    w = sum J_b' f - (M_b a + h_b)

A foot without measured contact bears nothing. What is left is what the payload takes: the force
m (a_p + g) and its moment. The means of w and of a + g over some time obey the same law, whatever
shakes the robot, so m is the ratio of the forces, and the place is the lever of their moment.

- The moment is taken about a point on the ground: friction in the joints that is not known looks
  like a force along the ground at the feet, which has no lever there.
- How high the payload lies cannot be felt on level ground: it is taken to lie as high as the
  robot's own CoM.
- A robot that carries nothing is a little heavier or lighter than its model, and dry friction
  holds up to a few kilograms. So nothing is believed below the thresholds of ``PayloadConfig``, and
  a robot without payload is controlled as if there were no estimate; beyond them the belief follows
  what is felt slowly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from go2_wbc.algebra.linear import cross, plus, plus_scaled, put, solve_linear, triple
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.records import V3, Array3, Array6, Array12, Array18, Record, packed
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction, friction_torque
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload
from go2_wbc.robot.state import RobotState, Snapshot
from go2_wbc.validation import FINITE, POSITIVE, SHARE, between, ranged, require

PERIOD = 0.02
"""Time [s] from one change of the belief to the next: much less than its response takes."""
NOTHING = 0.02  #: Mass [kg] at which a belief that fades has ended


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, release=SHARE, middle=FINITE)
class PayloadConfig:
    """Numbers of the estimate of the payload.

    The thresholds lie above what was estimated of a robot without payload in simulation, with all
    masses 10 % wrong, in every gait, also on its sensors: 1.9 kg, 0.06 kg m ahead and 0.04 aside.
    On joints with twice the friction, or that of other models of a Go2, it was 3.8 kg, 0.18 and
    0.04 kg m; on slopes of 15 deg 0.18 and 0.14 kg m.
    """

    enabled: bool = True
    """Whether a payload is estimated. The back end "placo", which has a robot of its own, does not
    use the estimate."""
    memory: float = 0.5  #: time constant [s] of the means
    response: float = 0.5
    """Time constant [s] with which the estimate in use follows the measured one."""
    centred_mass: float = 4.0  #: mass [kg] from which on a payload counts wherever it lies
    least_mass: float = 1.0  #: mass [kg] from which on one that lies beside the middle counts
    least_moment: tuple[float, float] = (0.25, 0.15)
    """First moment [kg m] about the middle, ahead and aside, from which on it does."""
    patience: float = 0.5
    """Time [s] for which it must be measured before it counts: impacts on the trunk or a leg are
    shorter."""
    release: float = 0.7  #: share of the thresholds below which it no longer counts
    most_mass: float = 10.0  #: greatest mass [kg] of the estimate
    reach: tuple[float, float] = (0.2, 0.1)
    """Greatest distance [m] of the estimate from the middle, ahead and aside."""
    middle: tuple[float, float, float] = (0.0, 0.0, -0.019)
    """Own CoM of the standing robot in the base frame [m]."""
    base_height: float = 0.31  #: of the base's origin over the ground, standing [m]
    least_height: float = 0.15
    """Of the base over the lowest foot, below which the belly may carry [m]."""
    most_rise: float = 0.1
    """Vertical speed [m/s] of the CoM beyond which nothing is estimated: friction in the joints of
    a rising robot looks like a load."""
    most_speed: tuple[float, float] = (1.5, 0.4)
    """Of the base, ahead and aside [m/s]: beyond it friction looks like a load that lies ahead, or
    aside."""

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for a middle that is not in the robot."""
        require(self, between(-self.base_height, self.base_height), "middle")


@dataclass(frozen=True, slots=True)
class PayloadNumbers:
    """What the wrench of a payload is computed with, besides the snapshot."""

    config: PayloadConfig  #: when anything is felt
    gravity: float  #: [m/s^2]
    friction: JointFriction  #: what the joints take of the torques


class PayloadWrench(Record):
    """What a payload takes of the standing feet, in the base frame."""

    force: Array3  #: [N]
    moment: Array3  #: about the base's origin [N m]
    weight: Array3  #: of a unit of mass, by gravity and the base's acceleration [m/s^2]


@subroutine
def can_feel(now: Snapshot, contact: Foreign[Bool[np.ndarray, "4"]], c: PayloadConfig) -> bool:
    """Whether the feet alone carry the robot, and friction of the joints does not mask the load."""
    lowest, touches = np.inf, False
    for leg in range(4):
        lowest = min(lowest, now.p_world_feet[leg, 2])
        touches = touches or contact[leg]
    if not touches or now.q[2] - lowest < c.least_height:
        return False
    is_slow = abs(now.v[0]) <= c.most_speed[0] and abs(now.v[1]) <= c.most_speed[1]
    return bool(is_slow and abs(now.v_world_com[2]) <= c.most_rise)


@subroutine
def forces_needed(now: Snapshot, a: Array18, needed: Array18) -> None:
    """Fill M a + h."""
    for i in range(18):
        needed[i] = now.bias[i]
        for k in range(18):
            needed[i] += now.mass_matrix[i, k] * a[k]


@subroutine
def add_foot(
    now: Snapshot, leg: int, tau: Foreign[Array12], c: PayloadNumbers, needed: Array18, left: Array6
) -> bool:
    """Add the wrench on the base of a foot's force to ``left``; False if the leg is singular."""
    J, system = now.J_contacts[leg], np.empty((3, 4))
    for i in range(3):
        n = 3 * leg + i
        taken = friction_torque(c.friction, n, now.v[6 + n], 0.0)
        system[i, 3] = needed[6 + n] - tau[n] + taken
        for k in range(3):
            system[i, k] = J[k, 6 + n]
    if not solve_linear(system, 3):
        return False
    for i in range(6):
        for k in range(3):
            left[i] += J[k, i] * system[k, 3]
    return True


@subroutine
def weight_of_mass(now: Snapshot, a: Array18, gravity: float) -> V3:
    """Acceleration of the base, with gravity, in its own frame: what a unit of mass weighs."""
    v, w = triple(now.v[:3]), triple(now.v[3:6])
    moved = plus((a[0], a[1], a[2]), cross(w, v))
    return plus_scaled(moved, gravity, triple(now.R_world_base[2]))


@kernel
def follow_wrench(
    now: Snapshot,
    v_before: Foreign[Array18],
    tau: Foreign[Array12],
    contact: Foreign[Bool[np.ndarray, "4"]],
    dt: float,
    place: Array3,
    c: PayloadNumbers,
    mean: PayloadWrench,
) -> None:
    """Let the mean wrench take up this tick.

    Args:
        v_before: velocity ``dt`` seconds ago.
        tau: torques that acted since.
        contact: feet in measured contact.
        place: of the payload that the snapshot already has.
        mean: is changed.
    """
    if not can_feel(now, contact, c.config):
        return
    a, needed, left = np.empty(18), np.empty(18), np.empty(6)
    for i in range(18):
        a[i] = (now.v[i] - v_before[i]) / dt
    forces_needed(now, a, needed)
    for i in range(6):
        left[i] = -needed[i]
    for leg in range(4):
        if contact[leg] and not add_foot(now, leg, tau, c, needed, left):
            return
    weight = weight_of_mass(now, a, c.gravity)
    known = plus_scaled((0.0, 0.0, 0.0), now.payload[0], weight)
    force = plus(triple(left[:3]), known)
    moment = plus(triple(left[3:]), cross(triple(place), known))
    share = min(dt / c.config.memory, 1.0)
    put(approached(mean.force, share, force), mean.force)
    put(approached(mean.moment, share, moment), mean.moment)
    put(approached(mean.weight, share, weight), mean.weight)


@subroutine
def approached(mean: Array3, share: float, value: V3) -> V3:
    """A mean that has taken up this share of a value."""
    return (
        mean[0] + share * (value[0] - mean[0]),
        mean[1] + share * (value[1] - mean[1]),
        mean[2] + share * (value[2] - mean[2]),
    )


class PayloadEstimator:
    """Feels, tick by tick, what the robot carries; begins without anything."""

    def __init__(
        self, model: RobotModel, friction: JointFriction, config: PayloadConfig | None = None
    ) -> None:
        """Feel what ``model`` has not; ``friction`` is what the joints take of the torques."""
        self._config = c = config or PayloadConfig()
        self._numbers = packed(PayloadNumbers(c, model.gravity, friction))
        self._mean = PayloadWrench(weight=[0.0, 0.0, model.gravity])
        self._last: RobotState | None = None
        self._since = 0.0
        self._belief = np.zeros(3)
        self._is_believed, self._felt_for = False, 0.0
        self._payload, self._place = NO_PAYLOAD, np.zeros(3)

    @property
    def felt(self) -> Array3:
        """Mass [kg], and first moment [kg m] about the middle, ahead and aside; before any doubt.

        For a robot that is lighter than its model the mass is negative.
        """
        mean = self._mean
        force, moment, weight = mean.force, mean.moment, mean.weight
        x, y, z = self._config.middle
        height = self._config.base_height
        mass = float(force @ weight) / float(weight @ weight)
        lever = mass * (z + height)
        ahead = (lever * weight[0] - moment[1] - height * force[0]) / weight[2] - mass * x
        aside = (lever * weight[1] + moment[0] - height * force[1]) / weight[2] - mass * y
        return np.array([mass, ahead, aside])

    def pause(self) -> None:
        """Keep the belief; the next tick does not follow the last one."""
        self._last = None

    def update(self, snapshot: Snapshot) -> Payload:
        """What is believed after this tick.

        Args:
            snapshot: of this tick, made with what was believed after the last one.
        """
        state, last = snapshot.state, self._last
        self._last = state
        if last is None or not state.time > last.time:
            return self._payload
        dt = state.time - last.time
        measured = (last.v, state.tau, state.feet_in_contact, dt)
        follow_wrench(snapshot, *measured, self._place, self._numbers, self._mean)
        self._since += dt
        if self._since >= PERIOD:
            self._follow(self._since)
            self._since = 0.0
        return self._payload

    def _follow(self, dt: float) -> None:
        """Let the belief follow what is felt for ``dt`` seconds."""
        felt = self.felt
        self._felt_for = self._felt_for + dt if self._is_credible(felt) else 0.0
        self._is_believed = self._felt_for > self._config.patience
        if not self._is_believed and self._payload is NO_PAYLOAD:
            return
        wanted = self._within_reach(felt) if self._is_believed else np.zeros(3)
        self._belief += min(dt / self._config.response, 1.0) * (wanted - self._belief)
        mass, ahead, aside = self._belief.tolist()
        if mass < NOTHING:
            self._belief[:] = 0.0
            self._payload = NO_PAYLOAD
        else:
            x, y, z = self._config.middle
            self._payload = Payload(mass, (x + ahead / mass, y + aside / mass, z))
        self._place = np.array(self._payload.place)

    def _is_credible(self, felt: Array3) -> bool:
        c, share = self._config, self._config.release if self._is_believed else 1.0
        mass, ahead, aside = felt.tolist()
        least_ahead, least_aside = c.least_moment
        is_beside = bool(np.hypot(ahead / least_ahead, aside / least_aside) >= share)
        return mass >= share * (c.least_mass if is_beside else c.centred_mass)

    def _within_reach(self, felt: Array3) -> Array3:
        mass = min(float(felt[0]), self._config.most_mass)
        most = mass * np.array(self._config.reach)
        return np.array([mass, *np.clip(felt[1:], -most, most)])
