"""The film at the top of the README: small, looping, from the first step on."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from PIL import Image

from benchmarks.gallery import (
    FILM_RATE,
    FILM_SIZE_LIMIT,
    FILM_SPEED,
    FILM_STYLE,
    LEAD,
    film,
    from_first_step,
)
from tests.viz.synthetic import synthetic_recording

DEMO = Path(__file__).resolve().parents[2] / "docs/images/demo.webp"


def test_a_run_becomes_a_looping_film_that_starts_just_before_the_first_step() -> None:
    run = from_first_step(synthetic_recording(script=(("stand", 1.5), ("walk", 1.4))))
    assert run.labels[0] == "stand"
    assert run.spans()[1].start == pytest.approx(LEAD, abs=0.02)
    with Image.open(io.BytesIO(film(run))) as image:
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) == round(2.0 / FILM_SPEED * FILM_RATE) + 1


def test_the_film_of_the_readme_is_small_and_has_moving_pictures() -> None:
    assert DEMO.stat().st_size <= FILM_SIZE_LIMIT
    with Image.open(DEMO) as image:
        assert image.size == FILM_STYLE.size
        assert image.info["loop"] == 0
        assert getattr(image, "n_frames", 1) > 50
