"""``go2-wbc dance``: composed, checked, played, measured; every way to fail has its message."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.cli.common import ExitCode
from motions.music import Beats, click_track
from motions.music.songs import RATE, read_sound
from tests.controller.cli.conftest import Run
from tests.viz.page_reader import read_data

SECONDS, BPM = 7.0, 96.0


@pytest.fixture
def song(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A song whose beats are known, not found: what follows needs no extra."""
    clicks = click_track(BPM, SECONDS, metre=3)
    found = Beats(BPM, clicks.beats, np.ones(len(clicks.beats)), SECONDS, 1.0, metre=3)
    monkeypatch.setattr("motions.music.beat_tracking.beats", lambda *_: found)
    return clicks.save(tmp_path / "song.wav")


def test_a_dance_is_played_and_measured_or_told_and_unknown_moves_are_refused(
    song: Path, run: Run
) -> None:
    told = json.loads(run("dance", song, "--seed", "3", "--json").out)
    assert told["ok"]
    assert told["tempo"] == BPM
    assert len(told["moves"]) >= 5
    assert len(told["accents"]) >= len(told["moves"])
    assert told["on_beat"] == 1.0
    assert max(abs(accent["late_ms"]) for accent in told["accents"]) < 40.0
    text = run("dance", song, "--no-play", "--moves", "nod", "sway", "tap_FR").out
    assert all(word in text for word in ("96 a minute, bars of 3", "feasible, not played", "nod"))
    assert "twist" not in text
    assert "accents" not in json.loads(run("dance", song, "--no-play", "--json").out)
    said = run("dance", song, "--moves", "moonwalk", code=ExitCode.USAGE)
    assert "unknown move 'moonwalk'; valid: bob" in said.err


def test_the_page_of_a_dance_has_its_beats_and_its_music(
    song: Path, tmp_path: Path, run: Run
) -> None:
    pytest.importorskip("librosa", reason="needs the extra [music]")
    page = tmp_path / "dance.html"
    run("dance", song, "--no-play", "--html", page)
    header, arrays = read_data(page.read_text(encoding="utf-8"))
    assert header["title"] == "dance 0"
    assert header["beats"] == pytest.approx(click_track(BPM, SECONDS).beats)
    assert header["bar"] == [3, 0]
    names = [label for _, _, label in header["labels"]]
    told = json.loads(run("dance", song, "--no-play", "--json").out)
    assert names == [told["dance"], *(move["name"] for move in told["moves"])]
    path = tmp_path / "again.mp3"
    path.write_bytes(arrays["sound"].tobytes())
    assert len(read_sound(path)) == pytest.approx(SECONDS * RATE, abs=1)


def test_without_the_extra_the_install_line_is_said(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "librosa", None)
    said = run("dance", tmp_path / "song.wav", code=ExitCode.RUNTIME)
    assert 'install "go2-wbc[music]"' in said.err
