"""The world that a motion meets: the floor, the load, and how far the robot is from its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, unknown_name
from go2_wbc.validation import between, ranged, require

SENSORS = ("ideal", "noisy", "imu")
PAYLOAD_HALF_SIZE = (0.10, 0.06, 0.04)
"""Of the payload [m]: a solid box of about a battery's or computer's size."""


RANGES = {
    "friction": (0.0001, 2.0),
    "friction_uncertainty": (0.0, 0.9),
    "payload": (0.0, 12.0),
    "mass_scale": (0.25, 3.0),
    "mass_uncertainty": (0.0, 0.5),
    "joint_friction": (0.0, 10.0),
    "joint_friction_uncertainty": (0.0, 1.0),
    "delay": (0.0, 0.05),
}


@dataclass(frozen=True, slots=True)
@ranged(**{name: between(*bounds) for name, bounds in RANGES.items()})
class World:
    """The conditions that a check assumes, or that a robot is simulated in.

    The controller is not told about them: it works with the robot's description. An uncertain value
    stays within the given share of its value.

    Attributes:
        friction: coefficient of feet and floor, 0.0001 to 2. Wet tiles have 0.5, dry rubber on
            concrete 1.
        friction_uncertainty: share by which it may be more or less, 0 to 0.9.
        payload: extra mass [kg] on the trunk, 0 to 12: Unitree's greatest.
        payload_place: position of its middle in the base frame [m], within 0.5 of the base's
            origin.
        mass_scale: factor on the robot's mass and inertia, 0.25 to 3.
        mass_uncertainty: share by which it may be more or less, 0 to 0.5.
        joint_friction: factor on dry friction and damping of the joints, 0 to 10; motors of one
            type differ by 50 % (``plant.mujoco.model.JointDynamics``).
        joint_friction_uncertainty: share by which it may be more or less, 0 to 1.
        delay: time [s] after which a command acts, 0 to 0.05; a round trip of the robot's bus takes
            0.002. Only in simulation: the check has no equation for it.
        sensors: "ideal", "noisy" for ``plant.sensors.SensorNoise``, or "imu" for the state
            estimated from IMU, encoders and feet. Only in simulation.
    """

    friction: float = 0.5
    friction_uncertainty: float = 0.0
    payload: float = 0.0
    payload_place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass_scale: float = 1.0
    mass_uncertainty: float = 0.0
    joint_friction: float = 1.0
    joint_friction_uncertainty: float = 0.0
    delay: float = 0.0
    sensors: str = "ideal"

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that is out of range."""
        if not isinstance(self.payload_place, tuple) or len(self.payload_place) != 3:
            raise ConfigError(f"World.payload_place must be (x, y, z), got {self.payload_place!r}")
        require(self, between(-0.5, 0.5), "payload_place")
        if str(self.sensors) not in SENSORS:
            raise ConfigError(unknown_name("World.sensors", str(self.sensors), SENSORS))

    @staticmethod
    def of(friction: float | None, payload: float | None, world: World | None = None) -> World:
        """``world``, or the usual one, with this friction and payload where they are given."""
        own = world or World()
        if friction is not None:
            own = replace(own, friction=friction)
        return own if payload is None else replace(own, payload=payload)

    @typed()
    def sample(self, rng: np.random.Generator) -> World:
        """A world within the uncertainties, without any of its own; each is drawn evenly."""
        return self._shifted(rng.uniform(-1.0, 1.0, len(_UNCERTAIN)).tolist())

    @property
    def worst(self) -> World:
        """The one within the uncertainties that asks most: heavy, stiff, on slippery ground."""
        return self._shifted([1.0, 1.0, -1.0])

    def _shifted(self, shares: Sequence[float]) -> World:
        """The world at these shares, -1 to 1, of each uncertainty, in the order of _UNCERTAIN."""
        values = {}
        for (name, part), share in zip(_UNCERTAIN.items(), shares, strict=True):
            shifted = getattr(self, name) * (1.0 + share * getattr(self, f"{part}_uncertainty"))
            low, high = RANGES[name]
            values[name] = min(max(shifted, low), high)
        return replace(
            self, **values, **{f"{part}_uncertainty": 0.0 for part in _UNCERTAIN.values()}
        )

    @property
    def is_late_or_noisy(self) -> bool:
        """Whether commands are late or sensors not ideal: what only a simulation counts with."""
        return self.delay > 0.0 or self.sensors != "ideal"

    def __str__(self) -> str:
        """In words, what is not as usual."""
        words = [f"friction {_told(self.friction, self.friction_uncertainty)}"]
        if self.payload:
            words.append(f"payload {self.payload:g} kg")
            if self.payload_place != _USUAL.payload_place:
                words[-1] += " at " + " ".join(f"{part:g}" for part in self.payload_place) + " m"
        for name, own in (("mass_scale", "mass"), ("joint_friction", "joint friction")):
            told = _told(getattr(self, name), getattr(self, f"{_UNCERTAIN[name]}_uncertainty"))
            if told != "1":
                words.append(f"{own} {told}")
        if self.delay:
            words.append(f"delay {self.delay:g} s")
        if self.sensors != _USUAL.sensors:
            words.append(f"sensors {self.sensors}")
        return ", ".join(words)


_UNCERTAIN = {"mass_scale": "mass", "joint_friction": "joint_friction", "friction": "friction"}
"""What is uncertain, and the name of its uncertainty without the ending."""
_USUAL = World()
DOUBTFUL = World(friction_uncertainty=0.1, mass_uncertainty=0.05, joint_friction_uncertainty=0.5)
"""What is usually not known: the floor within 10 %; the mass within 5 %, which batteries and cables
make; the joints' friction within half, by which motors of one type differ."""


def _told(value: float, uncertainty: float) -> str:
    """A value with its uncertainty, if it has any."""
    return f"{value:g} +-{100.0 * uncertainty:g} %" if uncertainty else f"{value:g}"
