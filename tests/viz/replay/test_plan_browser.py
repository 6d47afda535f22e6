"""A page with verdict and ghost in a real Chromium: findings in red, jumps, margins, the ghost."""

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from go2_wbc.recording import Recording
from tests.viz.replay.browsing import DRAWN, Tab
from tests.viz.replay.conftest import OpenPage
from tests.viz.verdicts import made_up_verdict
from viz.content import CertifiedRate, CertifiedRun, ReplayContent

WRITTEN = "Brown: what was written; the plan is the nearest that the robot can do."
_BEATS = (0.25, 0.75, 1.25, 2.25)
_BROKEN, _FINE = 1.7, 2.8
"""Times [s] at which the made-up verdict has a calf over its limit, and nothing broken."""
_SURENESS = {
    "chance": 0.876,
    "world": "friction 0.4",
    "certified": CertifiedRate(
        n=200,
        done=143,
        interval=(0.648, 0.776),
        confidence=0.95,
        world="friction 0.4, payload 2 kg",
        worst=(CertifiedRun(17, "friction 0.41, mass 0.97", False, "<b>FL slid 23 mm"),),
        versions={"version": "0.1.0", "plan": "ad86f5d05086"},
        outdated="Of another plan than this: certify it again.",
    ),
}


@pytest.fixture(scope="module")
def browser(recording: Recording, open_page: OpenPage) -> Iterator[Tab]:
    verdict = replace(made_up_verdict(recording.duration), **_SURENESS)
    ghost = replace(recording, q=recording.q + [0.0, 0.0, 0.03, *[0.0] * 16])
    content = ReplayContent(
        recording, verdict=verdict, ghost=ghost, beats=_BEATS, end_pose=(0.4, 0.1, 0.5)
    )
    with open_page(content) as tab:
        yield tab


def _red(picture: np.ndarray) -> int:
    red, green, blue = np.moveaxis(picture, 2, 0)
    return int(((red > 120) & (green < 0.42 * red) & (blue < 0.42 * red)).sum())


def _changed(picture: np.ndarray, other: np.ndarray) -> int:
    """Pixels that differ by more than rounding."""
    return int((np.abs(picture - other).max(axis=2) > 20).sum())


def test_a_broken_limit_is_red_where_and_when_it_is_broken(browser: Tab) -> None:
    browser.evaluate("replay.scene.setView('corner')")
    browser.evaluate(f"replay.scrub({_FINE})")
    fine = _red(browser.stage())
    browser.evaluate(f"replay.scrub({_BROKEN}); replay.scene.flags.box.style.display = 'none'")
    broken = _red(browser.stage())
    browser.evaluate("replay.scene.flags.box.style.display = ''")
    assert broken > fine + 300
    assert browser.text(".note b") == "joint position: FR calf"
    assert browser.text(".note span") == "1.2, limit 1 <b>"
    painted = (
        "[...replay.scene.flags.{}].filter(([, meshes]) => "
        "meshes[0].material.color.getHex() === FLAG_COLOR).map(([name]) => name)"
    )
    assert browser.evaluate(painted.format("ghostParts")) == ["FR_calf"]
    assert browser.evaluate(painted.format("parts")) == []
    browser.click("[data-ghost]")
    browser.click("[data-ghost]")
    assert browser.evaluate(painted.format("parts")) == ["FR_calf"]
    assert browser.evaluate(painted.format("ghostParts")) == []
    assert _red(browser.stage()) > fine + 300
    browser.click("[data-ghost]")


