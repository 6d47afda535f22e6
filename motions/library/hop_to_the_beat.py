"""Hop to the beat."""

from motions import Timeline, motion


@motion
def hop_to_the_beat() -> Timeline:
    """Hop to the beat: nod twice, then three hops that come down on the beats, at 120 a minute."""
    nods = Timeline().bpm(120)
    for _ in range(2):
        nods = nods.body(pitch=0.12, over=1).body(pitch=0.0, over=1)
    return nods.hop(3, height=0.05, period=1).hold(1)
