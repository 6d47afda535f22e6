"""A longer dance."""

from __future__ import annotations

from motions.authoring import motion
from motions.library.content import content
from motions.library.curtsy import curtsy
from motions.library.hula import hula
from motions.library.nod import nod
from motions.library.push_ups import push_ups
from motions.library.shake_head import shake_head
from motions.library.shake_paw import shake_paw
from motions.library.tap_dance import tap_dance
from motions.library.twist import twist
from motions.library.wave import wave
from motions.library.wiggle_hips import wiggle_hips
from motions.timeline import Timeline


@motion
def dance2() -> Timeline:
    """Dance for a minute: hips, taps, hula, twist, paws, and a curtsy to either side."""
    return wiggle_hips().then(
        nod(),
        tap_dance(bars=1),
        hula(rounds=2),
        shake_paw(side="left"),
        content(times=1),
        twist(tempo=80.0),
        wave(side="left", times=2),
        push_ups(times=2),
        shake_head(),
        wiggle_hips(tempo=110.0),
        curtsy(),
        curtsy().mirror(),
    )