def test_a_note_points_at_its_part(browser: Tab) -> None:
    browser.evaluate(f"replay.scrub({_FINE}); replay.scene.setView('corner')")
    browser.draw()
    browser.evaluate(f"replay.scrub({_BROKEN})")
    path = browser.evaluate("document.querySelector('#notes path').getAttribute('d')")
    x, y = (float(value) for value in path.split("L")[1].split("m")[0].split())
    browser.draw()
    seen = browser.evaluate(
        "(() => { const {x, y} = replay.scene.flags.placeOf('FR_calf')"
        ".project(replay.scene.viewer.camera); const pane = replay.scene.pane;"
        " return [(x + 1) / 2 * pane.clientWidth, (1 - y) / 2 * pane.clientHeight]; })()"
    )
    assert (x, y) == pytest.approx(tuple(seen), abs=0.5)
    assert 0 < x < 955
    foot = browser.evaluate(
        "(() => { const f = replay.data.feet, i = 12 * replay.data.frameAt(replay.time) + 3;"
        " const p = replay.scene.flags.placeOf('FR_calf');"
        " const [, aside] = replay.scene.ghost.shift;"
        " return Math.hypot(p.x - f[i], -p.z - f[i + 1] - aside, p.y - f[i + 2]); })()"
    )
    assert foot < 0.22


def test_an_instant_is_shown_too(browser: Tab) -> None:
    time = browser.evaluate("replay.data.annotations[0].time")
    browser.evaluate(f"replay.scrub({time})")
    assert browser.text(".note b") == "support: CoM"
    ball = "replay.scene.node('com/ball').scale.x"
    assert browser.evaluate(ball) > 1
    browser.evaluate(f"replay.scrub({_FINE})")
    assert browser.evaluate(ball) == 1
    assert browser.evaluate("document.querySelector('.note')") is None


def test_a_finding_in_the_list_jumps_to_its_time_and_shows_its_margin(browser: Tab) -> None:
    browser.evaluate("replay.scrub(0)")
    browser.page.locator(".annotation").nth(1).click()
    time = browser.evaluate("replay.data.annotations[1].time")
    assert browser.evaluate("replay.time") == pytest.approx(time)
    assert browser.text("#chosen h2") == "joint position"
    assert browser.text("#chosen output") == "FR calf: 0.2 rad over"
    assert browser.evaluate("document.querySelectorAll('.annotation')[1].classList.contains('now')")
    browser.evaluate(f"replay.scrub({_FINE})")
    assert browser.text("#chosen output") == "FR calf: 0.5 rad left"


def test_chance_and_certificate_stand_where_the_margins_are(browser: Tab) -> None:
    assert browser.text("#verdict #chance p") == "Chance that it is done so: 88 %"
    assert browser.text("#chance .calm") == "friction 0.4"
    assert browser.text("#certificate summary b") == "Certificate: done in 143 of 200 runs"
    assert browser.text("#certificate summary span") == "71.5 %, 95 % interval: 64.8 % to 77.6 %"
    assert "certify it again" in browser.text("#certificate .warning")
    browser.page.locator("#certificate summary").click()
    cells = "[...document.querySelectorAll('#certificate {}')].map((cell) => cell.textContent)"
    run = ["17", "friction 0.41, mass 0.97", "<b>FL slid 23 mm"]
    assert browser.evaluate(cells.format(".failed td")) == run
    held = ["friction 0.4, payload 2 kg", "0.1.0", "ad86f5d05086"]
    assert browser.evaluate(cells.format("dd")) == held
    strip = "getComputedStyle(document.querySelector('#certificate .{}')).{}"
    width = browser.evaluate("document.querySelector('#certificate .rate-bar').clientWidth")
    for name, side, share in (("interval", "left", 0.648), ("interval", "width", 0.128)):
        shown = float(browser.evaluate(strip.format(name, side)).removesuffix("px"))
        assert shown == pytest.approx(share * width, abs=1.0)
    browser.page.locator("#certificate summary").click()


def test_what_is_not_known_is_not_shown(browser: Tab) -> None:
    verdict = "replay.data.header.verdict"
    kept = browser.evaluate(f"({{chance: {verdict}.chance, certified: {verdict}.certified}})")
    browser.evaluate(f"{verdict}.certified = null; replay.use(replay.data)")
    hidden = "document.getElementById('{}').hidden"
    assert not browser.evaluate(hidden.format("trust"))
    assert browser.evaluate(hidden.format("certificate"))
    browser.evaluate(f"{verdict}.chance = null; replay.use(replay.data)")
    assert browser.evaluate(hidden.format("trust"))
    browser.evaluate(f"Object.assign({verdict}, {json.dumps(kept)}); replay.use(replay.data)")
    assert not browser.evaluate(hidden.format("trust"))


