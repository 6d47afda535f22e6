"""``World``: where a motion is to be done, as far as it is known.

One value says it to all who need it: the feasibility check puts the least friction and the payload
into its equations, ``plant_in`` simulates it, and ``sample`` draws the worlds that may
be meant, in which ``certify`` plays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.errors import ConfigError, unknown_name
from go2_wbc.validation import require_between, require_finite

SENSORS = ("ideal", "noisy")


@dataclass(frozen=True, slots=True)
class World:
    """What is known of ground, load and robot; by default a slippery floor and no load.

    Numbers with an uncertainty are the middle of an interval; it is a share of them.

    Attributes:
        friction: sliding friction coefficient of feet and ground, 0.05 to 2. Wet tiles have 0.5,
            dry rubber on concrete about 1.
        friction_uncertainty: 0 to 0.9.
        payload: extra mass [kg] that the controller does not know, 0 to 15; Unitree states 8.
        payload_place: where its middle is [m] in the frame of the base, within 0.5.
        mass_scale: factor on every mass and inertia of the robot, 0.5 to 2.
        mass_uncertainty: 0 to 0.5; batteries and cables make 5 %.
        joint_friction: factor on dry and viscous friction of the joints, 0 to 5; 1 is what
            ``JointDynamics`` says.
        joint_friction_uncertainty: 0 to 1; identified values of one type of motor differ by half.
        delay: time [s] from a command to its torque, 0 to 0.02.
        sensors: "ideal", or "noisy" for white noise on everything measured.
    """

    friction: float = 0.5
    friction_uncertainty: float = 0.1
    payload: float = 0.0
    payload_place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass_scale: float = 1.0
    mass_uncertainty: float = 0.05
    joint_friction: float = 1.0
    joint_friction_uncertainty: float = 0.5
    delay: float = 0.0
    sensors: str = "ideal"

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range, or an unknown kind of sensors."""
        require_between(self, 0.05, 2.0, "friction")
        require_between(self, 0.0, 0.9, "friction_uncertainty")
        require_between(self, 0.0, 15.0, "payload")
        require_between(self, 0.5, 2.0, "mass_scale")
        require_between(self, 0.0, 0.5, "mass_uncertainty")
        require_between(self, 0.0, 5.0, "joint_friction")
        require_between(self, 0.0, 1.0, "joint_friction_uncertainty")
        require_between(self, 0.0, 0.02, "delay")
        if not isinstance(self.payload_place, tuple) or len(self.payload_place) != 3:
            raise ConfigError(
                f"World.payload_place must be a tuple of three lengths [m], "
                f"got {self.payload_place!r}"
            )
        require_finite(self, "payload_place")
        require_between(self, -0.5, 0.5, "payload_place")
        if self.sensors not in SENSORS:
            raise ConfigError(f"World.sensors: {unknown_name('kind', str(self.sensors), SENSORS)}")

    @property
    def least_friction(self) -> float:
        """The friction coefficient that can be counted on."""
        return self.friction * (1.0 - self.friction_uncertainty)

    def sample(self, rng: np.random.Generator) -> World:
        """A world without uncertainty, one of those that may be meant: uniform in each interval."""

        def drawn(value: float, uncertainty: float) -> float:
            return float(value * (1.0 + uncertainty * rng.uniform(-1.0, 1.0)))

        return replace(
            self,
            friction=drawn(self.friction, self.friction_uncertainty),
            mass_scale=drawn(self.mass_scale, self.mass_uncertainty),
            joint_friction=drawn(self.joint_friction, self.joint_friction_uncertainty),
            friction_uncertainty=0.0,
            mass_uncertainty=0.0,
            joint_friction_uncertainty=0.0,
        )

    def __str__(self) -> str:
        """In words, what is stated: friction, and what is not as usual."""
        said = [f"friction {self.friction:.3g}"]
        if self.payload:
            place = ", ".join(f"{length:g}" for length in self.payload_place)
            said.append(f"payload {self.payload:.3g} kg at ({place}) m")
        usual = World()
        for name, unit in (("mass_scale", ""), ("joint_friction", ""), ("delay", " s")):
            if (value := getattr(self, name)) != getattr(usual, name):
                said.append(f"{name.replace('_', ' ')} {value:.3g}{unit}")
        if self.sensors != usual.sensors:
            said.append(f"{self.sensors} sensors")
        return ", ".join(said)
