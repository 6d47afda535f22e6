"""A call is split at an instant: the two play as long, and where one was on its way is written."""

from pathlib import Path

import numpy as np
import pytest

from controller.studio.orders import Cut
from controller.studio.source import Source
from controller.studio.splitting import split
from go2_wbc.errors import StudioError
from motions import FeasibilityChecker, Timeline
from motions.language.tracing import CallMark, separated, traced
from motions.registry import load_text

HEAD = '''from motions import Timeline, deg, motion

BEAT = 0.5


@motion
def one() -> Timeline:
    """One."""
'''
ON_THE_WAY = 1e-3  #: m and rad: numbers are written to 0.1 mm and 1e-4 degrees
PATH = Path("one.py").resolve()


def _made(data: bytes) -> tuple[Timeline, list[CallMark]]:
    with traced():
        return separated(load_text(PATH, data)["one"]())


def _split(body: str, number: int, time: float) -> tuple[bytes, Source]:
    data = (HEAD + f"    return {body}\n").encode()
    _, marks = _made(data)
    call = marks[number].call
    source = Source(data)
    return data, split(source, str(PATH), marks, Cut(call.site, call.number, time))


@pytest.mark.parametrize(
    ("body", "number", "time", "after"),
    [
        ("Timeline().hold(1.0).body(z=-0.02, over=1.0)", 0, 0.3,
         "Timeline().hold(0.3).hold(0.7).body(z=-0.02, over=1.0)"),
        ("Timeline().body(z=-0.02, over=1.0).hold(BEAT)", 1, 1.2,
         "Timeline().body(z=-0.02, over=1.0).hold(0.4 * BEAT).hold(0.6 * BEAT)"),
        ("Timeline().body(yaw=deg(10.0), over=1.0)", 0, 0.5,
         "Timeline().body(yaw=deg(5.0), over=0.5).body(yaw=deg(10.0), over=0.5)"),
        ('Timeline().body(z=-0.02, over=0.5).body(z=0.02, over=0.4, ease="linear")', 1, 0.6,
         '(\n        Timeline().body(z=-0.02, over=0.5).body(z=-0.01, over=0.1, ease="linear")'
         '\n        .body(z=0.02, over=0.3, ease="linear")\n    )'),
        ("Timeline().body(z=-0.04, over=0.5).home(over=1.0)", 1, 1.0,
         "Timeline().body(z=-0.04, over=0.5).body(z=-0.02, over=0.5).home(over=0.5)"),
        ("Timeline().walk(0.2, over=8.0)", 0, 4.0,
         "Timeline().walk(0.1, over=4.0).walk(0.1, over=4.0)"),
        ("Timeline().turn(deg(30.0), over=8.0)", 0, 4.0,
         "Timeline().turn(deg(15.0), over=4.0).turn(deg(15.0), over=4.0)"),
    ],
)  # fmt: skip
def test_a_call_is_two_that_play_as_long(body: str, number: int, time: float, after: str) -> None:
    before, source = _split(body, number, time)
    assert source.data.decode() == HEAD + f"    return {after}\n"
    assert _made(source.data)[0].end == pytest.approx(_made(before)[0].end)


@pytest.mark.parametrize(
    "body",
    [
        'Timeline().foot("FR", x=0.02, z=0.08, over=1.0).down("FR", over=0.6)',
        'Timeline().pose("bow", over=1.0).home(over=0.6)',
        "Timeline().body(x=0.02, roll=0.1, over=1.0).home(over=0.6)",
        "Timeline().look_at(1.0, 0.4, 0.5, over=1.0).home(over=0.6)",
    ],
)
def test_the_pose_at_the_split_is_that_of_before(body: str) -> None:
    for number in (0, 1):
        data = (HEAD + f"    return {body}\n").encode()
        mark = _made(data)[1][number]
        time = mark.move + round(0.4 * (mark.end - mark.move), 2)
        _, source = _split(body, number, time)
        checker = FeasibilityChecker()
        plans = [checker.evaluate(_made(text)[0]).plan for text in (data, source.data)]
        was, now = (plan.at(time) for plan in plans)
        assert np.abs(was.body.p_world - now.body.p_world).max() < ON_THE_WAY
        assert np.abs(was.body.R_world_base - now.body.R_world_base).max() < ON_THE_WAY
        assert np.abs(was.p_world_feet - now.p_world_feet).max() < ON_THE_WAY
        assert plans[0].duration == pytest.approx(plans[1].duration)


