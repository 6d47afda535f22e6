"""The replay page in a real Chromium, from a file, offline."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from go2_wbc.recording import LIMIT_ROWS, Recording
from tests.viz.replay.browsing import DRAWN, Tab
from tests.viz.replay.conftest import OpenPage
from tests.viz.synthetic import step_ahead

_FRAME_TRAVEL = 0.006  # [m] the robot moves this far in half a frame


@pytest.fixture(scope="module")
def browser(recording: Recording, open_page: OpenPage) -> Iterator[Tab]:
    with open_page(recording) as tab:
        yield tab


def test_it_opens_without_a_request_or_an_error(browser: Tab) -> None:
    (url,) = browser.requested
    assert url.startswith("file:")
    assert browser.complaints == []


def test_the_robot_is_drawn(browser: Tab) -> None:
    browser.evaluate("replay.seek(0.2)")
    stage = browser.stage()
    dark = (stage.max(axis=2) < 90).mean()
    assert 0.002 < dark < 0.2
    assert stage.std() > 10


def test_scrubbing_changes_the_picture_and_comes_back_to_the_same(browser: Tab) -> None:
    pictures = []
    for time in (0.2, 2.0, 0.2):
        browser.evaluate(f"replay.scrub({time}); replay.scene.setView('side')")
        pictures.append(browser.stage())
    assert np.abs(pictures[1] - pictures[0]).mean() > 2.0
    assert np.abs(pictures[2] - pictures[0]).mean() < 0.5


def test_a_click_on_the_timeline_goes_to_that_time(browser: Tab) -> None:
    box = browser.evaluate(
        "(({left, right, top}) => [left, right, top])"
        "(document.getElementById('timeline').getBoundingClientRect())"
    )
    browser.page.mouse.click(0.5 * (box[0] + 34 + box[1] - 6), box[2] + 60)
    half = browser.evaluate("replay.data.duration / 2")
    assert browser.evaluate("replay.time") == pytest.approx(half, abs=0.05)


def test_space_plays_and_pauses_and_arrows_step_by_one_frame(browser: Tab) -> None:
    browser.evaluate("replay.scrub(0.5)")
    frame = browser.evaluate("replay.data.frameAt(replay.time)")
    browser.page.keyboard.press("ArrowRight")
    assert browser.evaluate("replay.data.frameAt(replay.time)") == frame + 1
    browser.page.keyboard.press("ArrowLeft")
    assert browser.evaluate("replay.data.frameAt(replay.time)") == frame
    browser.page.keyboard.press("Space")
    browser.wait_for("replay.time > 0.7")
    browser.page.keyboard.press("Space")
    stopped = browser.evaluate("replay.time")
    browser.evaluate(DRAWN)
    assert browser.evaluate("replay.time") == stopped
    assert browser.evaluate("replay.isPlaying") is False


def test_all_that_moves_waits_for_the_picture(browser: Tab) -> None:
    """Where the 3D view is drawn slowly, readouts and playheads else run ahead of it."""
    browser.evaluate(
        "Object.defineProperty(replay.scene, 'isDrawn', { configurable: true, get: () => false }),"
        " replay.seek(0), replay.play(true)"
    )
    for _ in range(3):
        browser.evaluate(DRAWN)
    assert browser.evaluate("replay.time") == 0.0
    browser.evaluate("void delete replay.scene.isDrawn")
    browser.wait_for("replay.time > 0")
    browser.evaluate("replay.play(false)")


def test_the_readouts_follow_the_time(browser: Tab) -> None:
    browser.evaluate("replay.scrub(2.0)")
    assert browser.text("#behaviour") == "High five"
    assert browser.text("#now") == "2.00"
    height = browser.evaluate("replay.data.q[19 * replay.data.frameAt(2.0) + 2]")
    shown = browser.text("[data-curve=height] output")
    assert float(shown.split()[0]) == pytest.approx(100 * height, abs=0.06)


def test_what_lies_on_the_floor_is_drawn_above_it_although_feet_press_into_it(browser: Tab) -> None:
    lower = "replay.data.feet = replay.data.feet.map((value, i) => i % 3 === 2 ? value {} : value);"
    corners = "replay.scene.polygon.geometry.attributes.position"
    try:
        browser.evaluate(lower.format("- 0.004") + "replay.seek(0.2)")
        heights = browser.evaluate(f"[0, 1, 2].map((i) => {corners}.getZ(i))")
    finally:
        browser.evaluate(lower.format("+ 0.004") + "replay.seek(0.2)")
    assert min(heights) > 0.001


def test_hiding_the_forces_changes_the_picture(browser: Tab) -> None:
    browser.evaluate("replay.scrub(0.1); replay.scene.setView('side')")
    shown = browser.stage()
    browser.click("[data-toggle=forces]")
    hidden = browser.stage()
    browser.click("[data-toggle=forces]")
    orange = (shown[:, :, 0] > 220) & (shown[:, :, 1] < 170) & (shown[:, :, 2] < 90)
    assert orange.sum() > 100
    assert np.abs(shown - hidden)[orange].mean() > 30


def test_the_camera_follows_the_robot(browser: Tab) -> None:
    ask = (
        "[replay.scene.viewer.controls.target.x, replay.data.target[3 * replay.data.frameAt({t})]]"
    )
    browser.evaluate("replay.scrub(0); replay.scene.setView('corner')")
    before = browser.evaluate(ask.format(t=0))
    browser.evaluate("replay.scrub(1.4)")
    after = browser.evaluate(ask.format(t=1.4))
    assert after[0] - before[0] == pytest.approx(after[1] - before[1], abs=_FRAME_TRAVEL)
    assert after[0] - before[0] > 0.1


def test_every_place_where_a_foot_came_down_has_its_footprint(
    browser: Tab, recording: Recording
) -> None:
    prints = browser.evaluate("replay.scene.steps.prints.map(({from}) => from)")
    changes = np.diff(recording.stance.astype(int), axis=0)
    walked = np.array(recording.labels[1:]) == "walk"
    touchdowns = int((changes[walked] > 0).sum())
    assert touchdowns > 4
    assert len(prints) >= touchdowns
    landed = [
        browser.evaluate(f"replay.seek({t}); replay.scene.steps.landed.count")
        for t in (0.2, 0.9, recording.duration)
    ]
    assert landed == [4, sum(start <= 0.9 for start in prints), len(prints)]


_LEAST_CONTRAST = 4.5
"""Of text on its ground, as WCAG 2.1 asks for (AA)."""
_CONTRASTS = """(() => {
    const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
    const light = (rgb) => rgb.slice(0, 3).map((v) => v / 255)
      .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
      .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const ground = (item) => {
      const own = numbers(getComputedStyle(item).backgroundColor);
      return own.length < 4 || own[3] > 0.5 ? own : ground(item.parentElement);
    };
    return Object.fromEntries(["h1", "#behaviour", "#toggles .on", "#toggles :not(.on)", ".card h2",
      ".card output", "#clock", "#legend"].map((name) => {
        const item = document.querySelector(name);
        const [a, b] = [light(numbers(getComputedStyle(item).color)), light(ground(item))];
        return [name, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05)];
      }));
})()"""


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_text_is_readable_and_the_picture_fits_the_page_by_night_and_by_day(
    browser: Tab, scheme: Literal["dark", "light"]
) -> None:
    """The page begins anew when the scheme changes: its canvases have the colours of one."""
    page, place = browser.page, browser.page.url
    page.goto("about:blank")
    page.emulate_media(color_scheme="light" if scheme == "dark" else "dark")
    page.goto(place)
    browser.wait_for("window.replay")
    with page.expect_navigation():
        page.emulate_media(color_scheme=scheme)
    browser.wait_for("window.replay")
    contrasts = browser.evaluate(_CONTRASTS)
    assert {name: c for name, c in contrasts.items() if c < _LEAST_CONTRAST} == {}
    brightness = browser.stage().mean()
    assert (brightness < 110) if scheme == "dark" else (brightness > 180)
    assert browser.complaints == []


def test_the_ground_that_was_seen_is_drawn_by_its_height(
    recording: Recording, open_page: OpenPage
) -> None:
    with open_page(replace(recording, ground=step_ahead(0.2, at=0.45))) as tab:
        tab.evaluate("replay.scrub(0.2); replay.scene.setView('top')")
        stage = tab.stage().astype(int)
        assert tab.complaints == []
    redder = stage[:, :, 0] - stage[:, :, 2]
    assert (redder > 40).mean() > 0.05  # the step, and the level before it
    assert (redder < -30).mean() > 0.1


def test_what_is_in_the_way_is_told_and_drawn_in_its_legs_lane(
    recording: Recording, open_page: OpenPage
) -> None:
    y = np.zeros((len(recording.time), 48))
    y[50:80, LIMIT_ROWS.index("RL_calf torque")] = 1.0
    y[60:80, LIMIT_ROWS.index("RL friction +x")] = 1.0
    gave_way = np.zeros(len(y), dtype=bool)
    with open_page(replace(recording, multipliers=y, gave_way=gave_way)) as tab:
        tab.evaluate("replay.scrub(0.7)")
        assert tab.text("#binding p") == "In the way: torque limit of RL_calffriction of RL"
        tab.evaluate("replay.scrub(2.0)")
        assert tab.text("#binding p").startswith("In the way: none")
        lanes = tab.evaluate(
            """(() => { const chart = replay.charts.find((one) => one instanceof Binding);
            const paint = chart.picture.getContext("2d"), ratio = window.devicePixelRatio;
            const x = chart.xAt(0.55) * ratio, row = chart.height * ratio / 4;
            return [0, 1, 2, 3].map((k) => [...paint.getImageData(x, (k + 0.4) * row, 1, 1).data]);
            })()"""
        )
        assert [lane[:3] == [168, 85, 247] for lane in lanes] == [False, False, True, False]
        assert tab.complaints == []
    with open_page(recording) as tab:
        assert tab.evaluate("document.getElementById('binding').hidden") is True
