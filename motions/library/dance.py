"""Dance."""

from motions import Timeline, motion
from motions.library.bow import bow
from motions.library.hula import hula
from motions.library.push_ups import push_ups
from motions.library.tap_dance import tap_dance
from motions.library.twist import twist
from motions.library.wave import wave
from motions.library.wiggle import wiggle


@motion
def dance() -> Timeline:
    """Dance for half a minute: wiggle, twist, tap, hula, wave, and bow to the audience."""
    return wiggle().then(
        twist(tempo=60.0),
        tap_dance(tempo=80.0, bars=1),
        hula(rounds=1),
        push_ups(times=2),
        wave(times=2),
        bow(),
    )