def test_only_the_call_is_touched_and_its_layout_kept() -> None:
    data = f"""{HEAD}    return (
        Timeline()
        .body(z=-0.02, over=1.0)  # down
        .hold(0.4)  # rest
    )
""".encode()
    _, marks = _made(data)
    after = split(Source(data), str(PATH), marks, Cut(marks[1].call.site, 0, 1.1))
    assert after.data == data.replace(
        b"        .hold(0.4)  # rest\n", b"        .hold(0.1)  # rest\n        .hold(0.3)\n"
    )
    assert after.site == (13, 18)


def test_comments_between_arguments_and_brackets_stay() -> None:
    body = "Timeline().body(  # both\n        z=-0.02,  # down\n        over=(t := 1.0)).hold(t)"
    before, source = _split(body, 0, 0.5)
    first, second = (f".body(z={z}, over=0.5 * (t := 1.0))" for z in (-0.01, -0.02))
    lines = f"{first}\n        {second}.hold(t)  # both  # down\n"
    assert lines in source.data.decode()
    assert _made(source.data)[0].end == _made(before)[0].end


def test_what_runs_beside_another_is_split_once_that_has_ended() -> None:
    body = "Timeline().body(z=-0.02, over=0.5).also().body(x=0.02, over=1.0).hold(0.5)"
    before, source = _split(body, 2, 0.6)
    assert _made(source.data)[0].end == _made(before)[0].end


@pytest.mark.parametrize(
    ("body", "number", "time", "why"),
    [
        ("Timeline().hold(1.0)", 0, 1.0, "playhead is at 1.00 s.*between 0.00 and 1.00 s"),
        ("Timeline().hold(1.0).hold(1.0)", 1, 0.5, "between 1.00 and 2.00"),
        ("Timeline().walk(0.2)", 0, 0.5, "add the argument Takes first"),
        ('Timeline().step("FL", 0.04, over=0.5)', 0, 0.4, "foot is in the air"),
        ("Timeline().jump(0.1)", 0, 0.4, "no single move"),
        ('Timeline().foot("FR", z=0.05, over=0.5).home(over=0.5)', 1, 1.5, "put it down first"),
        ('Timeline().foot("FR", z=0.05, over=0.5, frame="body")', 0, 1.1, "with the ground before"),
        ("Timeline().home(over=0.5)", 0, 0.2, "nothing to split"),
        ("Timeline().body(**{'z': -0.02}, over=1.0)", 0, 0.5, r"what \*\* stands for"),
        ("Timeline().body(z=-0.02, **{'over': 1.0})", 0, 0.5, r"what \*\* stands for"),
        ("Timeline().hold(**dict(seconds=1.0))", 0, 0.5, r"what \*\* stands for"),
        ("Timeline().body(z=-0.02, over=0.5).also().body(x=0.02, over=1.0)", 2, 0.4,
         r"runs beside the move before it .also.*behind 0.50 s"),
        ("Timeline().body(z=-0.02, over=1.0).at(2.0).also().body(x=0.02, over=1.0)", 0, 0.5,
         "the move behind it starts with it"),
    ],
)  # fmt: skip
def test_where_it_cannot_be_done_it_says_why(body: str, number: int, time: float, why: str) -> None:
    with pytest.raises(StudioError, match=why):
        _split(body, number, time)


def test_one_that_runs_several_times_is_left_alone() -> None:
    data = f"""{HEAD}    line = Timeline()
    for z in (-0.02, 0.0):
        line = line.body(z=z, over=0.5)
    return line
""".encode()
    _, marks = _made(data)
    with pytest.raises(StudioError, match="runs 2 times in a loop: write the loop out first"):
        split(Source(data), str(PATH), marks, Cut(marks[0].call.site, 0, 0.2))
