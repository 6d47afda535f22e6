"""Sleepy."""

from motions import Timeline, deg, motion


@motion
def sleepy() -> Timeline:
    """Sleepy: the head sinks, catches itself, sinks again; then wide awake."""
    line = Timeline()
    for pitch, z in ((12.0, -0.05), (15.0, -0.08)):
        drowsy = {"pitch": deg(0.3 * pitch), "z": 0.3 * z}  # hardly at first, then faster
        asleep = {"pitch": deg(pitch), "z": z}
        line = line.body_path([drowsy, asleep], over=2.6, times=[1.7, 2.6])
        line = line.hold(0.4).body(pitch=deg(1.0), z=-0.01, over=0.6)
    return line.body(pitch=deg(-10.0), z=0.01, over=0.6).hold(0.5).home(over=0.6)
