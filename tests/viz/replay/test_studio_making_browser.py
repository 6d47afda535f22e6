"""What the studio's page makes of moves: split, laid out, joined to a show, as a user does it."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motions import find_motion, motion_names
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, do

pytestmark = pytest.mark.slow
SAID = "document.getElementById('studio-say').textContent"
ACTS = '''"""Acts."""

from motions import Timeline, deg, motion


@motion
def bow() -> Timeline:
    """Bow, wait, and come back."""
    return Timeline().body(pitch=deg(10.0), over=1.0).hold(0.5).home(over=0.6)


@motion
def look() -> Timeline:
    """Look aside."""
    return Timeline().body(yaw=deg(12.0), over=0.6).home(over=0.6)
'''
FILE = "acts.py", ACTS


def test_a_move_is_split_at_the_playhead_by_key_and_button(tab: Tab, file: Path) -> None:
    tab.evaluate("replay.scrub(0.55)")
    for _ in range(3):
        tab.page.keyboard.press(",")
    assert tab.evaluate("replay.time") == pytest.approx(0.4)
    whole = tab.evaluate("replay.data.duration")
    do(tab, "document.activeElement.blur()")
    tab.page.keyboard.press("k")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    text = file.read_text(encoding="utf-8")
    assert ".body(pitch=deg(3.17), over=0.4)\n        .body(pitch=deg(10.0), over=0.6).hold" in text
    assert tab.evaluate("replay.data.duration") == pytest.approx(whole)
    assert tab.evaluate("[...studio.chosen]") == [0, 1], "both are chosen"
    tab.evaluate("replay.scrub(1.2)")
    tab.page.get_by_role("button", name="Split").click()
    tab.wait_for("studio.editor.bars.length === 5")
    tab.wait_for(SETTLED)
    assert ".hold(0.2).hold(0.3).home" in file.read_text(encoding="utf-8")


def test_where_nothing_can_be_split_it_says_why(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='1']").click()  # the playhead goes to its end
    do(tab, "studio.split()")
    assert tab.text("#studio-say") == (
        "Pause 0.5 s: the playhead is at 1.50 s: "
        "to split it, put the playhead between 1.00 and 1.50 s"
    )
    assert file.read_text(encoding="utf-8") == ACTS


def test_the_last_bar_has_room_to_be_longer(tab: Tab, file: Path) -> None:
    box = tab.page.locator("[data-bar='2']").bounding_box() or {}
    lane = tab.page.locator(".lane > div").first.bounding_box() or {}
    second = box["width"] / 0.6
    right, middle = box["x"] + box["width"], box["y"] + box["height"] / 2
    assert lane["x"] + lane["width"] - right > 0.3 * second
    mouse = tab.page.mouse
    mouse.move(right - 3, middle)
    mouse.down()
    mouse.move(right - 3 + 0.3 * second, middle, steps=3)
    mouse.up()
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert ".home(over=0.9)" in file.read_text(encoding="utf-8")


def test_a_turn_that_is_too_short_is_told_as_a_turn(tab: Tab) -> None:
    tab.page.locator("[data-bar='2']").click()
    tab.page.get_by_label("Insert a move").select_option("Turn round")
    tab.wait_for("studio.editor.bars.length === 4")
    tab.wait_for(SETTLED)
    do(tab, "studio.set(studio.bar(), 'over', 1.0, true)")
    assert "turn(): 1.00 s are too short" in tab.text("#studio-say")


def test_onion_skins_show_the_robot_before_and_after(tab: Tab) -> None:
    shown = "studio.onion.skins.filter((skin) => skin.body.root.visible).map((skin) => skin.after)"
    assert tab.evaluate("studio.onion.skins.length") == 0, "who does not ask for them pays nothing"
    tab.evaluate("replay.scrub(0.5); document.activeElement.blur()")
    before = tab.stage()
    tab.page.keyboard.press("h")
    assert sorted(tab.evaluate(shown)) == [-0.3, 0.3, 0.6], "0.1 s before the start there is none"
    skins = tab.stage()
    seen = (np.abs(skins - before).max(axis=2) > 12).mean()
    assert 0.002 < seen < 0.1
    red, _, blue = np.moveaxis(skins - before, 2, 0)
    assert (blue - red > 12).any()
    assert (red - blue > 12).any()
    tab.evaluate("replay.scrub(1.25)")
    assert set(tab.evaluate(shown)) == {-0.6, 0.6}, "where it stays, they would hide behind it"
    tab.evaluate("replay.scrub(0.5)")
    tab.page.get_by_role("button", name="Onion skins").click()
    assert np.abs(tab.stage() - before).max() < 2


def test_the_motions_of_a_file_are_made_a_show(tab: Tab, file: Path) -> None:
    tab.page.get_by_role("button", name="Make a show").click()
    tab.wait_for("studio.editor.motion === 'show'")
    tab.wait_for(SETTLED)
    assert "    return bow().then(look())\n" in file.read_text(encoding="utf-8")
    assert tab.page.get_by_role("tab", selected=True).inner_text() == "Show"
    assert tab.evaluate("replay.data.duration") == pytest.approx(3.3)
    assert tab.text("#badge").startswith("feasible")
    do(tab, "studio.export('html')")
    tab.wait_for(f"{SAID}.startsWith('wrote show.html in ')")
    assert file.with_name("show.html").exists()
    do(tab, "studio.act('undo')")
    tab.wait_for("studio.editor.motion === 'bow'")
    assert tab.page.get_by_role("tab").count() == 2


def test_a_motion_of_the_library_is_chosen_by_its_picture(tab: Tab, file: Path) -> None:
    do(tab, "studio.choose([]); replay.scrub(0); document.activeElement.blur()")
    tab.page.keyboard.press("a")
    search = tab.page.get_by_label("Search the library")
    cards = tab.page.locator("#library [data-motion]:visible")
    cards.first.wait_for()
    assert cards.count() == len(motion_names())
    picture = tab.page.locator("[data-motion=nod] i").screenshot()
    assert np.asarray(Image.open(io.BytesIO(picture)).convert("L"), dtype=float).std() > 15.0
    search.fill("nod")
    assert cards.count() < 5
    search.press("Enter")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    text = file.read_text(encoding="utf-8")
    assert "from motions import Timeline, deg, motion, find_motion\n" in text
    assert '\n        .then(find_motion("nod")())\n    )\n' in text
    assert tab.evaluate("studio.bar().name") == "then", "what was made is chosen"
    assert tab.evaluate("described(studio.bar())[0]") == "Nod", "it bears the motion's name"
    assert tab.evaluate("studio.bar().span[0]") == pytest.approx(2.1), "it begins behind the rest"
    assert "others" not in tab.evaluate("studio.bar().more"), "it cannot be given by a name"
    assert tab.evaluate("replay.data.duration") == pytest.approx(2.1 + find_motion("nod")().end)
    do(tab, "studio.select(0); studio.playBehind('nod')")
    assert "home" in tab.text("#studio-say"), "the robot is not at home there"
    assert file.read_text(encoding="utf-8") == text
