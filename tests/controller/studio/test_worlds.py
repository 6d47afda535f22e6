"""The world that the page chooses: verdict, play and parts that are kept are those of it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.report_view import verdict_of
from controller.studio.plain import _words
from controller.studio.session import Studio
from controller.studio.worlds import world_of
from go2_wbc.world import World
from motions import FeasibilityChecker
from motions.registry import load_text
from tests.viz.page_reader import read_message, read_pack
from viz.content import Verdict
from viz.replay.page_data import UNKNOWN

TURN = '''"""Turns."""

from motions import Timeline, deg, motion


@motion
def turn() -> Timeline:
    """Turn the trunk, quickly."""
    line = Timeline().body(yaw=deg(18.0), over=0.3).body(yaw=deg(-18.0), over=0.4)
    return line.foot("FR", z=0.06, over=0.5).down("FR", over=0.5).home(over=0.6)
'''
ICE: dict[str, object] = {"friction": 0.2, "payload": 3.0, "sensors": "imu"}
CLOSE = 1e-6  #: Of a chance: what is kept is kept by numbers that are rounded to 1e-7
SLOPE_ERROR = 0.02  #: Of a rise: feet press into the ground, and the trunk's attitude is felt
FORCE_ERROR = 2.0  #: N, of what the feet bear, on average over a motion that ends as it began
FILE = "turn.py", TURN


@pytest.fixture(scope="module")
def opened(file: Path) -> Iterator[Studio]:
    with Studio(file, None, 0) as studio:
        yield studio


@pytest.fixture
def studio(opened: Studio) -> Studio:
    """In the usual world."""
    assert opened.meet({}) == {}
    return opened


def _header(studio: Studio) -> dict[str, Any]:
    return read_pack(read_message(studio._server.changes(""), b"")[1])[0]


def _verdict(file: Path, world: World) -> Verdict:
    """What a check says that has kept nothing."""
    (motion,) = load_text(file, file.read_bytes()).values()
    return verdict_of(FeasibilityChecker(world=world).check(motion()))


def test_on_ice_a_motion_is_refused_that_was_fine(studio: Studio, file: Path) -> None:
    before = _header(studio)
    assert before["verdict"]["ok"]
    assert before["editor"]["world"]["told"] == "friction 0.5"
    assert studio.meet({"friction": 0.2}) == {}
    slippery = _header(studio)
    assert not slippery["verdict"]["ok"]
    assert slippery["verdict"]["world"] == slippery["editor"]["world"]["told"] == "friction 0.2"
    assert slippery["verdict"]["chance"] < before["verdict"]["chance"]
    assert any("friction" in bar["broken"] for bar in slippery["editor"]["bars"])
    assert studio.meet({}) == {}
    assert _header(studio)["verdict"] == before["verdict"]
    assert file.read_text(encoding="utf-8") == TURN


def test_an_edit_in_another_world_is_checked_as_if_nothing_was_kept(
    studio: Studio, file: Path
) -> None:
    assert studio.meet(ICE) == {}
    editor = _header(studio)["editor"]
    order = {"op": "set", "site": editor["bars"][0]["site"], "name": "over", "value": 0.4}
    answer = studio.edit({**order, "base": editor["base"], "commit": True})
    assert isinstance(answer, dict)
    assert "error" not in answer
    header, whole = _header(studio), _verdict(file, replace(world_of(ICE), sensors="ideal"))
    told = header["verdict"]
    assert (told["text"], told["chance"]) == (whole.text, pytest.approx(whole.chance, abs=CLOSE))
    shown = [(one["limit"], one["subject"], one["text"]) for one in told["annotations"]]
    assert shown == [(one.limit, one.subject, _words(one)) for one in whole.annotations]
    assert studio.edit({"op": "undo"}) == {}, "of the text, not of the world"
    assert _header(studio)["editor"]["world"]["told"] == str(world_of(ICE))
    assert file.read_text(encoding="utf-8") == TURN


def _played(studio: Studio, **world: object) -> tuple[str, dict[str, np.ndarray]]:
    """What is told of it, and how the robot moved."""
    assert studio.meet(world) == {}
    answer = studio.play({})
    assert isinstance(answer, bytes)
    told, data = read_message(answer)
    return str(told["told"]), read_pack(data)[1]


@pytest.mark.slow
def test_physics_plays_it_in_that_world(studio: Studio) -> None:
    told, usual = _played(studio)
    assert told.startswith("played in MuJoCo: done")
    told, loaded = _played(studio, payload=3.0)
    assert told.startswith("played in MuJoCo (friction 0.5, payload 3 kg): done")
    more = float(np.diff([one["forces"].sum(axis=1).mean() for one in (usual, loaded)])[0])
    assert more == pytest.approx(3.0 * 9.81, abs=FORCE_ERROR), "the feet carry it"
    told, felt = _played(studio, payload=3.0, sensors="imu")
    assert "payload 3 kg, sensors imu): done" in told
    assert not np.array_equal(felt["q"], loaded["q"]), "it does not know the truth"
    told, _ = _played(studio, friction=0.1)
    assert told.startswith("NOT done (friction 0.1): ")


def test_on_another_ground_verdict_and_chance_stay_and_say_that_they_are_of_a_level_one(
    studio: Studio, file: Path
) -> None:
    before = _header(studio)
    assert studio.meet({"ground": "stairs", "size": 0.05}) == {}
    header = _header(studio)
    world, verdict = header["editor"]["world"], header["verdict"]
    assert (world["ground"], world["size"], world["is_usual"]) == ("stairs", 0.05, False)
    assert world["told"] == "friction 0.5, stairs, step 0.05 m"
    assert "are those of level ground" in world["warning"]
    assert verdict == {**before["verdict"], "world": "friction 0.5, level ground"}
    told = str(studio.meet({"ground": "stairs", "size": 2.0})["error"])
    assert told == "step must be between 0.01 and 0.2 m, got 2"
    assert _header(studio) == header, "what is refused changes nothing"
    assert studio.meet({}) == {}
    assert _header(studio)["verdict"] == before["verdict"]
    assert file.read_text(encoding="utf-8") == TURN


@pytest.mark.slow
def test_physics_plays_it_on_that_ground_which_is_drawn_below_its_feet(studio: Studio) -> None:
    _, level = _played(studio)
    assert "ground" not in level
    told, sloping = _played(studio, ground="slope", size=8.0)
    assert told.startswith("played in MuJoCo (friction 0.5, slope, angle 8 deg): done")
    feet = sloping["feet"].reshape(-1, 4, 3)[0]
    ahead, behind = feet[:2].mean(axis=0), feet[2:].mean(axis=0)
    (way, _, rise) = ahead - behind
    assert rise / way == pytest.approx(np.tan(np.radians(8.0)), abs=SLOPE_ERROR)
    heights = sloping["ground"][sloping["ground"] > UNKNOWN]
    assert np.ptp(heights) > 100, "millimetres"


@pytest.mark.parametrize(
    ("order", "told"),
    [
        ({"friction": 0}, "friction must be between 0.0001 and 2"),
        ({"payload": 50.0}, "payload must be between 0 and 12"),
        ({"friction": "wet"}, "friction must be a number, got 'wet'"),
        ({"friction": None}, "friction must be a number, got None"),
        ({"payload": True}, "payload must be a number, got True"),
        ({"payload": float("nan")}, "payload must be"),
        ({"sensors": "eyes"}, "unknown sensors 'eyes'"),
    ],
)
def test_what_is_no_world_is_told_and_changes_nothing(
    studio: Studio, order: dict[str, object], told: str
) -> None:
    before = _header(studio)
    assert told in str(studio.meet(order)["error"])
    assert _header(studio) == before
