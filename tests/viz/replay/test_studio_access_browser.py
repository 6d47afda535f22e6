"""The studio for everyone: names and contrast, light and dark, phone and tablet, keys, fingers."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import pytest

from tests.viz.replay.browsing import SIZE, Tab
from tests.viz.replay.studio_tab import SETTLED
from tests.viz.replay.test_studio_hands_browser import DANCE

pytestmark = pytest.mark.slow
STATES = (
    *("studio.tools.told", "studio.tour.end()", "studio.select(0)", "studio.world.open()"),
    "studio.tools.help()",
)
"""The tour, nothing chosen, a limit broken, the world, the keys."""
AS_AT_FIRST = """document.getElementById('keys').close(), studio.world.box.open = false,
    studio.choose([]), studio.redraw(), studio.tour.start()"""
SIZES = ((1400, 900), (800, 1000), (390, 844))
CONTRAST = 4.5
"""Of text and what is behind it, at the least (WCAG 2.1, 1.4.3, level AA)."""
FINDINGS = """(() => {
  const found = [];
  const isShown = (e) => e.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  const tell = (what, e) => found.push(`${what}: ${e.outerHTML.slice(0, 120)}`);
  const name = (e) => e.getAttribute("aria-label") || (e.matches("input, select, textarea")
    ? e.labels[0]?.textContent : e.textContent.trim());
  const roles = "button, input, select, textarea, summary, a[href], [role], [tabindex]";
  for (const e of document.querySelectorAll(roles)) {
    if (!isShown(e)) continue;
    if (e.matches("[role=status], [role=alert], [role=presentation]")) continue;
    if (!name(e)) tell("no name", e);
    if (e.tabIndex > 0) tell("jumps the order of the keys", e);
    if (e.matches("button") && e.querySelector("button, input, select")) tell("nested", e);
  }
  for (const e of document.querySelectorAll("[role=tab]")) {
    if (!e.closest("[role=tablist]")) tell("no list of tabs", e);
  }
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
  ids.filter((id, k) => ids.indexOf(id) !== k).forEach((id) => found.push(`twice: ${id}`));
  const rgba = (text) => {
    const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number);
    return text.startsWith("color(srgb") ? [255 * r, 255 * g, 255 * b, a] : [r, g, b, a];
  };
  const over = ([r, g, b, a], under) => [r, g, b].map((v, k) => a * v + (1 - a) * under[k]);
  const known = new Map([[null, [255, 255, 255]]]);
  const behind = (e) => {
    if (!known.has(e)) {
      const own = rgba(getComputedStyle(e).backgroundColor);
      known.set(e, own[3] === 1 ? own.slice(0, 3) : over(own, behind(e.parentElement)));
    }
    return known.get(e);
  };
  const light = (c) => c.map((v) => v / 255)
    .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let checked = 0;
  while (texts.nextNode()) {
    const e = texts.currentNode.parentElement;
    const isText = texts.currentNode.textContent.trim() && !e.closest("script, style, option");
    if (!isText || !isShown(e) || e.closest(":disabled, #stage")) continue; // a picture below
    const back = behind(e.closest(".bar.beside > span") ? e.closest(".lane > div") : e);
    const [a, b] = [light(over(rgba(getComputedStyle(e).color), back)), light(back)];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < LEAST) tell(`contrast ${contrast.toFixed(2)}`, e);
    checked += 1;
  }
  return [checked, found];
})()""".replace("LEAST", str(CONTRAST))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("studio") / "dance.py"
    path.write_text(DANCE.replace("over=0.6).home", "pitch=deg(41.0), over=0.6).home", 1))
    return path


@pytest.fixture
def begun(tab: Tab) -> Tab:
    """The page as it is opened first: with its tour, nothing chosen."""
    tab.evaluate("document.activeElement.blur(), studio.choose([]), studio.tour.start()")
    return tab


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_everything_has_a_name_and_can_be_read(
    begun: Tab, scheme: Literal["dark", "light"]
) -> None:
    tab = begun
    with tab.page.expect_navigation():  # its 3D view and charts take their colours as it is loaded
        tab.page.emulate_media(color_scheme=scheme)
    tab.wait_for("window.studio && replay.version")
    tab.evaluate("studio.tour.start()")
    for width, height in SIZES:
        tab.resize(width, height)
        for state in STATES:
            tab.evaluate(state)
            checked, found = tab.evaluate(FINDINGS)
            assert found == [], (state, width)
            assert checked > 40
            assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), width
        tab.evaluate(AS_AT_FIRST)
    tab.evaluate("studio.tour.end()")
    tab.resize(*SIZE)


def test_what_is_wrong_is_found(tab: Tab) -> None:
    tab.evaluate(
        "window.list = document.querySelector('[aria-label=Export]'),"
        " window.word = document.querySelector('#studio-tools b'),"
        " list.removeAttribute('aria-label'), word.style.color = '#aaaaaa'"
    )
    found = " ".join(tab.evaluate(FINDINGS)[1])
    assert "no name: <select" in found
    assert "contrast 2.3" in found
    tab.evaluate("list.setAttribute('aria-label', 'Export'), word.style.color = ''")


def test_a_motion_is_edited_with_keys_alone(begun: Tab, file: Path) -> None:
    tab, before = begun, file.read_text(encoding="utf-8")
    press = tab.page.keyboard.press
    press("Escape")  # the tour
    assert tab.evaluate("document.getElementById('tour') === null")
    press("l")
    press("ArrowRight")
    press("Enter")
    assert tab.evaluate("studio.bar().name") == "home"
    press("e")
    tab.page.keyboard.type("0.9")  # what is in a field that is reached by a key is replaced
    press("Enter")
    tab.wait_for(f"{SETTLED} && studio.editor.undo")
    assert ".home(over=0.9)" in file.read_text(encoding="utf-8")
    press("Escape")
    press("Control+z")
    tab.wait_for(f"{SETTLED} && !studio.editor.undo")
    assert file.read_text(encoding="utf-8") == before


def test_two_fingers_zoom_the_time(tab: Tab) -> None:
    tab.evaluate("studio.choose([]), studio.redraw()")
    tab.resize(800, 1000)
    whole = tab.evaluate("studio.view.length")
    box: Any = tab.page.locator("#bars").bounding_box()
    y, middle = box["y"] + 12, box["x"] + box["width"] / 2
    session = tab.page.context.new_cdp_session(tab.page)
    session.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    for kind, apart in (("touchStart", 60), ("touchMove", 120), ("touchMove", 240)):
        points = [
            {"x": middle + side * apart / 2, "y": y, "id": n} for n, side in enumerate((-1, 1))
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    tab.wait_for(f"studio.view.length < 0.5 * {whole}")
    assert tab.is_shown("#overview")
    assert tab.evaluate("studio.chosen.size") == 0
    session.detach()
    tab.resize(*SIZE)
