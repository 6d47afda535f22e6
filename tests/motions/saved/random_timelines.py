"""Timelines of all kinds of calls, for hypothesis; not all of them can be done by the robot."""

from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions import Timeline
from motions.language.keys import BODY_CHANNELS

MANY = 60  # keys; repeating a repetition makes more and more of them
Call = Callable[[Timeline], Timeline]

times = st.floats(0.05, 5.0)
small = st.floats(-0.3, 0.3)
frames = st.sampled_from(("ground", "body"))
postures = st.sampled_from(Posture)
eases = st.sampled_from(Ease)
legs = st.sampled_from(Leg)
angles = st.floats(-1.5, 1.5)


def body(channel: str, value: float, over: float, ease: Ease) -> Call:
    return lambda line: line.body(**{channel: value}, over=over, ease=ease)


def foot(leg: Leg, place: tuple[float, float, float], over: float, frame: str, ease: Ease) -> Call:
    x, y, z = place
    return lambda line: line.foot(leg, x=x, y=y, z=abs(z) + 0.01, over=over, frame=frame, ease=ease)


def joints(leg: Leg, hip: float, thigh: float, calf: float, over: float) -> Call:
    return lambda line: line.leg(leg, hip=hip, thigh=thigh, calf=calf, over=over)


calls: st.SearchStrategy[Call] = st.one_of(
    st.builds(body, st.sampled_from(BODY_CHANNELS), small, times, eases),
    st.builds(foot, legs, st.tuples(small, small, small), times, frames, eases),
    st.builds(joints, legs, angles, angles, angles, times),
    st.builds(lambda t, name: lambda line: line.hold(t, name=name), times, st.text(max_size=8)),
    st.builds(lambda t: lambda line: line.home(over=t), times),
    st.builds(lambda leg, x, t: lambda line: line.step(leg, x, over=t), legs, small, times),
    st.builds(lambda leg, t: lambda line: line.unweight(leg, over=t), legs, times),
    st.builds(lambda posture, t: lambda line: line.posture(posture, over=t), postures, times),
    st.builds(lambda beats: lambda line: line.bpm(beats), st.floats(40.0, 200.0)),
    st.builds(
        lambda leg, name, angle, t: lambda line: line.joint(leg, name, angle, over=t),
        legs,
        st.sampled_from(("hip", "thigh", "calf")),
        angles,
        times,
    ),
    st.builds(
        lambda values, t: (
            lambda line: line.body_path([{"x": x, "roll": x} for x in values], over=t)
        ),
        st.lists(small, min_size=2, max_size=4),
        times,
    ),
    st.builds(lambda first, gap: lambda line: line.on_beats([first, first + gap]), times, times),
    st.builds(lambda factor: lambda line: line.scale_time(factor).scale(factor), times),
    st.just(lambda line: line.home(over=1.0).reverse()),
    st.just(lambda line: line.mirror()),
    st.just(lambda line: line.also()),
    st.just(lambda line: line.together(Timeline().body(z=-0.02, over=0.4).home(over=0.3))),
    st.just(lambda line: line.home(over=1.0).repeat(2)),
)


Written = tuple[dict[str, Any], list[Call]]
written: st.SearchStrategy[Written] = st.tuples(
    st.fixed_dictionaries(
        {
            "entry": postures,
            "exit": postures,
            "name": st.text(max_size=12),
            "balance": st.booleans(),
            "shift_time": times,
        }
    ),
    st.lists(calls, max_size=12),
)
"""What ``timeline_of`` takes: making timelines while drawing would check their types by chance."""


def timeline_of(drawn: Written) -> Timeline:
    """Up to a dozen calls; one that makes no sense where it comes is left out."""
    arguments, called = drawn
    line = Timeline(**arguments)
    for call in called:
        try:
            longer = call(line)
        except TimelineError:
            continue
        line = longer if len(longer.keys) < MANY else line
    return line
