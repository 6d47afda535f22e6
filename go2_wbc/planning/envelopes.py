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


def envelope_of(gait: Gait, trot: VelocityEnvelope) -> VelocityEnvelope:
    """The envelope in which ``gait`` is walked.

    Args:
        gait: with a name in ``GAITS``, or one of your own, which gets its ``envelope_share``, as
            does one that has not been measured yet.
        trot: envelope of the trot, and the one that it has itself. Those of the others are in the
            proportion that was measured, so that all of them keep the same distance to what was
            measured, and never beyond that.
    """
    if gait == GAITS["trot"]:
        return trot
    measured = measured_envelopes()
    if GAITS.get(gait.name) != gait or gait.name not in measured:
        return trot.scaled(gait.envelope_share)
    own, usual = astuple(measured[gait.name]), astuple(measured["trot"])
    return VelocityEnvelope(
        *(min(bound / b, 1.0) * a for bound, a, b in zip(astuple(trot), own, usual, strict=True))
    )