def test_the_key_n_goes_from_finding_to_finding(browser: Tab) -> None:
    times = sorted(browser.evaluate("replay.data.annotations.map(annotation => annotation.time)"))
    browser.evaluate("replay.scrub(replay.data.duration)")
    seen = []
    for _ in times:
        browser.page.keyboard.press("n")
        seen.append(browser.evaluate("replay.time"))
    assert seen == pytest.approx(times)


def test_a_margin_that_is_clicked_is_shown_large(browser: Tab) -> None:
    browser.evaluate("document.querySelectorAll('.margin button')[4].click()")
    assert browser.text("#chosen h2") == "torque"
    assert browser.evaluate("document.querySelectorAll('.margin')[4].className") == "margin fine on"
    assert browser.evaluate("document.querySelector('.margin').className") == "margin broken"


def test_the_numbers_of_a_scale_are_not_cut_off_at_its_ends(browser: Tab) -> None:
    written = browser.evaluate(
        "(() => { const seen = [], paint = replay.verdict.large.picture.getContext('2d');"
        " const ownText = paint.fillText; paint.fillText = (text, x, y) => seen.push([text, y]);"
        " drawGrid(paint, {low: 0, high: 50, height: 80, width: 200, left: 40, right: 2,"
        " yAt: (value) => 80 * (1 - value / 50)}); paint.fillText = ownText; return seen; })()"
    )
    assert (written[0][0], written[-1][0]) == ("0", "50")
    assert all(5 <= y <= 75 for _, y in written)


def test_a_peak_of_one_sample_is_drawn_however_many_there_are(browser: Tab) -> None:
    x, y = "(i) => i / 100", "(i) => (i === 4321 ? -7 : i % 3)"
    corners = browser.evaluate(
        "(() => { const seen = []; trace({ lineTo: (...at) => seen.push(at) },"
        f" 0, 9999, {x}, {y}); return seen; }})()"
    )
    assert len(corners) <= 4 * 100, "of a column of pixels"
    assert [int(x) for x, y in corners if y == -7] == [43]
    assert {y for _, y in corners} == {-7, 0, 1, 2}
    assert corners[-1] == [99.99, 0]


def test_the_timeline_is_red_where_a_limit_is_broken(browser: Tab) -> None:
    browser.evaluate("replay.scrub(0)")
    browser.evaluate(DRAWN)
    color = (
        "(t => { const c = replay.charts[0]; const r = c.canvas.width / c.width;"
        " return [...c.canvas.getContext('2d')"
        ".getImageData(c.xAt(t) * r, 31 * r, 1, 1).data].slice(0, 3); })"
    )
    assert browser.evaluate(f"{color}({_BROKEN})") == [220, 38, 38]
    assert browser.evaluate(f"{color}({_FINE})") == [243, 245, 249]


def test_the_support_polygon_has_the_standing_feet_as_corners(browser: Tab) -> None:
    browser.evaluate("replay.scrub(2.0)")
    polygon = "replay.scene.polygon.geometry"
    corners = browser.evaluate(f"[...{polygon}.attributes.position.array].slice(0, 9)")
    assert browser.evaluate(f"{polygon}.drawRange.count") == 3
    frame = browser.evaluate("replay.data.frameAt(2.0)")
    feet = browser.evaluate(f"[...replay.data.feet].slice({12 * frame}, {12 * frame + 12})")
    standing = np.reshape(feet, (4, 3))[[0, 2, 3], :2]
    found = np.array(corners).reshape(3, 3)[:, :2]
    assert sorted(map(tuple, found.round(4))) == sorted(map(tuple, standing.round(4)))


