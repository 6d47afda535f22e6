"""What takes its time on the studio's page: how far it is, how it is ended, what came of it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.studio import searching, session
from motions import FeasibilityChecker, Timeline
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED

pytestmark = pytest.mark.slow
SAID = "document.getElementById('studio-say').textContent"
DOING = "document.getElementById('studio-doing')"
TOO_HIGH = 0.297  #: m, which no one else asks for: that there is no plan is kept
STEP = 0.03  #: m, as near as the highest jump is looked for here; the studio's own is 0.01
SOLVED, TRIED = 2.0, 1.0  #: s of work; the studio's own take three times as long
LEAP = '''"""Leaps."""

from motions import Timeline, motion


@motion
def leap() -> Timeline:
    """Sink, come back, and jump."""
    return Timeline().body(z=-0.03, over=2.0).home(over=2.0).jump(height=0.1).hold(0.5)
'''


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("studio") / "leap.py"
    path.write_text(LEAP, encoding="utf-8")
    FeasibilityChecker().plan(Timeline().jump(height=0.1))  # or it is looked for as the page opens
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "LONGEST_SOLVE", SOLVED)
        patch.setattr(session, "LONGEST_TRY", TRIED)
        patch.setattr(searching, "FINEST", (STEP, 1.0))
        yield path


def _ask_for(tab: Tab, height: float) -> None:
    """Type a height of the jump, and wait until it is solved for."""
    tab.page.locator("[data-bar='2']").click()
    field = tab.page.locator("[data-slot=height]")
    field.select_text()
    field.press_sequentially(f"{100 * height:g}")  # cm
    field.press("Enter")
    tab.wait_for(f"!{DOING}.hidden && {DOING}.textContent.includes('s of at most 2 s')")


@pytest.mark.parametrize("how", ["button", "Escape", "Control+z"])
def test_a_jump_that_is_solved_is_told_and_cancelled(tab: Tab, file: Path, how: str) -> None:
    _ask_for(tab, TOO_HIGH)
    assert tab.evaluate(DOING + ".textContent").startswith(
        "Jump 29.7 cm: looking for a way to do it"
    )
    if how == "button":
        tab.page.get_by_role("button", name="Cancel").click()
    else:
        tab.evaluate("document.activeElement.blur()")
        tab.page.keyboard.press(how)
    tab.wait_for(SETTLED)
    assert tab.text("#studio-say") == "Jump 29.7 cm: stopped: the motion is as it was"
    assert file.read_text(encoding="utf-8") == LEAP
    assert tab.page.locator("[data-slot=height]").input_value() == "10", "what was kept"
    assert tab.evaluate("studio.bar().broken") == ""
    tab.wait_for(f"{DOING}.hidden")


def test_a_jump_that_is_too_high_ends_in_the_highest_that_can_be_done(tab: Tab, file: Path) -> None:
    _ask_for(tab, TOO_HIGH)
    tab.wait_for(f"{SAID}.includes('in 2 s of work; the motion is as it was.')")
    assert tab.text("#studio-say").startswith("Jump 29.7 cm: no way to do it was found")
    assert file.read_text(encoding="utf-8") == LEAP
    tab.wait_for(f"{SAID}.startsWith('Jump 29.7 cm is too much. The most that was found: ')")
    (button,) = tab.page.locator("#studio-changes button").all()
    most = int(button.inner_text().split()[1])
    assert 15 <= most < 28
    button.click()
    tab.wait_for(f"{SAID} === 'saved'")
    tab.wait_for(SETTLED)
    assert f"jump(height={most / 100})" in file.read_text(encoding="utf-8")
    assert tab.text("#badge").startswith("feasible")


def test_what_is_played_is_told_and_cancelled(tab: Tab, file: Path) -> None:
    tab.evaluate(
        "window.told = [], new MutationObserver(() => {"
        f" if (!{DOING}.hidden) told.push({DOING}.textContent); }})"
        f".observe({DOING}, {{ childList: true, subtree: true, characterData: true }})"
    )
    tab.evaluate("document.activeElement.blur()")
    tab.page.keyboard.press("b")
    tab.wait_for("document.getElementById('who').textContent.startsWith('played in MuJoCo: done')")
    tab.evaluate("replay.play(false)")
    played = [text for text in tab.evaluate("told") if " of 5." in text]
    times = [float(text.split("playing in MuJoCo, ")[1].split()[0]) for text in played]
    assert len(times) > 1
    assert times == sorted(times)
    tab.evaluate(
        f"new MutationObserver(() => {{ if ({DOING}.textContent.includes(' of 5.'))"
        f" {DOING}.querySelector('button').click(); }})"
        f".observe({DOING}, {{ childList: true, subtree: true, characterData: true }})"
    )
    tab.page.keyboard.press("b")
    tab.wait_for(f"{SAID} === 'stopped: the motion is as it was'")
    assert file.read_text(encoding="utf-8") == LEAP
