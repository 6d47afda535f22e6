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

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import FEELING, FELT
from go2_wbc.robot.joint_friction import FrictionFeedForward, JointFriction
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload import NO_PAYLOAD, Payload
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.robot.state import RobotState
from go2_wbc.validation import require_between, require_positive, require_share

PERIOD = 0.02
"""Time [s] from one change of the belief to the next: much less than its response takes."""
NOTHING = 0.02
"""Mass [kg] at which a belief that fades has ended."""


@dataclass(frozen=True, slots=True)
class PayloadConfig:
    """Numbers of the estimate of the payload.

    The thresholds lie above what a robot without payload showed in simulation, with all masses
    10 % wrong, in every gait, on its sensors too: 1.9 kg, 0.06 kg m ahead and 0.04 aside. On joints
    with twice the friction, or that of other models of a Go2, it was 3.8 kg, 0.18 and 0.04 kg m; on
    slopes of 15 deg 0.18 and 0.14 kg m.

    Attributes:
        enabled: whether there is one. The back end "placo", which has a robot of its own, does
            without it.
        memory: time constant [s] of the means.
        response: time constant [s] by which the belief follows what is felt.
        centred_mass: mass [kg] from which on a payload is believed wherever it lies.
        least_mass: mass [kg] from which on one that lies beside the middle is.
        least_moment: first moment [kg m] about the middle, ahead and aside, from which on it does.
        patience: time [s] for which it must be felt before it is believed: what the trunk or a leg
            strikes is soon past.
        release: share of the thresholds below which it is believed no longer.
        most_mass: greatest mass [kg] that is believed.
        reach: greatest distance [m] from the middle that is believed, ahead and aside.
        middle: own CoM of the standing robot in the base frame [m].
        base_height: of the base's origin over the ground, standing [m].
        least_height: of the base over the lowest foot, below which the belly may carry [m].
        most_rise: vertical speed [m/s] of the CoM beyond which nothing is felt: friction in the
            joints of a rising robot looks like a load.
        most_speed: of the base, ahead and aside [m/s]: beyond them it looks like one that lies
            ahead, or aside.
    """

    enabled: bool = True
    memory: float = 0.5
    response: float = 0.5
    centred_mass: float = 4.0
    least_mass: float = 1.0
    least_moment: tuple[float, float] = (0.25, 0.15)
    patience: float = 0.5
    release: float = 0.7
    most_mass: float = 10.0
    reach: tuple[float, float] = (0.2, 0.1)
    middle: tuple[float, float, float] = (0.0, 0.0, -0.019)
    base_height: float = 0.31
    least_height: float = 0.15
    most_rise: float = 0.1
    most_speed: tuple[float, float] = (1.5, 0.4)

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        others = {"enabled", "release", "middle"}
        require_positive(self, *(f.name for f in fields(self) if f.name not in others))
        require_share(self, "release")
        require_between(self, -self.base_height, self.base_height, "middle")


class PayloadEstimator:
    """Feels, tick by tick, what the robot carries; begins without anything."""

    def __init__(
        self, model: RobotModel, friction: JointFriction, config: PayloadConfig | None = None
    ) -> None:
        """Feel what ``model`` has not; ``friction`` is what the joints take of the torques."""
        from go2_wbc.kernels.payload import feel

        self._feel, self._config = feel, config or PayloadConfig()
        c = self._config
        self._numbers = FEELING.pack(
            [model.gravity, c.memory, c.least_height, c.most_rise, c.most_speed]
        )
        self._friction = FrictionFeedForward(friction, model.motor).numbers
        self._means = FELT.pack([np.zeros(3), np.zeros(3), [0.0, 0.0, model.gravity]])
        self._contact = np.zeros(4)
        self._last: RobotState | None = None
        self._since = 0.0
        self._belief = np.zeros(3)
        self._is_believed, self._felt_for = False, 0.0
        self._payload, self._place = NO_PAYLOAD, np.zeros(3)

    @property
    def felt(self) -> Float[np.ndarray, "3"]:
        """Mass [kg], and first moment [kg m] about the middle, ahead and aside; before any doubt.

        For a robot that is lighter than its model the mass is negative.
        """
        force, moment, weight = FELT.views(self._means)
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
        self._contact[:] = state.feet_in_contact
        numbers, place = self._numbers, self._place
        self._feel(
            *(snapshot.row, last.v, state.tau, self._contact, dt),
            *(place, numbers, self._friction, self._means),
        )
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

    def _is_credible(self, felt: Float[np.ndarray, "3"]) -> bool:
        c, share = self._config, self._config.release if self._is_believed else 1.0
        mass, ahead, aside = felt.tolist()
        least_ahead, least_aside = c.least_moment
        is_beside = bool(np.hypot(ahead / least_ahead, aside / least_aside) >= share)
        return mass >= share * (c.least_mass if is_beside else c.centred_mass)

    def _within_reach(self, felt: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        mass = min(float(felt[0]), self._config.most_mass)
        most = mass * np.array(self._config.reach)
        return np.array([mass, *np.clip(felt[1:], -most, most)])


def felt_now(
    snapshot: Snapshot,
    tau: Float[np.ndarray, "12"],
    a: Float[np.ndarray, "18"],
    payload: Payload,
    gravity: float,
) -> Float[np.ndarray, "9"]:
    """What a payload takes of the feet in contact, in one tick: the law of ``kernels.payload``.

    Args:
        snapshot: of this tick, made with ``payload``.
        tau: torques at the joints, without what friction takes [N m].
        a: acceleration that came of them (see ``Snapshot``).
        payload: what the snapshot already has.
        gravity: [m/s^2].

    Returns:
        As ``kernels.layout.FELT``: force and moment about the base's origin, and what a unit of
        mass weighs, in the base frame.
    """
    state, R = snapshot.state, snapshot.R_world_base
    needed = snapshot.mass_matrix @ a + snapshot.bias
    wrench = -needed[:6]
    for leg in np.flatnonzero(state.feet_in_contact):
        joints = slice(6 + 3 * leg, 9 + 3 * leg)
        J = snapshot.J_contacts[leg]
        f = np.linalg.solve(J[:, joints].T, needed[joints] - tau[3 * leg : 3 * leg + 3])
        wrench = wrench + J[:, :6].T @ f
    weight = a[:3] + np.cross(state.v[3:6], state.v[:3]) + gravity * R[2]
    force = payload.mass * weight
    return np.concatenate([wrench[:3] + force, wrench[3:] + np.cross(payload.place, force), weight])
