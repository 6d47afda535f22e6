"""How fast each gait may walk, and which gait to walk with at a speed: ``walk(gait="auto")``.

The bounds are measured, and stored in ``envelopes.json``. The gaits of ``LADDER`` are ordered by
speed. The faster one is taken once the velocity uses ``UP`` of the envelope of the slower one, and
the slower one again once velocity and command use ``DOWN`` of it at most: between the two nothing
changes. The followed velocity stays inside the envelope of the gait, and for ``DWELL`` seconds
after a change inside that of the slower gait of the two, while the phases of the feet change.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import astuple
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import GAITS, Gait
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope
from go2_wbc.robot.description import RobotProfile, find_profile

FILE = Path(__file__).with_name("envelopes.json")
"""Written by ``python -m benchmarks envelopes --store``."""
AUTO = "auto"  #: What ``walk`` calls a gait that is chosen by the speed
LADDER = ("walk", "trot", "flying_trot")  #: Names of the gaits, the slowest first
UP, DOWN = 0.85, 0.6  #: Shares of the slower gait's envelope (own choice)
DWELL = 0.8  #: Time [s] from one change to the next at the least (own choice: two strides or more)


@cache
def measured_envelopes() -> Mapping[str, VelocityEnvelope]:
    """The measured bounds of the gaits that have a name, by name."""
    gaits = json.loads(FILE.read_text(encoding="utf-8"))["gaits"]
    return {name: VelocityEnvelope(**bounds) for name, bounds in gaits.items()}


FULL = VelocityEnvelope(forward=1.6875, backward=1.5469, lateral=1.3438, turning=5.9062)
"""Trot's envelope that gives the other gaits all that was measured of theirs: what a trot held
whose forces were not planned ahead."""


def trot_of(profile: RobotProfile | None = None) -> VelocityEnvelope:
    """In which a robot, by default a Go2, trots in simulation where nothing is configured."""
    return VelocityEnvelope(*(profile or find_profile()).envelope)


def envelope_of(
    gait: Gait, trot: VelocityEnvelope | None, profile: RobotProfile | None = None
) -> VelocityEnvelope:
    """The envelope in which ``gait`` is walked.

    Args:
        gait: with a name in ``GAITS``, or one of your own, which gets its ``envelope_share``, as
            does one that has not been measured yet.
        trot: the envelope that is configured, which the trot has itself. Those of the others are
            in proportion to it, and never beyond what was measured. None, if none is configured:
            ``trot_of`` for the trot, for the others what goes with ``VelocityEnvelope()``.
        profile: of the robot, by default a Go2.
    """
    if gait == GAITS["trot"]:
        return trot or trot_of(profile)
    trot, measured = trot or VelocityEnvelope(), measured_envelopes()
    if GAITS.get(gait.name) != gait or gait.name not in measured:
        return trot.scaled(gait.envelope_share)
    bounds = zip(astuple(trot), astuple(measured[gait.name]), astuple(FULL), strict=True)
    return VelocityEnvelope(*(min(bound / full, 1.0) * own for bound, own, full in bounds))


class GaitChoice:
    """Chooses the gait of a robot that walks."""

    def __init__(self, trot: VelocityEnvelope | None) -> None:
        """Choose by the envelopes that go with that of the trot, ``VelocityEnvelope()`` if None."""
        trot, self._gaits = trot or VelocityEnvelope(), [GAITS[name] for name in LADDER]
        self._envelopes = [envelope_of(gait, trot) for gait in self._gaits]
        self._rung: int | None = None
        self._slowest, self._changed = 0, -np.inf

    @property
    def envelope(self) -> VelocityEnvelope:
        """Of the fastest gait."""
        return self._envelopes[-1]

    def update(
        self, time: float, velocity: Float[np.ndarray, "3"], command: VelocityCommand
    ) -> tuple[Gait, VelocityCommand]:
        """The gait now, and the velocity to go for.

        Args:
            time: of the robot [s].
            velocity: that is followed now: ahead, left [m/s], turning [rad/s].
            command: what is asked for.
        """
        now = VelocityCommand(*velocity.tolist())
        if self._rung is None:
            loads = [envelope.load(now) for envelope in self._envelopes]
            self._rung = next((n for n, load in enumerate(loads) if load <= UP), len(loads) - 1)
            self._slowest, self._changed = self._rung, time
        elif time - self._changed >= DWELL:
            rung = self._wanted(self._rung, now, command)
            if rung != self._rung:
                self._slowest, self._changed = min(rung, self._rung), time
                self._rung = rung
            else:
                self._slowest = rung
        return self._gaits[self._rung], self._envelopes[self._slowest].clip(command)

    def _wanted(self, rung: int, now: VelocityCommand, command: VelocityCommand) -> int:
        if rung + 1 < len(self._gaits) and self._envelopes[rung].load(now) >= UP:
            return rung + 1
        if rung > 0:
            below = self._envelopes[rung - 1]
            if max(below.load(now), below.load(command)) <= DOWN:
                return rung - 1
        return rung
