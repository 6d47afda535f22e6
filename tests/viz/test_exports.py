"""``import viz`` is cheap, drawing knows no pages, exports refuse a path before the work."""

from collections.abc import Callable
from pathlib import Path

import pytest

import viz
from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from tests.script_server import python
from tests.viz.verdicts import made_up_verdict

_EXPORTS: dict[str, Callable[[Recording, Path], Path]] = {
    ".html": lambda recording, path: viz.export_html(recording, path, title="t"),
    ".webp": lambda recording, path: viz.export_animation(recording, path),
    ".png": lambda recording, path: viz.export_filmstrip(recording, path),
    ".svg": lambda _recording, path: viz.export_plot(made_up_verdict(3.0), path, title="t"),
}


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
    assert python("-c", code).returncode == 0


def test_a_name_that_viz_does_not_have_is_an_attribute_error() -> None:
    assert all(hasattr(viz, name) for name in viz.__all__)
    with pytest.raises(AttributeError, match="no attribute 'export_film'"):
        _ = viz.export_film


@pytest.mark.parametrize("suffix", _EXPORTS)
def test_an_unknown_suffix_is_refused_with_the_valid_ones(
    suffix: str, recording: Recording, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=rf"'\.xyz'.*valid: .*\{suffix}"):
        _EXPORTS[suffix](recording, tmp_path / "demo.xyz")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", _EXPORTS)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    suffix: str, recording: Recording, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ConfigError, match=r"cannot write .*choose a folder"):
        _EXPORTS[suffix](recording, tmp_path / "file" / f"demo{suffix}")
