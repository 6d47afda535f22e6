"""Cross step."""

from motions import Timeline, motion


@motion
def cross_step() -> Timeline:
    """Cross step: one front foot before the other and back, first the left, then the right."""
    line = Timeline()
    for foot, across in (("FL", -0.16), ("FR", 0.16)):
        line = line.step(foot, x=0.10, y=across, over=0.6).hold(0.3)
        line = line.step(foot, x=-0.10, y=-across, over=0.6).hold(0.3)
    return line.home(over=1.4)
