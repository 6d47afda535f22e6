"""The gallery shows every motion of the library as it is; the README's film is small and loops."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks import gallery
from go2_wbc.recording import Recording
from motions import motion_names
from tests.viz.synthetic import synthetic_recording

DOCS = Path(__file__).resolve().parents[2] / "docs"
DEMO = DOCS / "images/demo.webp"
PICTURES = DOCS / "images" / "gallery"
MOST_BYTES = 2_000_000
LEAST_CONTRAST = 20.0  # of 255; a blank page has 0


def test_the_page_is_what_the_library_says() -> None:
    assert (DOCS / "gallery.md").read_text(encoding="utf-8") == gallery.page()


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_has_a_small_real_picture(name: str) -> None:
    file = PICTURES / f"{name}.webp"
    assert file.stat().st_size <= gallery.SIZE_LIMIT
    with Image.open(file) as image:
        assert image.format == "WEBP"
        pixels = np.asarray(image.convert("L"), dtype=float)
    assert pixels.shape[1] == gallery.MOMENTS * (gallery.PANEL[0] + gallery.GAP) - gallery.GAP
    assert pixels.std() > LEAST_CONTRAST


def test_all_pictures_together_are_small_and_none_is_left_over() -> None:
    files = list(PICTURES.iterdir())
    assert {file.stem for file in files} == set(motion_names())
    assert sum(file.stat().st_size for file in files) <= MOST_BYTES


def crouching(heights: list[float]) -> Recording:
    """The trunk at these heights, one second each."""
    n = len(heights)
    q = np.tile([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0, *([0.0, 0.8, -1.6] * 4)], (n, 1))
    q[:, 2] = heights
    return Recording(
        time=np.arange(float(n)),
        q=q,
        v=np.zeros((n, 18)),
        tau=np.zeros((n, 12)),
        foot_forces=np.full((n, 4), 39.0),
        stance=np.ones((n, 4), dtype=bool),
        p_world_com=q[:, :3],
        support_margin=np.full(n, 0.1),
        labels=("crouch",) * n,
    )


def test_the_moments_are_the_start_and_those_farthest_apart() -> None:
    assert gallery.telling_rows(crouching([0.3, 0.28, 0.2, 0.29, 0.34, 0.3])) == [0, 2, 4]
    few = crouching([0.3, 0.2, 0.36, 0.28, 0.24, 0.33, 0.3])
    long = replace(few, time=few.time * gallery.LONG)
    assert len(gallery.telling_rows(long)) == 2 * gallery.MOMENTS


def test_a_picture_is_drawn_and_kept_small() -> None:
    content = gallery.picture(crouching([0.3, 0.25, 0.2]), [0, 2])
    assert len(content) <= gallery.SIZE_LIMIT
    with Image.open(io.BytesIO(content)) as image:
        assert np.asarray(image.convert("L"), dtype=float).std() > LEAST_CONTRAST


def test_a_run_becomes_a_looping_film_that_starts_just_before_the_first_step() -> None:
    run = gallery.from_first_step(synthetic_recording(script=(("stand", 1.5), ("walk", 1.4))))
    assert run.labels[0] == "stand"
    assert run.spans()[1].start == pytest.approx(gallery.LEAD, abs=0.02)
    with Image.open(io.BytesIO(gallery.film(run))) as image:
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) == 1 + round(20.0 / gallery.FILM_SPEED)


def test_the_film_of_the_readme_is_small_and_has_moving_pictures() -> None:
    assert DEMO.stat().st_size <= gallery.FILM_SIZE_LIMIT
    with Image.open(DEMO) as image:
        assert image.size == gallery.FILM_STYLE.size
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) > 50
