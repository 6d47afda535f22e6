"""What the studio's page says in a choreographer's words, and where that is seen."""

from pathlib import Path

import pytest

from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, do, undo_all
from viz.style import LEG_COLORS

pytestmark = pytest.mark.slow
SAID = "document.getElementById('studio-say').textContent"
WHY = "#studio-why button"
FEET = '''"""Feet."""

from motions import Timeline, deg, find_motion, motion


@motion
def feet() -> Timeline:
    """Each foot, a turn, a nod; it ends with a foot in the air."""
    line = Timeline()
    for leg in ("FL", "FR", "RL", "RR"):
        line = line.foot(leg, z=0.05, over=0.5).down(leg, over=0.5)
    line = line.body(z=-0.02, over=0.5).home(over=0.5).turn(deg(20.0))
    return line.then(find_motion("nod")()).foot("FR", z=0.08, over=0.5)
'''
FILE = "feet.py", FEET


def _index(tab: Tab, name: str) -> int:
    """Of the first call of a method."""
    return tab.evaluate(f"studio.editor.bars.findIndex((bar) => bar.name === '{name}')")


def test_what_needs_the_way_home_first_is_refused_in_words_and_inserted_with_it(
    tab: Tab, file: Path
) -> None:
    tab.evaluate("studio.playBehind('bow')")
    tab.wait_for(f"{SETTLED} && {SAID}.includes('All home before it')")
    assert tab.text("#studio-say") == (
        "it starts standing at home, and there the front right foot is up."
        " All home before it does that (line 13)"
    )
    assert file.read_text(encoding="utf-8") == FEET
    tab.page.get_by_role("button", name="All home, then Bow").click()
    tab.wait_for(f"{SETTLED} && studio.editor.bars.some((bar) => bar.parts[0] === 'time')")
    tab.wait_for(f"{SETTLED} && {SAID} === 'saved' && studio.bar().name === 'then'")
    assert '.home(over=0.8).then(find_motion("bow")())' in "".join(file.read_text("utf-8").split())
    undo_all(tab, file, FEET)


def test_what_is_missing_at_the_end_is_one_button(tab: Tab, file: Path) -> None:
    assert tab.text(WHY).startswith("The motion is not over: it must end at rest on four feet")
    tab.evaluate("document.activeElement.blur()")
    tab.page.keyboard.press("r")
    tab.wait_for(f"{SAID} === 'only its way home is missing: one click adds that'")
    assert tab.evaluate("document.activeElement.textContent") == "Add All home"
    tab.page.keyboard.press("Enter")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert '.foot("FR", z=0.08, over=0.5).home(over=0.8)\n' in file.read_text(encoding="utf-8")
    assert tab.text("#badge").startswith("feasible")
    assert not tab.is_shown("#studio-why")


@pytest.mark.parametrize("size", [(1280, 720), (390, 844)])
def test_why_a_bar_is_red_stands_in_view_however_many_lanes_there_are(
    tab: Tab, size: tuple[int, int]
) -> None:
    tab.resize(*size)
    body = _index(tab, "body")
    do(tab, f"studio.set(studio.editor.bars[{body}], 'z', -0.2, true)")
    do(tab, f"studio.select({body})")
    broken = tab.evaluate("studio.bar().broken")
    assert tab.text(WHY) == f"Sink 20 cm: {broken}"
    assert tab.page.locator("[data-slot=z]").input_value() == "-20"
    assert (
        tab.evaluate("studio.inspector.box.querySelector('[data-slot=z] + small').textContent")
        == "cm"
    )
    if size[0] < 820:  # there the page scrolls: the reason is at the bars
        tab.page.locator("#bars").scroll_into_view_if_needed()
    box = tab.page.locator(WHY).first.bounding_box() or {}
    bars = tab.page.locator("#bars").bounding_box() or {}
    assert box["y"] >= 0
    assert box["y"] + box["height"] <= bars["y"] + 1
    assert size[0] < 820 or box["y"] + box["height"] < size[1]
    tab.resize(1280, 720)


def test_a_move_is_inserted_at_the_playhead_where_none_is_chosen(tab: Tab, file: Path) -> None:
    body = _index(tab, "body")
    do(tab, f"replay.scrub(studio.editor.bars[{body}].span[2] - 0.1); studio.choose([])")
    do(tab, "studio.redraw()")
    tab.page.get_by_label("Insert a move").select_option("Pause")
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert ".body(z=-0.02, over=0.5).hold(0.5).home" in file.read_text(encoding="utf-8")
    do(tab, "studio.act('undo')")
    do(tab, "replay.scrub(0); studio.choose([])")
    tab.page.get_by_label("Insert a move").select_option("All home")
    tab.wait_for(SETTLED)
    text = file.read_text(encoding="utf-8")
    assert text.endswith(".home(over=0.8)\n"), "the playhead at the start says no place"


