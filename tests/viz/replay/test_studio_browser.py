"""The studio as a user sees it: bars are dragged, and the file says what the page shows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.controller.studio.test_session import GREET
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, served, studio_tab

pytestmark = pytest.mark.slow
TRIANGLES = """(() => {
    let count = 0;
    replay.scene.body.root.traverse((item) => { count += item.geometry?.index?.count ?? 0; });
    return count / 3;
})()"""
"""Of the robot in the 3D view."""
SAID = "document.getElementById('studio-say').textContent"
FILE = "greet.py", GREET


@pytest.fixture(scope="module")
def studio(file: Path, studio_page: Tab) -> Iterator[Tab]:
    with served(file) as url, studio_tab(url, studio_page) as tab:
        for _ in range(4):  # who opens it first is shown around
            tab.page.get_by_role("button", name="Next").click()
        tab.page.get_by_role("button", name="Done").click()
        yield tab


def _bar(tab: Tab, index: int) -> dict[str, Any]:
    return dict(tab.page.locator(f"[data-bar='{index}']").bounding_box() or {})


def test_an_edge_is_dragged(tab: Tab, file: Path) -> None:
    box, mouse = _bar(tab, 0), tab.page.mouse
    right, middle = box["x"] + box["width"], box["y"] + box["height"] / 2
    second, whole = box["width"] / 0.6, tab.evaluate(TRIANGLES)
    tab.evaluate("window.rows = [...document.querySelectorAll('.margin')]")
    mouse.move(right - 3, middle)
    mouse.down()
    mouse.move(right - 3 + 0.2 * second, middle, steps=3)
    tab.wait_for(f"{SAID} === 'not saved yet' && Math.abs(replay.data.duration - 3.5) > 0.1")
    assert file.read_text(encoding="utf-8") == GREET, "a draft is not saved"
    assert tab.page.locator("[data-slot=over]").input_value() == "0.8", "numbers follow the hand"
    assert tab.evaluate("rows.length > 5 && rows.every((row) => row.isConnected)"), "kept"
    assert tab.evaluate(f"{TRIANGLES} < {0.08 * whole}"), (
        "a view that is drawn in software can follow"
    )
    mouse.move(right - 3 + 0.3 * second, middle, steps=2)
    mouse.up()
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert file.read_text(encoding="utf-8") == GREET.replace("(10.0), over=0.6", "(10.0), over=0.9")
    assert _bar(tab, 1)["x"] > right + 0.2 * second, "what follows comes later"
    assert tab.evaluate(TRIANGLES) == whole, "of all parts, small ones too"


def test_the_picture_follows_an_edge_before_the_server_has_told(tab: Tab) -> None:
    tab.evaluate("replay.scrub(0.3); studio.post = () => new Promise(() => {}); 0")
    box, mouse = _bar(tab, 0), tab.page.mouse
    right, middle = box["x"] + box["width"] - 3, box["y"] + box["height"] / 2
    pitch = "(() => { const { y, w } = replay.scene.body.base.quaternion; return y / w; })()"
    half, before = [tab.evaluate(f"replay.scene.show({t}), {pitch}") for t in (0.15, 0.3)]
    mouse.move(right, middle)
    mouse.down()
    mouse.move(right + box["width"], middle, steps=3)  # twice as long
    shown = tab.evaluate(pitch)
    tab.evaluate("delete studio.post, studio.tracks.dragged = null, studio.giveUp()")
    mouse.up()
    tab.evaluate("studio.isBusy = false")
    assert shown == pytest.approx(half, rel=0.25), "to a step of the clock"
    assert before > 2.0 * half


@pytest.mark.parametrize(("index", "own"), [(0, ", over=0.734)"), (1, ".home(over=.60)")])
def test_an_edge_that_is_dragged_back_leaves_the_text_as_it_was(
    tab: Tab, file: Path, index: int, own: str
) -> None:
    """It was rounded to 0.05 s, and written anew: 0.734 came back as 0.75."""
    first = file.read_text(encoding="utf-8")
    text = first.replace(", over=0.6)", ", over=0.734)", 1)
    text = text.replace(".home(over=0.6)", ".home(over=.60)", 1)
    assert own in text
    try:
        file.write_text(text, encoding="utf-8")
        tab.wait_for("Math.abs(studio.editor.bars[0].span[2] - 0.734) < 1e-6")
        box, mouse = _bar(tab, index), tab.page.mouse
        right, middle = box["x"] + box["width"] - 3, box["y"] + box["height"] / 2
        mouse.move(right, middle)
        mouse.down()
        for offset in (25, 60, 8, 0):
            mouse.move(right + offset, middle)
        mouse.up()
        tab.wait_for(f"{SETTLED} && {SAID} === 'saved'")
        assert file.read_text(encoding="utf-8") == text
        assert tab.evaluate("replay.data.duration") == pytest.approx(_length(tab))
    finally:
        file.write_text(first, encoding="utf-8")
        tab.wait_for("Math.abs(studio.editor.bars[0].span[2] - 0.6) < 1e-6")


def _length(tab: Tab) -> float:
    """When the last bar ends that is saved [s]."""
    return float(tab.evaluate("Math.max(...studio.editor.bars.map(({ span }) => span[2]))"))


def test_a_number_is_typed_and_a_broken_limit_is_red(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='0']").click()
    field = tab.page.locator("[data-slot=pitch]")
    assert field.input_value() == "10"
    view = tab.evaluate("replay.scene.viewer.camera.position.toArray()")
    field.select_text()
    field.press_sequentially("41.2")  # digits that choose a view elsewhere
    field.press("Enter")
    assert tab.evaluate("replay.scene.viewer.camera.position.toArray()") == pytest.approx(view)
    tab.wait_for("document.querySelector('[data-bar=\"0\"]').classList.contains('broken')")
    tab.wait_for(SETTLED)
    assert "pitch=deg(41.2)" in file.read_text(encoding="utf-8")
    assert tab.text("#inspector h2").startswith("Nose down 41.2°"), "as its bar"
    assert "broken" in tab.text("#badge")
    assert tab.evaluate("replay.time") == pytest.approx(0.6), "the pose it leads to is shown"
    tab.page.locator("[data-ask=mend]").click()
    tab.wait_for("document.querySelectorAll('#studio-changes button').length > 0")
    tab.click("#studio-changes button")
    tab.wait_for("document.getElementById('badge').textContent.startsWith('feasible')")
    tab.wait_for(SETTLED)


def test_what_the_page_has_kept_and_got_is_what_the_server_shows(tab: Tab) -> None:
    for value in (0.7, 0.8, 0.65):
        tab.evaluate(f"studio.set(studio.editor.bars[0], 'over', {value}, false)")
        tab.wait_for(SETTLED)
    tab.evaluate("studio.set(studio.editor.bars[0], 'over', 0.75, true)")
    tab.wait_for(SETTLED)
    count = tab.evaluate(
        """(async () => {
          const answer = await fetch(`data${location.search}`); // all of it
          const { data } = patched(await answer.arrayBuffer(), replay.data);
          const [whole, own] = [data, replay.data].map(({ buffer }) => new Uint8Array(buffer));
          const isSame = whole.length === own.length && whole.every((byte, k) => byte === own[k]);
          return isSame ? own.length : 0;
        })()"""
    )
    assert count > 10_000


def test_keys_reach_every_bar(tab: Tab, file: Path) -> None:
    keys = tab.page.keyboard
    tab.page.locator("[data-bar='0']").focus()
    keys.press("ArrowRight")
    assert tab.evaluate("document.activeElement.dataset.bar") == "1"
    for press, changed in (
        ("]", GREET.replace("home(over=0.6)\n    for", "home(over=0.65)\n    for")),
        ("d", GREET.replace(".home(over=0.6)\n    for", 2 * ".home(over=0.6)" + "\n    for")),
        ("Delete", GREET.replace(".home(over=0.6)\n    for", "\n    for")),
    ):
        tab.page.locator("[data-bar='1']").focus()
        keys.press(press)
        tab.wait_for(SETTLED)
        assert file.read_text(encoding="utf-8") == changed
        idle = tab.page.locator(".bar.idle").count(), tab.page.locator("#inspector .idle").count()
        assert idle == ((1, 1) if press == "d" else (0, 0)), "it is at home already"
        keys.press("Control+z")
        tab.wait_for(SETTLED)
        assert file.read_text(encoding="utf-8") == GREET


def test_a_move_is_inserted_and_one_that_is_refused_is_told(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='0']").click()
    tab.page.get_by_label("Insert a move").select_option("Pause")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert "(10.0), over=0.6).hold(0.5).home" in file.read_text(encoding="utf-8")
    assert tab.evaluate("studio.bar().name") == "hold", "what was made is chosen"
    before = file.read_text(encoding="utf-8")
    tab.page.locator("[data-bar='3']").click()
    tab.click("[data-op=delete]")
    tab.wait_for(f"{SAID}.includes('the front right foot is not up there')")
    tab.wait_for(SETTLED)
    assert file.read_text(encoding="utf-8") == before
    assert tab.evaluate("studio.selected") == 3, "still that one"


def test_a_bar_that_is_chosen_while_another_is_saved_stays_chosen(tab: Tab, file: Path) -> None:
    order = "{ op: 'set', site: studio.bar().site, number: 0, name: 'over', value: 0.9 }"
    tab.evaluate(f"(() => {{ studio.select(0); studio.send({order}, true); studio.select(2); }})()")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert "(10.0), over=0.9" in file.read_text(encoding="utf-8")
    assert tab.evaluate("studio.selected") == 2


def test_what_is_inserted_next_goes_behind_both_calls_of_a_pair(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='3']").click()
    for title in ("Lift and put down", "Pause"):
        tab.page.get_by_label("Insert a move").select_option(title)
        tab.wait_for(SETTLED)
    assert '.down("FR", over=0.5).hold(0.5)' in file.read_text(encoding="utf-8")


def test_a_draft_is_given_up(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='0']").click()
    field = tab.page.locator("[data-slot=pitch]")
    field.select_text()
    field.press_sequentially("14")
    tab.wait_for(f"{SAID} === 'not saved yet'")
    tab.page.keyboard.press("Escape")
    tab.wait_for(f"studio.selected === null && {SAID} === 'as it is saved'")
    tab.wait_for(SETTLED)
    assert file.read_text(encoding="utf-8") == GREET


def test_what_an_editor_saves_appears(tab: Tab, file: Path) -> None:
    file.write_text(GREET.replace("over=0.6)\n", "over=1.6)\n", 1), encoding="utf-8")
    tab.wait_for("Math.abs(studio.editor.bars[1].span[2] - 2.2) < 0.01")


def test_physics_is_shown_beside_the_plan(tab: Tab) -> None:
    tab.click("[data-ask=play]")
    tab.wait_for("document.getElementById('who').textContent.startsWith('played in MuJoCo: done')")
    assert tab.evaluate("replay.data.ghost !== null && !replay.data.header.is_plan")
    tab.evaluate("replay.play(false)")


def test_nothing_is_wider_than_the_screen(tab: Tab) -> None:
    for width, height in ((390, 844), (844, 390), (1280, 720)):
        tab.resize(width, height)
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), width
        assert tab.evaluate("document.getElementById('bars').clientHeight > 40"), width
