"""How fast each gait may be walked: measured bounds, kept as data in ``envelopes.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import astuple
from functools import cache
from pathlib import Path

from go2_wbc.contacts import GAITS, Gait
from go2_wbc.planning.command import VelocityEnvelope

FILE = Path(__file__).with_name("envelopes.json")
"""Written by ``python -m benchmarks envelopes --store``."""


@cache
def measured_envelopes() -> Mapping[str, VelocityEnvelope]:
    """The measured bounds of the gaits that have a name, by name."""
    gaits = json.loads(FILE.read_text(encoding="utf-8"))["gaits"]
    return {name: VelocityEnvelope(**bounds) for name, bounds in gaits.items()}


TROT = VelocityEnvelope(forward=3.0, backward=2.0, lateral=1.0, turning=6.0)
"""In which the trot is walked in simulation where nothing is configured: inside what was measured,
and held on the robot's own sensors."""
FULL = VelocityEnvelope(forward=1.6875, backward=1.5469, lateral=1.3438, turning=5.9062)
"""Trot's envelope that gives the other gaits all that was measured of theirs: what a trot held
whose forces were not planned ahead."""


def envelope_of(gait: Gait, trot: VelocityEnvelope | None) -> VelocityEnvelope:
    """The envelope in which ``gait`` is walked.

    Args:
        gait: with a name in ``GAITS``, or one of your own, which gets its ``envelope_share``, as
            does one that has not been measured yet.
        trot: the envelope that is configured, which the trot has itself. Those of the others are
            in proportion to it, and never beyond what was measured. None, if none is configured:
            ``TROT`` for the trot, for the others what goes with ``VelocityEnvelope()``.
    """
    if gait == GAITS["trot"]:
        return trot or TROT
    trot, measured = trot or VelocityEnvelope(), measured_envelopes()
    if GAITS.get(gait.name) != gait or gait.name not in measured:
        return trot.scaled(gait.envelope_share)
    bounds = zip(astuple(trot), astuple(measured[gait.name]), astuple(FULL), strict=True)
    return VelocityEnvelope(*(min(bound / full, 1.0) * own for bound, own, full in bounds))
