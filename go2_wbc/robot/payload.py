"""A load on the robot's back: a solid box of about a battery's or computer's size."""

from __future__ import annotations

PAYLOAD_HALF_SIZE = (0.10, 0.06, 0.04)  # m


def payload_inertia(mass: float) -> tuple[float, float, float]:
    """Moments of inertia [kg m^2] of the box of ``mass`` [kg] about its middle, along its edges."""
    x, y, z = (2.0 * half for half in PAYLOAD_HALF_SIZE)
    share = mass / 12.0
    return share * (y * y + z * z), share * (x * x + z * z), share * (x * x + y * y)
