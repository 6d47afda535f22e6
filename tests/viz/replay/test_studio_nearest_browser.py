"""The nearest motion is put beside one's own on the page, and taken or left by a key."""

from pathlib import Path

import numpy as np
import pytest

from tests.controller.studio.test_nearness import ASKED, SWAY
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, do, undo_all
from tests.viz.replay.test_studio_access_browser import FINDINGS

pytestmark = pytest.mark.slow
BOX = "document.getElementById('nearest')"
SEEN = """(() => {
  const { canvas } = replay.verdict.large;
  const dots = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < dots.length; i += 4) {
    count += Math.hypot(dots[i] - 0x7c, dots[i + 1] - 0x93, dots[i + 2] - 0xd6) < 30;
  }
  return count;
})()"""
"""How many dots of the large curve are of the ghost's colour."""


RED = """[replay.scene.body, replay.scene.ghost.body].map(({ root }) => {
  let count = 0;
  root.traverse((item) => {
    if (item.isMesh) count += item.material.color.getHex() === FLAG_COLOR;
  });
  return count > 0;
})"""
"""Whether parts of the robot, and of its ghost, are red."""
FILE = "sway.py", SWAY


def _propose(tab: Tab) -> None:
    tab.evaluate("document.activeElement.blur()")
    tab.page.keyboard.press("r")
    tab.wait_for(f"!{BOX}.hidden")


def test_it_is_seen_beside_ones_own_and_left(tab: Tab, file: Path) -> None:
    tab.evaluate("replay.scrub(0.42), replay.openTab('check')")
    before, curve = tab.stage(), tab.evaluate(SEEN)
    _propose(tab)
    told = tab.text("#nearest p")
    assert told.startswith("It is at most ")
    assert " mm (trunk at " in told
    assert tab.text("#nearest p + p").startswith("Yours: 5 limits broken. This one: feasible")
    rows = tab.page.locator("#nearest .added, #nearest .removed").all_inner_texts()
    assert [row.strip() for row in rows] == [
        f"{sign}{text.splitlines()[8]}" for sign, text in (("-", SWAY), ("+", ASKED))
    ]
    assert tab.text("#who") == "Solid: the plan. Blue: the nearest that the robot can do."
    assert tab.text("[data-ghost=ghost]") == "Nearest: beside"
    assert tab.text("#badge") == "5 limits broken", "that is one's own"
    assert tab.text("#force-key") == "planned force"
    assert tab.text("#ghost-force-key") == "force of the blue one"
    assert np.abs(tab.stage() - before).max() > 50.0, "a ghost in the 3D view"
    assert tab.evaluate(RED) == [True, False], "one's own is red"
    assert curve == 0
    assert tab.evaluate(SEEN) > 20, "a curve beside the margin"
    assert tab.page.locator("#studio-changes button").count() > 0, "changes of all of it, too"
    assert tab.evaluate("document.activeElement.textContent") == "Take it (Y)"
    assert tab.evaluate(FINDINGS)[1] == []
    tab.page.keyboard.press("Escape")
    tab.wait_for(f"{BOX}.hidden && replay.data.ghost === null")
    assert file.read_text(encoding="utf-8") == SWAY


def test_it_is_taken_by_a_key_and_undone(tab: Tab, file: Path) -> None:
    _propose(tab)
    tab.page.keyboard.press("y")
    tab.wait_for(f"{BOX}.hidden && {SETTLED} && studio.editor.undo")
    assert file.read_text(encoding="utf-8") == ASKED
    assert tab.text("#badge").startswith("feasible")
    assert tab.evaluate("replay.data.written !== null"), "what was written stays in sight"
    do(tab, "studio.set(studio.editor.bars[0], 'seconds', 0.25, false)")
    assert tab.text("#badge").startswith("coarse: "), "while something is dragged"
    assert tab.text("#who").endswith("is looked for when you let go.")
    assert tab.evaluate(FINDINGS)[1] == []
    do(tab, "studio.giveUp()")
    tab.wait_for("document.getElementById('badge').textContent.startsWith('feasible')")
    undo_all(tab, file, SWAY)
    assert tab.text("#badge") == "5 limits broken"


def test_an_edit_ends_a_proposal(tab: Tab, file: Path) -> None:
    _propose(tab)
    tab.evaluate("studio.set(studio.editor.bars[0], 'seconds', 0.4, true)")
    tab.wait_for(f"{SETTLED} && studio.editor.undo")
    assert tab.evaluate(f"{BOX}.hidden && replay.data.ghost === null")
    assert "hold(0.4)" in file.read_text(encoding="utf-8")


def test_a_suggestion_is_seen_before_it_is_taken(tab: Tab, file: Path) -> None:
    _propose(tab)
    tab.page.keyboard.press("Escape")
    tab.wait_for(f"{BOX}.hidden && replay.data.ghost === null")
    button = tab.page.locator("#studio-changes button").first
    tab.page.mouse.move(5, 5)  # where it was, it may point at one of them
    tab.wait_for("replay.data.ghost === null")
    before = tab.stage()
    meaning = button.inner_text()
    button.hover()
    tab.wait_for("replay.data.ghost !== null")
    assert np.abs(tab.stage() - before).max() > 50.0, "a ghost in the 3D view"
    assert tab.text("#who").startswith(f"Solid: the plan. Blue: {meaning}; feasible")
    assert tab.evaluate("document.querySelector('#studio-changes button').matches(':hover')")
    assert tab.evaluate(FINDINGS)[1] == []
    assert tab.text("#badge") == "5 limits broken", "that is one's own"
    tab.page.mouse.move(5, 5)
    tab.wait_for("replay.data.ghost === null")
    assert np.abs(tab.stage() - before).max() < 20.0, "no ghost; a button may fade yet"
    button.focus()
    tab.wait_for("replay.data.ghost !== null")
    assert file.read_text(encoding="utf-8") == SWAY, "it is only looked at"
    tab.page.keyboard.press("Enter")
    tab.wait_for(f"{SETTLED} && studio.editor.undo && replay.data.ghost === null")
    assert tab.text("#badge").startswith("feasible")
