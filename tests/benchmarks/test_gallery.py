"""The gallery shows every motion of the library as it is; the README's film is small and loops."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks import gallery
from controller.studio.library import SHEET
from motions import motion_names
from tests.viz.synthetic import synthetic_recording

DOCS = Path(__file__).resolve().parents[2] / "docs"
DEMO = DOCS / "images/demo.webp"
PICTURES = DOCS / "images" / "gallery"
MOST_BYTES = 3_500_000
LEAST_CONTRAST = 15.0  # of 255; a blank page has 0


def test_the_page_is_what_the_library_says_and_its_pictures_are_small() -> None:
    assert (DOCS / "gallery.md").read_text(encoding="utf-8") == gallery.page()
    files = list(PICTURES.iterdir())
    assert {file.stem for file in files} == set(motion_names())
    assert sum(file.stat().st_size for file in files) <= MOST_BYTES


def test_the_sheet_of_the_studio_is_made_of_these_pictures() -> None:
    with Image.open(SHEET) as sheet, Image.open(io.BytesIO(gallery.sheet(PICTURES))) as now:
        assert sheet.size == now.size
        pair = [np.asarray(one.convert("L"), dtype=float) for one in (sheet, now)]
    assert np.abs(pair[0] - pair[1]).mean() < 1.0, "python -m benchmarks gallery docs"


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_has_a_small_picture_that_moves(name: str) -> None:
    file = PICTURES / f"{name}.avif"
    assert file.stat().st_size <= gallery.SIZE_LIMIT
    with Image.open(file) as image:
        assert image.format == "AVIF"
        assert image.size == gallery.STYLE.size
        start = np.asarray(image.convert("L"), dtype=float)
        image.seek(getattr(image, "n_frames", 1) // 2)
        assert np.abs(np.asarray(image.convert("L"), dtype=float) - start).max() > LEAST_CONTRAST
    assert start.std() > LEAST_CONTRAST


@pytest.mark.parametrize(("length", "pictures"), [(1.5, 16), (16.0, 81)])
def test_a_loop_shows_all_of_a_run_and_a_long_one_faster(length: float, pictures: int) -> None:
    run = synthetic_recording(script=(("stand", length),))
    run = replace(run, q=run.q[:1].repeat(len(run.time), axis=0))  # a still picture is soon written
    with Image.open(io.BytesIO(gallery.loop(run))) as image:
        assert getattr(image, "n_frames", 1) == pictures


def test_the_film_starts_just_before_the_first_step_moves_loops_and_is_small() -> None:
    run = gallery.from_first_step(synthetic_recording(script=(("stand", 1.5), ("walk", 1.4))))
    assert run.labels[0] == "stand"
    assert run.spans()[1].start == pytest.approx(gallery.LEAD, abs=0.02)
    with Image.open(io.BytesIO(gallery.film_of(run))) as image:
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) == 1 + round(20.0 / gallery.FILM_SPEED)
    assert DEMO.stat().st_size <= gallery.FILM_SIZE_LIMIT
    with Image.open(DEMO) as image:
        assert image.size == gallery.FILM_STYLE.size
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) > 50
