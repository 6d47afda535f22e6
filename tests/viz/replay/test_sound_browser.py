"""The music on the page of a dance, in a real Chromium."""

from collections.abc import Iterator

import pytest

from go2_wbc.recording import Recording
from motions.music import click_track
from tests.viz.replay.browsing import Tab
from tests.viz.replay.conftest import OpenPage
from viz.content import ReplayContent

IN_STEP = 0.035
"""s; the page lets the picture be 0.03 s off the music, and the music goes on while it looks."""
WATCH = """(() => {
  const seek = replay.seek.bind(replay);
  window.apart = [];
  replay.seek = (t) => {
    const { audio } = replay.sound;
    if (!audio.paused && !audio.seeking) apart.push(Math.abs(t - audio.currentTime));
    seek(t);
  };
})()"""
"""Notes with every picture how far [s] it is from the music: however long it takes to draw."""


@pytest.fixture(scope="module")
def tab(recording: Recording, open_page: OpenPage) -> Iterator[Tab]:
    with open_page(ReplayContent(recording, sound=click_track(120.0, 6.0).wav())) as opened:
        opened.evaluate(WATCH)
        yield opened


def test_the_page_waits_for_a_click_and_then_goes_with_its_music(tab: Tab) -> None:
    """A browser lets no page sound before: without the wait the picture would run ahead."""
    assert not tab.evaluate("replay.isPlaying")
    tab.page.click("#play")
    tab.wait_for("replay.sound.audio.currentTime > 0.6")
    assert tab.evaluate("apart.length") > 0
    assert tab.evaluate("Math.max(...apart)") < IN_STEP
    assert tab.complaints == []


def test_pause_places_and_speeds_are_those_of_the_music_too(tab: Tab) -> None:
    tab.evaluate("replay.scrub(2.0)")
    assert tab.evaluate("replay.sound.audio.paused")
    tab.evaluate("replay.setSpeed(0.5); replay.play(true)")
    tab.wait_for("replay.sound.audio.currentTime > 2.2")
    assert tab.evaluate("Math.max(...apart)") < IN_STEP
    assert tab.evaluate("replay.sound.audio.playbackRate") == 0.5
    tab.evaluate("replay.play(false)")
    assert tab.evaluate("replay.sound.audio.paused")


def test_the_picture_follows_the_music_when_it_is_slow(tab: Tab) -> None:
    tab.evaluate("replay.setSpeed(1); replay.scrub(1.0); replay.play(true)")
    tab.wait_for("replay.sound.audio.currentTime > 1.2")
    tab.evaluate("replay.time = 0.2")  # as if no picture had been drawn for a second
    tab.wait_for("replay.time > 1.2")
    assert tab.evaluate("Math.max(...apart)") < IN_STEP
    tab.evaluate("replay.play(false)")


def test_the_music_can_be_silent_and_still_leads(tab: Tab) -> None:
    tab.page.click("[data-sound]")
    assert tab.evaluate("replay.sound.audio.muted")
    assert tab.text("[data-sound]") == "Sound: off"
    tab.page.click("[data-sound]")
    assert not tab.evaluate("replay.sound.audio.muted")


def test_a_page_without_music_plays_by_itself(recording: Recording, open_page: OpenPage) -> None:
    with open_page(recording) as opened:
        opened.page.emulate_media(reduced_motion="no-preference")
        opened.open(opened.page.url)
        assert opened.evaluate("replay.isPlaying")
        assert opened.evaluate("replay.sound.audio === null")
        opened.wait_for("replay.time > 0.2")
        assert opened.complaints == []