def test_the_ghost_follows_the_plan_beside_the_robot(browser: Tab) -> None:
    browser.evaluate("replay.scrub(2.0); replay.scene.setView('corner')")
    place = browser.evaluate("(({x, y, z}) => [x, y, z])(replay.scene.ghost.body.base.position)")
    robot = browser.evaluate("(({x, y, z}) => [x, y, z])(replay.scene.body.base.position)")
    assert np.subtract(place, robot) == pytest.approx([0.0, 0.0, 0.03], abs=1e-3)
    shift = "(({x, y}) => [x, y])(replay.scene.ghost.body.root.position)"
    pictures = [browser.stage()]
    assert browser.evaluate(shift) == [0, 0.62]
    browser.click("[data-ghost]")
    pictures.append(browser.stage())
    assert browser.evaluate(shift) == [0, 0]
    browser.click("[data-ghost]")
    pictures.append(browser.stage())
    assert browser.text("[data-ghost]") == "Plan: off"
    browser.click("[data-ghost]")
    pictures.append(browser.stage())
    beside, overlaid, alone, again = pictures
    assert _changed(beside, alone) > 5000
    assert _changed(overlaid, alone) > 1000
    assert np.abs(beside - again).mean() < 0.5


def test_the_legend_tells_measured_from_planned_and_from_written(browser: Tab) -> None:
    assert browser.text("#force-key") == "measured force"
    assert browser.is_shown(".ghost-key")
    assert browser.is_shown("#who")
    said = "Solid: what was measured. Blue: the plan, which was checked."
    assert browser.text("#who") == said
    browser.evaluate("replay.data.written = replay.data.ghost; replay.data.ghost = null")
    browser.evaluate("replay.data.header.is_plan = true; replay.use(replay.data)")
    assert browser.text("#who") == f"Solid: the plan. {WRITTEN}"
    assert browser.evaluate("replay.scene.flags.judged() === replay.scene.flags.parts")
    browser.evaluate("replay.data.ghost = replay.data.written; replay.data.written = null")
    browser.evaluate("replay.data.header.is_plan = false; replay.use(replay.data)")
    assert browser.text("#who") == said


def test_what_was_written_is_a_second_ghost(browser: Tab) -> None:
    browser.evaluate("replay.scrub(2.0); replay.scene.setView('corner')")
    button = "[data-ghost=written]"
    asides = "replay.scene.ghosts.map((ghost) => ghost.shift[1])"
    assert not browser.is_shown(button)
    assert browser.evaluate(asides) == [0.62, 0]
    without = browser.stage()
    browser.evaluate("replay.data.written = replay.data.ghost; replay.use(replay.data)")
    assert browser.is_shown(button)
    assert browser.text("#who").endswith(f"Blue: the plan, which was checked. {WRITTEN}")
    assert browser.evaluate(asides) == [0.62, 1.24]
    both = browser.stage()
    assert _changed(both, without) > 5000
    browser.page.keyboard.press("w")
    browser.page.keyboard.press("w")
    assert browser.text(button) == "Written: off"
    assert np.abs(browser.stage() - without).mean() < 0.5
    browser.page.keyboard.press("w")
    browser.evaluate("replay.data.written = null; replay.use(replay.data)")


def test_frames_are_asked_for_only_while_something_moves(browser: Tab) -> None:
    browser.evaluate(
        "(() => { const ask = window.requestAnimationFrame; window.asked = 0;"
        " window.requestAnimationFrame = (act) => { asked += 1; return ask.call(window, act); };"
        " })()"
    )
    frame = "new Promise((done) => setTimeout(done, 200))"
    browser.evaluate(f"asked = 0, {frame}")
    assert browser.evaluate("asked") == 0
    browser.evaluate(f"replay.play(true), {frame}")
    assert browser.evaluate("asked") > 1
    browser.evaluate(f"replay.play(false), {frame}")
    browser.evaluate(f"asked = 0, {frame}")
    assert browser.evaluate("asked") == 0


