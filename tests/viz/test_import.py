"""``import viz`` is cheap, and drawing knows nothing of pages."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("asked", "absent"),
    [
        ("import viz", "trimesh"),
        ("import viz; viz.export_html, viz.export_animation", "matplotlib"),
        ("import viz; viz.export_animation, viz.export_filmstrip, viz.export_plot", "viz.replay"),
    ],
)
def test_what_is_not_asked_for_is_not_imported(asked: str, absent: str) -> None:
    code = f"import sys; {asked}; sys.exit({absent!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_a_name_that_viz_does_not_have_is_an_attribute_error() -> None:
    import viz

    assert all(hasattr(viz, name) for name in viz.__all__)
    with pytest.raises(AttributeError, match="no attribute 'export_film'"):
        _ = viz.export_film
