"""What is computed is written out on the page: its lines are shown first, and what is elsewhere."""

from pathlib import Path

import pytest

from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, undo_all

pytestmark = pytest.mark.slow
STEPS = '''"""Steps."""

from functools import reduce

from steps_beside import dip
from motions import Timeline, deg, motion

ANGLES = [6.0, -6.0]


@motion
def scan() -> Timeline:
    """Look here and there."""
    line = reduce(lambda line, a: line.body(yaw=deg(a), over=0.6), map(float, ANGLES), Timeline())
    return line.home(over=0.6).then(dip())
'''
BESIDE = """from motions import Timeline


def dip() -> Timeline:
    return Timeline().body(z=-0.03, over=0.5).home(over=0.5)
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("studio") / "steps.py"
    path.with_name("steps_beside.py").write_text(BESIDE, encoding="utf-8")
    path.write_text(STEPS, encoding="utf-8")
    return path


def _choose(tab: Tab, bar: int, title: str) -> None:
    tab.page.locator(f"[data-bar='{bar}']").click()
    tab.page.locator("#inspector").get_by_role("button", name=title).click()
    tab.wait_for("document.querySelector('#proposal')")


def test_lines_are_shown_before_they_are_written(tab: Tab, file: Path) -> None:
    before = tab.evaluate("replay.data.duration")
    _choose(tab, 0, "Write it out")
    added = tab.page.locator("#proposal .added").all_inner_texts()
    assert [row.strip() for row in added] == [
        "+    line = Timeline().body(yaw=deg(6.0), over=0.6).body(yaw=deg(-6.0), over=0.6)"
    ]
    tab.page.get_by_role("button", name="Leave it as it is").click()
    assert file.read_text(encoding="utf-8") == STEPS
    _choose(tab, 0, "Write it out")
    tab.page.get_by_role("button", name="Write it", exact=True).click()
    tab.wait_for("studio.editor.bars[0].slots.every((slot) => slot.span)")
    tab.wait_for(SETTLED)
    assert "line = Timeline().body(yaw=deg(6.0)" in file.read_text(encoding="utf-8")
    assert tab.evaluate("replay.data.duration") == before
    undo_all(tab, file, STEPS)


def test_a_bar_of_another_file_is_shown_there_and_written_out_here(tab: Tab, file: Path) -> None:
    bar = tab.evaluate("studio.editor.bars.findIndex((bar) => bar.file)")
    _choose(tab, bar, "Show steps_beside.py, line 5")
    assert ".body(z=-0.03" in tab.text("#proposal .meant")
    tab.page.keyboard.press("Escape")
    tab.wait_for("document.querySelector('#proposal') === null")
    _choose(tab, bar, "Write it out")
    tab.page.get_by_role("button", name="Write it", exact=True).click()
    tab.wait_for("studio.editor.bars.every((bar) => !bar.file)")
    tab.wait_for(SETTLED)
    text = file.read_text(encoding="utf-8")
    assert ".then(Timeline().body(z=-0.03, over=0.5).home(over=0.5))" in text
    undo_all(tab, file, STEPS)
