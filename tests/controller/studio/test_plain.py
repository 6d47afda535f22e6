"""Refusals and limits are told in an author's words, of the lines that the author has."""

from __future__ import annotations

import numpy as np
import pytest

from controller.studio.plain import HOME_FIRST, plainly, refusal
from tests.viz.synthetic import synthetic_recording
from viz.content import Annotation, MarginCurve, ReplayContent, Verdict

BEFORE = b"a = 1\nb = 2\n"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (
            "a jump or flight starts standing at home(); away: body pitch, foot FR, balance",
            "it starts standing at home, and there the trunk is tilted, the front right foot is up."
            f" {HOME_FIRST}",
        ),
        (
            "then() needs motions that end at home(); away: balance",
            "it starts standing at home, and there the trunk is over three feet. " + HOME_FIRST,
        ),
        ("walk(): foot RL is raised: put it down() before",
         "the rear left foot is still up there: put it down before"),
        ("down(): foot FR is not raised",
         "the front right foot is not up there: raise it before"),
        ("body() needs one of x, y", "body() needs one of x, y"),
    ],
)  # fmt: skip
def test_a_refusal_says_what_is_missing_in_words(error: str, words: str) -> None:
    after = BEFORE + b"c = 3\n"
    assert refusal(f"dance (dance.py, line 3): {error}", BEFORE, after) == words


@pytest.mark.parametrize(
    ("line", "told"), [(1, " (line 1)"), (2, ""), (3, " (line 2)"), (4, ""), (None, "")]
)
def test_it_names_a_line_of_the_file_as_it_is_or_none(line: int | None, told: str) -> None:
    after = b"a = 1\nnew = 0\nb = 2\n"
    place = "dance.py" if line is None else f"dance.py, line {line}"
    assert refusal(f"{place}: NameError: x", BEFORE, after) == f"NameError: x{told}"
    assert refusal(f"dance ({place}): too long", BEFORE, after) == f"too long{told}"


def test_a_line_that_would_be_another_is_told_as_the_one_that_it_was() -> None:
    assert refusal("d.py, line 2: no", BEFORE, b"a = 1\nb = 2 + 3\n") == "no (line 2)"
    assert refusal("d.py, line 3: no", BEFORE, b"a = 1\nb = 2 + (\n    3)\n") == "no (line 2)"


def test_what_is_no_place_of_the_file_stays() -> None:
    assert refusal("the file was stopped", BEFORE, BEFORE) == "the file was stopped"


def test_limits_are_told_in_centimetres_and_degrees() -> None:
    """And an end away from home in words, also where it is told with numbers."""
    texts = {
        "-2 rad, limit -1.57": "-115\N{DEGREE SIGN}, limit -90\N{DEGREE SIGN}",
        "0.019 m, limit 0.016": "1.9 cm, limit 1.6 cm",
        "31 N m, limit 23.7": "31 N m, limit 23.7",
    }
    found = [Annotation("joint position", "FR_thigh", 0.0, text, True, (), ()) for text in texts]
    both = "0.2 m, rad, limit 0.1"
    found += [
        Annotation("lag", name, 0.0, both, True, (), ()) for name in ("trunk", "trunk turning")
    ]
    end = "0.175 m, rad, limit 0.05 (it is to end in stand: home())"
    found.append(Annotation("entry and exit", "exit attitude", 1.0, end, True, (), ()))
    time, worst = np.zeros(1), np.zeros(1, dtype=int)
    curves = tuple(
        MarginCurve(unit, unit, time, np.ones(1), ("one",), worst, 0.1)
        for unit in ("m", "rad", "N m", "m, rad")
    )
    verdict = Verdict(False, "4 limits broken", tuple(found), curves)
    recording = synthetic_recording(script=(("stand", 0.4),))
    content = plainly(ReplayContent(recording, verdict=verdict)).verdict
    assert content is not None
    *told, last = [one.text for one in content.annotations]
    mixed = ["20 cm, limit 10 cm", "11.5\N{DEGREE SIGN}, limit 5.73\N{DEGREE SIGN}"]
    assert told == [*texts.values(), *mixed]
    assert last.endswith("All home at the end does that")
    drawn = [(one.unit, float(one.margin[0]), one.tight) for one in content.curves]
    assert drawn == [
        ("cm", 100.0, 10.0),
        ("\N{DEGREE SIGN}", pytest.approx(57.2958, abs=1e-4), pytest.approx(5.72958, abs=1e-5)),
        ("N m", 1.0, 0.1),
        ("m or rad", 1.0, 0.1),
    ]
