"""Show."""

from motions import Timeline, deg, motion
from motions.library.bow import bow
from motions.library.hula import hula
from motions.library.moonwalk import moonwalk
from motions.library.pirouette import pirouette
from motions.library.salute import salute
from motions.library.step_dance import step_dance
from motions.library.wave import wave


@motion
def show() -> Timeline:
    """Show: a minute on stage: enter, greet, dance, moonwalk, pirouette, and bow to everybody."""
    enter = Timeline().walk(x=0.5, gait="trot")
    about = Timeline().turn(deg(180.0), gait="trot")
    acts = (wave(), step_dance(), hula(), moonwalk())
    finale = (pirouette(), salute(), bow(), about, bow())
    return enter.then(*acts, *finale)
