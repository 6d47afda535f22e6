"""Every export refuses a path that it cannot write, before the work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import viz
from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from tests.viz.verdicts import made_up_verdict

_EXPORTS: dict[str, Callable[[Recording, Path], Path]] = {
    ".html": lambda recording, path: viz.export_html(recording, path, title="t"),
    ".webp": lambda recording, path: viz.export_animation(recording, path),
    ".png": lambda recording, path: viz.export_filmstrip(recording, path),
    ".svg": lambda _recording, path: viz.export_plot(made_up_verdict(3.0), path, title="t"),
}


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