def test_a_split_that_is_refused_says_so_without_code(tab: Tab) -> None:
    foot = _index(tab, "foot")
    do(tab, f"studio.select({foot}); replay.scrub(studio.bar().span[2] - 0.1)")
    tab.page.keyboard.press("k")
    tab.wait_for(SETTLED)
    assert tab.text("#studio-say") == (
        "Raise 5 cm: it runs 4 times in a loop: write the loop out first"
    )
    last = "studio.editor.bars.length - 1"
    do(tab, f"studio.select({last}); replay.scrub(studio.bar().span[0] + 0.1)")
    tab.page.keyboard.press("k")
    tab.wait_for(SETTLED)
    said = tab.text("#studio-say")
    assert said.startswith("Raise 8 cm: the playhead is at ")
    assert said.endswith("while the trunk shifts (hatched) there is nothing to split")


def test_a_leg_has_one_colour(tab: Tab) -> None:
    rgb = [tuple(int(color[k : k + 2], 16) for k in (1, 3, 5)) for color in LEG_COLORS]
    edges = tab.evaluate(
        "['FL', 'FR', 'RL', 'RR'].map((leg) => getComputedStyle("
        "studio.tracks.strips.get(leg).querySelector('.bar')).borderLeftColor)"
    )
    assert edges == [f"rgb({r}, {g}, {b})" for r, g, b in rgb]
    tab.draw()
    phases = tab.evaluate(
        "(() => { const chart = replay.charts[0], { labels } = replay.data.header;"
        " const ratio = devicePixelRatio, paint = chart.picture.getContext('2d');"
        " return ['FL up', 'FR up', 'RL up', 'RR up', 'on four feet'].map((name) => {"
        " const [from, to] = labels.find(([, , label]) => label === name);"
        " const x = Math.round(chart.xAt((from + to) / 2) * ratio);"
        " return [...paint.getImageData(x, 3 * ratio, 1, 1).data]; }); })()"
    )
    for (*found, alpha), color in zip(phases, [*rgb, None], strict=True):
        if color is None:
            assert max(found) - min(found) < 20, "no leg's: grey"
        else:
            assert abs(alpha / 255 - 0.3) < 0.05
            assert max(abs(a - b) for a, b in zip(found, color, strict=True)) < 6


def test_a_turn_is_one_bar_and_what_is_written_elsewhere_says_so(tab: Tab) -> None:
    turn, nod = _index(tab, "turn"), _index(tab, "then")
    assert tab.page.locator(f"[data-bar='{turn}']").count() == 1
    inner = tab.evaluate("studio.editor.bars.findIndex((bar) => bar.site[0] === 0)")
    assert inner != nod
    bar = tab.page.locator(f"[data-bar='{inner}']")
    assert "part of Nod, which is written in another file" in str(bar.get_attribute("title"))
    bar.click()
    assert "It is part of Nod, which is written in another file" in tab.text("#inspector")


def test_all_kinds_are_exported_from_one_list_by_keys(tab: Tab, file: Path) -> None:
    exports = tab.page.get_by_role("combobox", name="Export")
    words = tab.evaluate("Object.values(studio.player.data.header.editor.exports)")
    assert exports.locator("option").all_inner_texts() == ["Export…", *words]
    assert len({word[0] for word in words}) == len(words), "each by a key of its own"
    exports.focus()
    tab.page.keyboard.press("t")
    tab.wait_for(f"{SAID} === 'wrote test_feet.py in {file.parent}; next: pytest test_feet.py'")
    assert "def test_the_robot_can_do_feet" in file.with_name("test_feet.py").read_text("utf-8")
    exports.select_option("npz")
    tab.wait_for(f"{SAID} === 'wrote feet.npz in {file.parent}'")
    answer = tab.page.request.get(tab.page.get_by_role("link").evaluate("(a) => a.href"))
    assert answer.body() == file.with_name("feet.npz").read_bytes()
    assert answer.headers["content-type"] == "application/octet-stream"


def test_what_was_exported_is_a_link_to_it(tab: Tab, file: Path) -> None:
    do(tab, "studio.export('html')")
    tab.wait_for(f"{SAID} === 'wrote feet.html in {file.parent}'")
    with tab.page.context.expect_page() as opened:
        tab.page.get_by_role("link", name="feet.html").click()
    page = opened.value
    page.wait_for_selector("#badge:not(:empty)")
    assert page.evaluate("document.getElementById('inspector')") is None, "a page of its own"
    page.close()
    file.with_name("feet.html").unlink()
    answer = tab.page.request.get(tab.page.get_by_role("link").evaluate("(a) => a.href"))
    assert answer.status == 404
