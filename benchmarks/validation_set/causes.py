"""Known causes of wrong verdicts, each as motions: what the check once got wrong, and why.

They were written after the causes were found, so they say whether these are mended, and nothing of
motions that nobody has thought of: that is what the exam is for.
"""

from collections.abc import Sequence

from benchmarks.validation_set.drawing import Draw, Family
from benchmarks.validation_set.questions import Question
from benchmarks.validation_set.scores import Case
from go2_wbc.legs import LEGS
from motions import Timeline, deg

CAUSES = "cause"  # Stratum and half of these motions


def _roll_and_back(_draw: Draw, s: float) -> Timeline:
    return Timeline().body(roll=deg(s), over=0.8).hold(0.3).body(roll=0.0, over=0.8)


def _head_down(_draw: Draw, s: float) -> Timeline:
    return Timeline().body(pitch=deg(28.0), z=-s, over=1.0).hold(0.6).home(over=1.0)


def _twists(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(3):
        line = line.body(yaw=deg(20.0), over=s).body(yaw=-deg(20.0), over=s)
    return line.home(over=s)


def _sways(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(3):
        line = line.body(y=0.03, over=s).body(y=-0.03, over=s)
    return line.home(over=0.5)


def _skims(_draw: Draw, s: float) -> Timeline:
    line = Timeline().foot("FR", y=-0.05, z=s, over=0.6)
    return line.down("FR", over=0.6).home(over=0.8)


def _slides(_draw: Draw, s: float) -> Timeline:
    line = Timeline().foot("RR", x=s, z=0.006, over=0.6)
    return line.down("RR", over=0.5).home(over=0.8)


def _rocks(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(4):
        line = line.body(roll=0.37, over=s).body(roll=-0.37, over=s)
    return line.home(over=0.5)


def _stamps(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(3):
        line = line.foot("FR", z=0.07, over=0.4).down("FR", over=s)
    return line.home(over=0.8)


def _taps(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(4):
        line = line.foot("FL", z=0.03, over=s).down("FL", over=s)
    return line.home(over=0.8)


def _lifts_in_turn(_draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for leg in LEGS:
        line = line.foot(leg, z=s, over=0.5).down(leg, over=0.5)
    return line.home(over=0.8)


_EXAMPLES = {
    _roll_and_back: (9.0, 12.0),
    _head_down: (0.06, 0.10),
    _twists: (0.20, 0.25, 0.30),
    _sways: (0.30, 0.40),
    _skims: (0.004, 0.010, 0.030),
    _slides: (0.02, 0.04),
    _rocks: (0.13, 0.20),
    _stamps: (0.15, 0.20, 0.25),
    _taps: (0.15, 0.20, 0.30),
    _lifts_in_turn: (0.05, 0.10, 0.15),
}
"""Of each: degrees, metres or seconds."""


def examples() -> list[Question]:
    """All of them."""
    return [
        Question(Family(f"cause: {write.__name__.strip('_')}", write), 0, s, CAUSES)
        for write, amplitudes in _EXAMPLES.items()
        for s in amplitudes
    ]


def render_causes(cases: Sequence[Case]) -> str:
    """What check and physics say of each."""
    lines = [f"{'motion':<24}{'check':<28}{'physics (strict)'}", "-" * 80]
    for case in cases:
        name = case.name.removeprefix("cause: ").replace(" 0 ", " ")
        said, happened = ", ".join(case.refusal) or "passed", ", ".join(case.outcome.strict)
        text = f"{name[:22]:<24}{said[:26]:<28}{happened or 'done'}"
        lines.append(f"{text[:73]:<74}{'WRONG' if case.is_wrong else 'ok'}")
    wrong = sum(case.is_wrong for case in cases)
    return "\n".join([*lines, "-" * 80, f"{wrong} of {len(cases)} wrong."])
