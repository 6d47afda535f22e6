"""A motion is certified on the page: run by run, with its interval; ended by a button; a table."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.sweeps import run
from tests.controller.studio.test_certifying import NOD
from tests.viz.replay.browsing import SIZE, Tab
from tests.viz.replay.studio_tab import SETTLED, undo_all
from tests.viz.replay.test_studio_access_browser import FINDINGS

pytestmark = pytest.mark.slow
DOING = "document.getElementById('studio-doing')"
RUNS = 3
ROWS = "#certified tbody tr"
FILE = "nod.py", NOD


@pytest.fixture(scope="module", autouse=True)
def _one_process() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "processors", lambda: 1)  # another worker starts longer than it runs
        yield


def _hear(tab: Tab, act: str) -> None:
    """Do something whenever the line of what is being done changes."""
    tab.evaluate(
        f"window.hearing = new MutationObserver(() => {{ {act} }}),"
        f" hearing.observe({DOING}, {{ childList: true, subtree: true, characterData: true }})"
    )


def test_the_interval_is_told_run_by_run_and_stays_as_a_row(tab: Tab, file: Path) -> None:
    tab.evaluate("document.activeElement.blur()")
    tab.page.keyboard.press("v")
    assert tab.evaluate("document.activeElement.getAttribute('aria-label')") == "Certify"
    options = tab.page.locator("[aria-label=Certify] option").all_inner_texts()
    assert options == ["Certify…", "20 runs", "50 runs", "100 runs", "200 runs"]
    assert not tab.is_shown("#certified")
    tab.evaluate("studio.play()")
    assert tab.text("#who").startswith("played in MuJoCo: done")
    tab.evaluate("replay.play(false)")
    _hear(tab, f"(window.told ??= []).push({DOING}.textContent, {DOING}.innerHTML)")
    tab.evaluate(f"void studio.certify.play({RUNS})")
    tab.wait_for(f"document.querySelector('{ROWS}')")
    tab.evaluate("hearing.disconnect()")
    told = tab.evaluate("told")
    live = [text for text in told if text.startswith("done in ") and f"runs, of {RUNS};" in text]
    assert live, "while it is counted; a page on a busy computer may miss the first"
    assert all("95 % interval" in text for text in live)
    assert any("rate-bar" in html for html in told)
    cells = tab.page.locator(f"{ROWS} td").all_inner_texts()
    assert cells[0] == "Nod"
    assert cells[1].startswith("friction 0.5 +-10 %")
    assert cells[2:] == ["3 of 3", "29.2 % to 100 %"]
    tab.wait_for("!document.getElementById('certificate').hidden")
    assert tab.text("#certificate summary b") == "Certificate: done in 3 of 3 runs"
    assert tab.text("#who").startswith("played in MuJoCo: done"), "that stays"
    assert tab.evaluate("!replay.data.header.is_plan && replay.data.ghost !== null")
    assert tab.evaluate(FINDINGS)[1] == []
    for width in (1280, 800):
        tab.resize(width, 720)
        heights = tab.evaluate(
            f"[...document.querySelector('{ROWS}').children].map((cell) => cell.clientHeight)"
        )
        assert max(heights[0], *heights[2:]) < 25, "one line, px"
    tab.resize(*SIZE)
    tab.evaluate(
        "showTrust({ ...replay.data.header.verdict, chance: 0.9, certified: {"
        " ...replay.data.header.verdict.certified, interval: [0, 0.2],"
        " why: '3 of 3 runs failed: fell' } })"
    )
    assert tab.text("#certificate .warning") == "3 of 3 runs failed: fell"
    assert tab.evaluate("document.querySelector('#chance b').className") == "unlikely"
    assert file.read_text(encoding="utf-8") == NOD
    tab.evaluate("studio.set(studio.editor.bars[0], 'over', 0.7, true)")
    tab.wait_for(f"{SETTLED} && studio.editor.undo")
    assert tab.evaluate(f"document.querySelector('{ROWS}').className") == "old"
    assert not tab.is_shown("#certificate"), "that was of another text"
    undo_all(tab, file, NOD)
    assert tab.evaluate(f"document.querySelector('{ROWS}').className") == ""


def test_it_is_cancelled(tab: Tab, file: Path) -> None:
    count = tab.page.locator(ROWS).count()
    cancel = f"{DOING}.querySelector('button').click()"
    _hear(tab, f"if ({DOING}.textContent.includes(' of 200')) {cancel}")
    tab.evaluate("void studio.certify.play(200)")
    tab.wait_for("studio.tools.told === 'stopped: the motion is as it was'")
    tab.evaluate("hearing.disconnect()")
    tab.wait_for(f"{DOING}.hidden")
    assert tab.page.locator(ROWS).count() == count
    assert file.read_text(encoding="utf-8") == NOD


def test_nothing_moves_where_something_is_told(tab: Tab) -> None:
    """Buttons went to a further row, and bars from under the pointer."""
    rate = "{ what: 'certifying', done: 15, whole: 20, rate: [12, 0.548, 0.93] }"
    broken = "{ is_broken: true, limit: 'Torque', subject: 'FL', time: 0, text: 'x'.repeat(200) }"
    place = "['#bars', '[data-ask=play]', '#stage'].flatMap((which) => {"
    place += " const { top, height } = document.querySelector(which).getBoundingClientRect();"
    place += " return [top, height]; })"
    for size in ((1440, 900), (1280, 800)):
        tab.resize(*size)
        before = tab.evaluate(place)
        tab.evaluate(f"studio.doing.use({{ certify: {rate} }}), studio.tell('word '.repeat(99))")
        tab.evaluate(f"studio.doing.explain(studio.editor, [{broken}])")
        assert tab.is_shown("#studio-doing button")
        assert tab.is_shown("#studio-why button")
        assert tab.evaluate(place) == before
        tab.evaluate("studio.doing.use({}), studio.doing.explain(studio.editor, []), 0")
        tab.wait_for(f"{DOING}.hidden")
        tab.evaluate("studio.tell('')")
    tab.resize(*SIZE)