def test_on_a_narrow_page_the_buttons_take_two_rows(browser: Tab) -> None:
    browser.evaluate("replay.data.written = replay.data.ghost; replay.use(replay.data)")
    browser.page.set_viewport_size({"width": 400, "height": 800})
    boxes = browser.evaluate(
        "[...document.querySelectorAll('#toggles button')].map((button) => {"
        " const box = button.getBoundingClientRect();"
        " return [box.left, box.right, box.top]; })"
    )
    assert len({top for *_, top in boxes}) == 2
    assert all(0 <= left < right <= 400 for left, right, _ in boxes)
    for before, after in pairwise(boxes):
        assert after[0] >= before[1] or after[2] > before[2]
    browser.page.set_viewport_size({"width": 1280, "height": 720})
    browser.evaluate("replay.data.written = null; replay.use(replay.data)")


def test_an_outline_shows_where_the_motion_is_to_end(browser: Tab) -> None:
    goal = "replay.scene.steps.group.children.find(({name}) => name === 'goal')"
    place = browser.evaluate(f"(({{position: p, rotation: r}}) => [p.x, p.y, r.z])({goal})")
    assert place == pytest.approx([0.4, 0.1, 0.5])
    browser.evaluate("replay.scrub(0); replay.scene.setView('top')")
    shown = browser.stage()
    browser.evaluate(f"{goal}.visible = false; replay.scrub(0)")
    assert _changed(browser.stage(), shown) > 300
    browser.evaluate(f"{goal}.visible = true; replay.scene.setView('corner')")


def test_beats_are_lines_on_the_time_strip_that_never_crowd(browser: Tab) -> None:
    browser.evaluate(
        "window.ruled = (beats) => { const seen = [], own = replay.data.header.beats;"
        " replay.data.header.beats = beats;"
        " replay.charts[0].drawBeats({fillRect: (x, y) => seen.push([x, y])}, 100);"
        " replay.data.header.beats = own; return seen; }; 0"
    )
    lines = browser.evaluate("ruled(replay.data.header.beats)")
    wanted = browser.evaluate("replay.data.header.beats.map((t) => replay.charts[0].xAt(t))")
    assert [x for x, _ in lines] == pytest.approx(wanted, abs=1.0)
    assert lines[0][1] < lines[1][1]
    crowd = browser.evaluate("ruled(Array.from({length: 3000}, (_, k) => k / 1000))")
    assert np.diff([x for x, _ in crowd]).min() >= 6.0
    assert len(crowd) > 20


_OVERLAPS = """(() => {
    const shown = [...document.querySelectorAll(
        "header > *, #toggles > button, aside > *, #controls > *, #timeline")]
      .filter((item) => item.textContent.trim() + item.id && item.checkVisibility());
    const boxes = shown.map((item) => [item, item.getBoundingClientRect()]);
    return boxes.flatMap(([a, p], i) => boxes.slice(i + 1)
      .filter(([b, q]) => !a.contains(b) && p.width && q.width
        && Math.min(p.right, q.right) - Math.max(p.left, q.left) > 1
        && Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 1)
      .map(([b]) => `${a.outerHTML.slice(0, 60)} and ${b.outerHTML.slice(0, 60)}`));
})()"""
"""What is written or pressed, and covers other such."""


@pytest.mark.parametrize(
    ("width", "height"), [(1280, 800), (640, 860), (420, 800), (844, 390), (667, 375)]
)
def test_the_page_fits_its_window(browser: Tab, width: int, height: int) -> None:
    browser.resize(width, height)
    app = "document.getElementById('app')"
    overflow = f"{app}.scrollWidth > innerWidth || {app}.scrollHeight > innerHeight"
    for tab in ("curves", "check"):
        browser.evaluate(f"replay.openTab('{tab}')")
        browser.evaluate(DRAWN)
        assert browser.evaluate(overflow) is False
        assert browser.evaluate(_OVERLAPS) == []
    pane = browser.evaluate("replay.scene.pane.clientHeight")
    assert pane > 200
    assert browser.complaints == []
