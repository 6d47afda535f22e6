"""The studio's 3D handles, zoom, music, and several bars and motions at once, as a user does it."""

import re
from pathlib import Path

import numpy as np
import pytest

from motions.music import click_track
from tests.viz.replay.browsing import Tab
from tests.viz.replay.studio_tab import SETTLED, do

pytestmark = pytest.mark.slow
ON_BEAT = 0.01  #: s; a beat of a click track is found as near as that
DANCE = '''"""Dances."""

from motions import Timeline, deg, motion

LOW = 0.03


@motion
def dance() -> Timeline:
    """Raise a paw, step, walk."""
    line = Timeline().body(z=-LOW, over=0.6).home(over=0.6)
    line = line.foot("FR", z=0.08, over=0.5).down("FR", over=0.5)
    return line.step("FL", 0.04, over=0.4).walk(0.1)


@motion
def encore() -> Timeline:
    """Bow."""
    return Timeline().pose("bow", over=0.8).home(over=0.8)
'''


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("studio") / "dance.py"
    path.write_text(DANCE, encoding="utf-8")
    click_track(100.0, 12.0).save(path.with_name("clicks.wav"))
    return path


def _choose(tab: Tab, name: str) -> None:
    """Click the bar of the first call of a method."""
    index = tab.evaluate(f"studio.editor.bars.findIndex((bar) => bar.name === '{name}')")
    tab.page.locator(f"[data-bar='{index}']").first.click()


def _pull(tab: Tab, hand: str, dx: float, dy: float, *, key: str = "") -> None:
    box = tab.page.locator(f"[data-hand='{hand}']").bounding_box() or {}
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    mouse = tab.page.mouse
    mouse.move(x, y)
    if key:
        tab.page.keyboard.down(key)
    mouse.down()
    mouse.move(x + dx, y + dy, steps=4)
    tab.evaluate("new Promise((done) => setTimeout(done, 50))")
    mouse.up()
    if key:
        tab.page.keyboard.up(key)
    tab.wait_for(SETTLED)


def _number(file: Path, pattern: str) -> float:
    found = re.search(pattern, file.read_text(encoding="utf-8"))
    assert found is not None, file.read_text(encoding="utf-8")
    return float(found[1])


def test_a_paw_is_pulled_up_and_the_camera_stays(tab: Tab, file: Path) -> None:
    _choose(tab, "foot")
    view = np.array(tab.evaluate("replay.scene.viewer.camera.position.toArray()"))
    _pull(tab, "paw 1", 0.0, -30.0)
    assert 0.1 < _number(file, r'foot\("FR", z=([\d.]+), over') < 0.25
    lines = zip(DANCE.splitlines(), file.read_text(encoding="utf-8").splitlines(), strict=True)
    assert sum(before != after for before, after in lines) == 1
    moved = np.array(tab.evaluate("replay.scene.viewer.camera.position.toArray()")) - view
    assert np.abs(moved).max() < 0.03


def test_a_paw_goes_no_farther_than_the_leg(tab: Tab, file: Path) -> None:
    _choose(tab, "foot")
    tab.evaluate("studio.hands.hold(studio.hands.hands[0], studio.hands.at(studio.hands.hands[0]))")
    reached = tab.evaluate(
        "(() => { const at = (way) => { const ok = studio.hands.pose(way);"
        " return [ok, studio.hands.footAt(studio.hands.held.legs[1])]; };"
        " return [studio.hands.held.start, at([0.02, 0.01, 0.03]), at([1.0, 0.0, 0.3])]; })()"
    )
    start, (is_near, near), (is_far, far) = reached
    assert is_near
    assert np.allclose(near, np.add(start, [0.02, 0.01, 0.03]), atol=0.002)
    assert not is_far
    hip = tab.evaluate(
        "(() => { const at = new MeshCat.THREE.Vector3().setFromMatrixPosition("
        "replay.scene.body.joints[4].node.matrixWorld); return [at.x, -at.z, at.y]; })()"
    )
    assert 0.3 < np.linalg.norm(np.subtract(far, hip)) < 0.43, "a stretched leg of 0.426 m"
    tab.evaluate("studio.hands.held = null")


def test_the_trunk_is_pulled_and_a_constant_with_a_sign_follows(tab: Tab, file: Path) -> None:
    _choose(tab, "body")
    _pull(tab, "trunk", 0.0, 12.0)
    assert _number(file, r"\nLOW = ([\d.-]+)\n") > 0.035, "lower still: z is -LOW"
    assert "body(z=-LOW, over=0.6)" in file.read_text(encoding="utf-8")


