"""Motions that are solved: jumps, hops, and few feet."""

from typing import Annotated

from motions import Choice, Timeline, deg, motion

Side = Annotated[str, Choice("left", "right")]


@motion
def jump_up() -> Timeline:
    """Jump up: crouch, and jump so that the feet are 0.15 m over the ground."""
    return Timeline().jump(height=0.15).hold(0.3)


@motion
def jump_forward() -> Timeline:
    """Jump forward: half a metre with all four feet."""
    return Timeline().jump(x=0.5, height=0.1).hold(0.3)


@motion
def bunny_hops() -> Timeline:
    """Bunny hops: three little jumps ahead, one after the other."""
    hop = Timeline().jump(x=0.15, height=0.04)
    return hop.repeat(3).hold(0.3)


@motion
def hop_to_the_beat() -> Timeline:
    """Hop to the beat: nod twice, then three hops that come down on the beats, at 120 a minute."""
    nods = Timeline().bpm(120)
    for _ in range(2):
        nods = nods.body(pitch=0.12, over=1).body(pitch=0.0, over=1)
    return nods.hop(3, height=0.05, period=1).hold(1)


@motion
def spin_jump(side: Side = "left") -> Timeline:
    """Spin jump: jump up and turn by 90 degrees in the air."""
    line = Timeline().spin_jump(deg(90)).hold(0.3)
    return line if side == "left" else line.mirror()


@motion
def pounce() -> Timeline:
    """Pounce: crouch, wiggle, and leap at the prey."""
    low = Timeline().body(z=-0.06, pitch=deg(8), over=0.7)
    for side in (0.025, -0.025, 0.025, 0.0):
        low = low.body(y=side, over=0.4)
    return low.home(over=0.5).pounce(0.3).hold(0.3)


@motion
def rear_up() -> Timeline:
    """Rear up: balance on the hind feet for a moment, the front feet in the air."""
    return Timeline().rear(deg(-25)).hold(0.3)


@motion
def paw_pair() -> Timeline:
    """Paw pair: lift a front paw and the hind paw across, then the other two."""
    pair = Timeline().lift(("FL", "RR"), hold=0.35).hold(0.3)
    return pair.then(pair.mirror())
