"""A longer dance."""

from motions import Timeline, motion
from motions.library.content import content
from motions.library.curtsy import curtsy
from motions.library.hula import hula
from motions.library.lift_leg import lift_leg
from motions.library.push_ups import push_ups
from motions.library.shake_paw import shake_paw
from motions.library.tap_dance import tap_dance
from motions.library.wave import wave
from motions.library.wiggle_hips import wiggle_hips


@motion
def dance2() -> Timeline:
    """Dance for most of a minute: hips, taps, hula, every leg once in the air, and a curtsy."""
    return wiggle_hips(times=2, tempo=80.0).then(
        tap_dance(bars=1),
        hula(rounds=1),
        shake_paw(side="left"),
        content(times=1),
        lift_leg(),
        lift_leg().mirror(),
        wave(side="left", times=2),
        push_ups(times=2),
        curtsy(),
    )