def test_the_nose_turns_the_trunk(tab: Tab, file: Path) -> None:
    _choose(tab, "body")
    _pull(tab, "nose", 0.0, 12.0)
    assert 1.0 < _number(file, r"pitch=deg\(([\d.-]+)\)") < 25.0


def test_where_a_foot_steps_is_pulled_over_the_ground(tab: Tab, file: Path) -> None:
    _choose(tab, "step")
    _pull(tab, "place 0", 25.0, 4.0)
    assert _number(file, r'step\("FL", ([\d.]+),') > 0.05


def test_another_paw_that_is_pulled_becomes_a_move(tab: Tab, file: Path) -> None:
    _choose(tab, "home")
    _pull(tab, "paw 2", 0.0, -40.0)
    made = r'\.foot\("RL", z=([\d.]+), over=0.5, x=-?[\d.]+\)\.down\("RL", over=0.5\)'
    assert 0.03 < _number(file, made) < 0.3
    assert tab.evaluate("[studio.bar().name, studio.bar().values.leg]") == ["foot", "RL"]


def test_a_paw_moves_by_keys(tab: Tab, file: Path) -> None:
    _choose(tab, "foot")
    tab.page.locator("[data-hand='paw 1']").focus()
    tab.page.keyboard.press("ArrowUp")
    tab.wait_for(SETTLED)
    assert _number(file, r'foot\("FR", z=([\d.]+), over') == pytest.approx(0.09, abs=0.003)


def test_time_is_zoomed_and_fitted(tab: Tab) -> None:
    whole = tab.evaluate("studio.view.length")
    box = tab.page.locator("#timeline").bounding_box() or {}
    middle = box["x"] + 0.5 * box["width"], box["y"] + 10
    tab.page.mouse.move(*middle)
    before = tab.evaluate(f"replay.charts[0].timeAt({0.5 * box['width']})")
    tab.page.mouse.wheel(0, -500)
    tab.wait_for(f"studio.view.length < 0.5 * {whole}")
    after = tab.evaluate(f"replay.charts[0].timeAt({0.5 * box['width']})")
    assert after == pytest.approx(before, abs=0.02), "the time under the pointer stays"
    assert tab.is_shown("#overview")
    tab.page.keyboard.press("0")
    tab.wait_for(f"studio.view.length === {whole}")
    _choose(tab, "down")
    tab.page.keyboard.press("z")
    tab.wait_for("Math.abs(studio.view.length - 0.8) < 0.5 && studio.view.length < 2")
    tab.page.keyboard.press("0")


def test_several_bars_are_chosen_and_moved_by_keys(tab: Tab, file: Path) -> None:
    _choose(tab, "body")
    keys = tab.page.keyboard
    keys.press("Shift+ArrowRight")
    assert tab.evaluate("studio.chosen.size") == 2
    keys.press("]")
    tab.wait_for(SETTLED)
    changed = DANCE.replace("over=0.6).home(over=0.6)", "over=0.65).home(over=0.65)")
    assert file.read_text(encoding="utf-8") == changed
    keys.press("Control+z")
    tab.wait_for(f"{SETTLED} && !studio.editor.undo")
    tab.page.locator("[data-bar='2']").first.click()
    tab.page.locator("[data-bar='3']").first.click(modifiers=["Shift"])
    keys.press("d")
    tab.wait_for(SETTLED)
    foot, down = '.foot("FR", z=0.08, over=0.5)', '.down("FR", over=0.5)'
    twice = DANCE.replace(down, f"{down}{foot}\n    line = line{down}")
    assert file.read_text(encoding="utf-8") == twice
    assert tab.evaluate("[...studio.chosen]") == [4, 5], "the copies are chosen"
    keys.press("Delete")
    tab.wait_for(SETTLED)
    assert file.read_text(encoding="utf-8") == DANCE


