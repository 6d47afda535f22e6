"""The animation file: as many frames, as long and as small as promised."""

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import viz
from go2_wbc.errors import ConfigError, MissingDependency
from go2_wbc.recording import Recording
from viz.render.pictures import SIZE_LIMIT, frame_times

_SIZE = (240, 150)


@pytest.fixture(scope="module")
def shares() -> list[float]:
    return []


@pytest.fixture(scope="module")
def animation(
    recording: Recording, shares: list[float], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("animation") / "demo.webp"
    return viz.export_animation(
        recording, path, speed=2.0, fps=10, size=_SIZE, progress=shares.append
    )


def _durations(path: Path) -> list[int]:
    with Image.open(path) as image:
        result = []
        for k in range(getattr(image, "n_frames", 1)):
            image.seek(k)
            image.load()
            result.append(image.info["duration"])
        return result


def test_it_has_the_promised_frames_duration_and_size(
    animation: Path, recording: Recording
) -> None:
    durations = _durations(animation)
    assert len(durations) == round(recording.duration / 2.0 * 10) + 1
    assert set(durations) == {100}
    with Image.open(animation) as image:
        assert image.size == _SIZE
        assert image.info["loop"] == 0
    assert animation.stat().st_size < SIZE_LIMIT


def test_its_pictures_move(animation: Path) -> None:
    with Image.open(animation) as image:
        pictures = []
        for k in (0, 5, 10):
            image.seek(k)
            pictures.append(np.asarray(image.convert("RGB"), dtype=float))
    assert np.abs(pictures[1] - pictures[0]).mean() > 1.0
    assert np.abs(pictures[2] - pictures[1]).mean() > 1.0


def test_progress_grows_to_one(animation: Path, shares: list[float]) -> None:
    assert animation.exists()
    assert shares == sorted(shares)
    assert len(shares) > 10
    assert shares[-1] == 1.0


def test_both_ends_of_the_recording_are_shown(recording: Recording) -> None:
    times = frame_times(recording, speed=2.0, fps=12)
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(recording.duration)
    assert np.diff(times) == pytest.approx(2.0 / 12, rel=0.05)


@pytest.mark.parametrize(
    ("speed", "fps", "size"),
    [(0.0, 12, _SIZE), (2.0, -1, _SIZE), (2.0, 12, (8, 150)), (np.nan, 12, _SIZE)],
)
def test_settings_out_of_range_are_refused(
    recording: Recording, tmp_path: Path, speed: float, fps: float, size: tuple[int, int]
) -> None:
    with pytest.raises(ConfigError, match="must be positive"):
        viz.export_animation(recording, tmp_path / "a.webp", speed=speed, fps=fps, size=size)


def test_quality_gives_way_to_the_size_limit(
    recording: Recording, tmp_path: Path, animation: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = animation.stat().st_size * 2 // 3
    monkeypatch.setattr("viz.render.pictures.SIZE_LIMIT", limit)
    smaller = viz.export_animation(recording, tmp_path / "a.webp", speed=2.0, fps=10, size=_SIZE)
    assert smaller.stat().st_size <= limit


def test_a_file_that_stays_too_large_is_refused(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viz.render.pictures.SIZE_LIMIT", 500)
    with pytest.raises(ConfigError, match="limit 500"):
        viz.export_animation(recording, tmp_path / "a.webp", speed=8.0, fps=4, size=(64, 40))
    assert list(tmp_path.iterdir()) == []


def test_an_mp4_has_the_promised_frames_and_size_and_moves(
    recording: Recording, tmp_path: Path
) -> None:
    av = pytest.importorskip("av", reason='needs pip install "go2-wbc[video]"')
    path = viz.export_animation(
        recording, tmp_path / "demo.mp4", speed=2.0, fps=12.5, size=(241, 151)
    )
    with av.open(path) as film:
        (track,) = film.streams.video
        pictures = [frame.to_ndarray(format="rgb24").astype(float) for frame in film.decode(track)]
        assert (track.codec.name, track.pix_fmt, track.average_rate) == ("h264", "yuv420p", 12.5)
    assert len(pictures) == len(frame_times(recording, speed=2.0, fps=12.5))
    assert {picture.shape for picture in pictures} == {(150, 240, 3)}
    assert np.abs(pictures[10] - pictures[0]).mean() > 1.0


def test_an_mp4_without_its_extra_is_refused_before_any_picture(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.delitem(sys.modules, "viz.render.mp4_file", raising=False)
    shares = list[float]()
    with pytest.raises(MissingDependency, match=r"an MP4 needs PyAV .*go2-wbc\[video\]"):
        viz.export_animation(recording, tmp_path / "demo.mp4", progress=shares.append)
    assert not shares
    assert not list(tmp_path.iterdir())
