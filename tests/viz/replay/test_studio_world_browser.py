"""The world that a motion is checked in is chosen on the page; the file is not touched."""

from pathlib import Path

import pytest

from tests.controller.studio.test_worlds import TURN
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import do

pytestmark = pytest.mark.slow
SAID = "document.getElementById('studio-say').textContent"
FILE = "turn.py", TURN


def test_a_world_is_chosen_with_keys_and_stays_as_the_page_is_loaded_again(
    tab: Tab, file: Path
) -> None:
    press, typed = tab.page.keyboard.press, tab.page.keyboard.type
    tab.evaluate("studio.tour.box && studio.tour.end()")
    assert tab.text("#world summary") == "World: friction 0.5"
    assert tab.text("#badge").startswith("feasible")
    press("w")
    typed("0.2")
    press("Tab")
    tab.wait_for("document.querySelector('#world summary').textContent === 'World: friction 0.2'")
    assert "broken" in tab.text("#badge")
    assert tab.text("#chance p:last-child") == "friction 0.2"
    assert "friction" in tab.text("#studio-why")
    typed("40")
    press("Enter")
    tab.wait_for(f"{SAID}.startsWith('payload must be between 0 and 12')")
    assert tab.evaluate("studio.world.fields.payload.value") == "0"
    tab.page.get_by_label("Feels").select_option("its own sensors")
    told = "World: friction 0.2, sensors imu"
    tab.wait_for(f"document.querySelector('#world summary').textContent === '{told}'")
    assert tab.evaluate(SAID) == ""
    tab.page.reload()
    tab.wait_for("window.studio && replay.version")
    assert tab.text("#world summary") == told
    tab.click("#world summary")
    tab.page.get_by_label("Ground").select_option("stairs")
    tab.wait_for("document.querySelector('#world-warning').textContent.includes('level ground')")
    assert tab.text("#world summary") == f"{told}, stairs, step 0.08 m"
    assert tab.text("#chance p:last-child") == "friction 0.2, level ground", "it knows no sensors"
    tab.page.get_by_label("Step").fill("0.05")
    press("Enter")
    tab.wait_for("document.querySelector('#world summary').textContent.endsWith('step 0.05 m')")
    do(tab, "studio.world.usual.click()")
    tab.wait_for("document.querySelector('#world summary').textContent === 'World: friction 0.5'")
    assert tab.text("#badge").startswith("feasible")
    assert tab.evaluate("studio.world.usual.disabled && studio.world.size.hidden")
    assert tab.text("#world-warning") == ""
    assert file.read_text(encoding="utf-8") == TURN