def test_several_bars_are_dragged_past_the_next(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='2']").first.click()
    tab.page.locator("[data-bar='3']").first.click(modifiers=["Shift"])
    box = tab.page.locator("[data-bar='2']").bounding_box() or {}
    tab.page.mouse.move(box["x"] + 10, box["y"] + 8)
    tab.page.mouse.down()
    home = tab.page.locator("[data-bar='1']").bounding_box() or {}
    tab.page.mouse.move(home["x"] + 3, box["y"] + 8, steps=3)
    assert tab.is_shown(".mark")
    tab.page.mouse.up()
    tab.wait_for(SETTLED)
    bars = tab.evaluate("studio.editor.bars.map((bar) => bar.name)")
    assert bars == ["body", "foot", "down", "home", "step", "walk"]
    assert tab.evaluate("[...studio.chosen]") == [1, 2]


def test_moves_are_copied_into_another_motion(tab: Tab, file: Path) -> None:
    tab.page.locator("[data-bar='2']").first.click()
    tab.page.locator("[data-bar='3']").first.click(modifiers=["Shift"])
    tab.page.keyboard.press("Control+c")
    tab.wait_for("studio.tools.told === 'copied 2 moves'")
    tab.page.get_by_role("tab", name="Encore").click()
    tab.wait_for("studio.editor.motion === 'encore' && replay.data.header.title === 'encore'")
    tab.page.locator("[data-bar='1']").first.click()
    tab.page.keyboard.press("Control+v")
    tab.wait_for(f"{SETTLED} && studio.editor.bars.length === 4")
    one = 'Timeline().pose("bow", over=0.8).home(over=0.8)'
    two = f'{one}.foot("FR", z=0.08, over=0.5)\n        .down("FR", over=0.5)'
    pasted = DANCE.replace(f"return {one}", f"return (\n        {two}\n    )")
    assert file.read_text(encoding="utf-8") == pasted
    tab.evaluate("studio.act('undo')")
    tab.wait_for(SETTLED)
    tab.page.get_by_role("tab", name="Dance").click()
    tab.wait_for("studio.editor.motion === 'dance'")


def test_a_bar_ends_on_a_beat_of_the_song(tab: Tab, file: Path) -> None:
    tab.page.get_by_label("Music", exact=True).select_option("clicks.wav")
    tab.wait_for("studio.music.song !== null")
    beats = tab.evaluate("studio.music.beats")
    assert tab.text("#tempo") == "100 beats/min"
    assert tab.evaluate("replay.sound.audio !== null")
    assert tab.evaluate("studio.music.first.selectedOptions[0].text") == "Bars of 4, from beat 1"
    tab.page.get_by_label("Bars begin on").select_option("Bars of 4, from beat 3")
    assert tab.evaluate("studio.music.downbeat") == 2
    box = tab.page.locator("[data-bar='0']").bounding_box() or {}
    right, middle = box["x"] + box["width"], box["y"] + box["height"] / 2
    second = box["width"] / 0.6
    assert "Accent is on" in tab.text("#studio-say")
    for ease in (r", ease=\"cubic\"", ""):  # it turns back there, where that is not switched off
        tab.page.mouse.move(right - 3, middle)
        tab.page.mouse.down()
        tab.page.mouse.move(right - 3 + 0.5 * second + 2, middle, steps=3)
        tab.page.mouse.up()
        tab.wait_for(SETTLED)
        end = _number(file, rf"body\(z=-LOW, over=([\d.]+){ease}\)")
        assert np.abs(np.array(beats) - end).min() < 0.001
        assert abs((end - 0.5 + 0.3) % 0.6 - 0.3) < ON_BEAT, "a click track of 100 begins at 0.5 s"
        do(tab, "studio.act('undo')")
        tab.evaluate("studio.music.accent.click()")
    assert tab.evaluate("studio.music.accent.getAttribute('aria-pressed')") == "true"
    do(tab, "studio.act('redo')")
    tab.page.get_by_label("Music", exact=True).select_option(index=0)
    tab.wait_for("replay.sound.audio === null")


def test_a_tempo_is_tapped(tab: Tab) -> None:
    tab.evaluate("window.clock = 1e6, performance.now = () => clock")
    for _ in range(5):
        tab.page.keyboard.press("t")
        tab.evaluate("clock += 480")
    tab.evaluate("void delete performance.now")
    assert tab.text("#tempo") == "125 beats/min"
    assert np.allclose(np.diff(tab.evaluate("studio.music.beats")), 0.48)


def test_keys_are_listed(tab: Tab) -> None:
    tab.page.keyboard.press("?")
    assert tab.is_shown("#keys")
    assert "Ctrl + Z" in tab.text("#keys")
    tab.page.get_by_role("button", name="Close").click()
    tab.wait_for("document.getElementById('keys') === null")
