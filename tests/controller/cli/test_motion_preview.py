"""``go2-wbc preview``: the files it writes, what it refuses, and the life of the live page."""

import json
import os
import socket
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PIL import Image

from controller.cli import motion_preview
from controller.cli.common import ExitCode
from controller.cli.motion_args import MotionSource
from controller.cli.motion_preview import Live
from go2_wbc.errors import CommandError
from motions import FeasibilityChecker, Timeline
from tests.controller.cli.conftest import Run
from tests.live_preview import BROKEN, GOOD, TOO_HIGH, LivePreview
from tests.viz.page_reader import read_data
from viz.replay import preview_server
from viz.replay.page_data import PAGE_LIMIT


@pytest.fixture
def rise(tmp_path: Path) -> Path:
    path = tmp_path / "rise.py"
    path.write_text(GOOD, encoding="utf-8")
    return path


def test_it_writes_page_and_plot_and_says_so(tmp_path: Path, run: Run) -> None:
    page, plot = tmp_path / "bow.html", tmp_path / "bow.svg"
    text = run("preview", "bow", "--html", page, "--plot", plot).out
    assert text.startswith("ok   bow ")
    assert f"{page}: " in text
    assert f"{plot}: " in text
    assert page.stat().st_size < PAGE_LIMIT
    header, _ = read_data(page.read_text(encoding="utf-8"))
    assert header["is_plan"]
    assert header["verdict"]["ok"]
    assert "joint position" in plot.read_text(encoding="utf-8")


def test_an_infeasible_motion_is_written_too_with_exit_code_1(
    rise: Path, tmp_path: Path, run: Run
) -> None:
    rise.write_text(TOO_HIGH, encoding="utf-8")
    page = tmp_path / "rise.html"
    said = run("preview", rise, "--html", page, "--json", code=ExitCode.FAILED)
    report = json.loads(said.out)
    assert not report["ok"]
    assert report["files"] == {"html": str(page)}
    header, _ = read_data(page.read_text(encoding="utf-8"))
    annotations = [
        annotation for annotation in header["verdict"]["annotations"] if annotation["is_broken"]
    ]
    assert {annotation["limit"] for annotation in annotations} >= {"reach", "joint position"}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["webp", "gif"])
def test_a_video_lasts_as_long_as_the_motion(tmp_path: Path, suffix: str, run: Run) -> None:
    path = tmp_path / f"bow.{suffix}"
    run("preview", "bow", "--video", path)
    with Image.open(path) as image:
        frames = getattr(image, "n_frames", 1)
        image.seek(1)
        image.load()
        assert image.info["duration"] == 80
    assert frames == round(2.4 * 12.5) + 1


def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    def work(*_: object) -> None:
        pytest.fail("the check ran first")

    monkeypatch.setattr(FeasibilityChecker, "evaluate", work)
    (tmp_path / "file").write_text("")
    target = tmp_path / "file" / "bow.html"
    said = run("preview", "bow", "--html", target, code=ExitCode.USAGE)
    assert f"cannot write {target}" in said.err


def test_several_motions_and_a_port_in_use_are_refused(rise: Path, run: Run) -> None:
    rise.write_text(GOOD + GOOD.replace("rise", "second"), encoding="utf-8")
    said = run("preview", rise, "--no-open", code=ExitCode.USAGE)
    assert "choose FILE.py:NAME: rise, second" in said.err
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        said = run("preview", "bow", "--no-open", "--port", port, code=ExitCode.USAGE)
    assert f"cannot listen on port {port} of 127.0.0.1" in said.err


@pytest.mark.parametrize("is_json", [False, True])
@pytest.mark.parametrize("error", [None, CommandError("line 3"), OSError("line 3")])
def test_a_page_follows_its_file_and_ends_with_what_was_shown_last(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: Exception | None,
    *,
    is_json: bool,
) -> None:
    did, changes, shown = list[object](), [False, True], ["first", "second"]

    def has_changed() -> bool:
        if not changes:
            raise KeyboardInterrupt
        return changes.pop(0)

    def of(_: object) -> tuple[str, SimpleNamespace]:
        if error is not None and len(shown) == 1:
            raise error
        return (title := shown.pop(0)), SimpleNamespace(ok=title == "first")

    source: Any = SimpleNamespace(
        name="bow", path=Path("bow.py"), choose=None, has_changed=has_changed
    )
    show: Any = SimpleNamespace(as_json=is_json, of=of, tell=lambda report: not report.ok)
    page = SimpleNamespace(url="URL", publish=did.append, publish_error=did.append)
    monkeypatch.setattr(preview_server, "PreviewServer", lambda *_: nullcontext(page))
    monkeypatch.setattr(motion_preview, "POLL_PERIOD", 0.0)
    assert motion_preview._serve(source, show, Live(port=7, no_open=True)) is (error is None)
    said = capsys.readouterr()
    assert did == ["line 3" if error else "second"]
    assert [is_json, not is_json] == [line in said.out for line in ('"URL"', ": URL ")]
    wrong = '{"error": "line 3"}' in said.out if is_json else "go2-wbc: line 3" in said.err
    assert wrong is (error is not None)


def seconds(source: MotionSource) -> float:
    line = source.motion()
    assert isinstance(line, Timeline)
    return line.end


def test_a_source_sees_saves_once_they_are_done(rise: Path) -> None:
    source = MotionSource(str(rise), [])
    assert source.name == "rise"
    assert not source.has_changed()
    rise.unlink()
    assert not source.has_changed()
    aside = rise.with_suffix(".tmp")
    aside.write_text(GOOD.replace("over=0.8", "over=1.8"), encoding="utf-8")
    os.replace(aside, rise)  # noqa: PTH105 - as editors do
    assert [source.has_changed() for _ in range(4)] == [False, True, False, False]
    rise.write_text("", encoding="utf-8")
    assert not source.has_changed()
    rise.write_text(GOOD.replace("over=0.8", "over=1.8"), encoding="utf-8")
    assert [source.has_changed() for _ in range(3)] == [False, True, False]
    assert seconds(source) == pytest.approx(4.0)


def test_a_motion_of_the_library_has_its_own_file_and_parameters() -> None:
    source = MotionSource("wave", ["times=3"])
    assert source.path.name == "paws.py"
    assert seconds(source) > seconds(MotionSource("wave", ["times=2"]))
    with pytest.raises(CommandError, match="unknown motion"):
        MotionSource("waves", [])


@pytest.mark.slow
def test_the_live_page_tells_every_verdict_and_ends_with_the_last(rise: Path) -> None:
    with LivePreview(str(rise)) as preview:
        assert preview.url.startswith("http://127.0.0.1:")
        assert preview.heard()["ok"] is True
        rise.write_text(BROKEN, encoding="utf-8")
        assert "rise.py, line 9: SyntaxError" in preview.heard()["error"]
        rise.write_text(TOO_HIGH, encoding="utf-8")
        assert preview.heard()["ok"] is False
        assert preview.interrupt() == ExitCode.FAILED
    rise.write_text(GOOD, encoding="utf-8")
    with LivePreview(str(rise)) as preview:
        assert preview.heard()["ok"] is True
        assert preview.interrupt() == ExitCode.OK


@pytest.mark.parametrize(
    ("problem", "arguments", "opens"),
    [(None, [], True), (None, ["--no-open"], False), ("there is no display", [], False)],
)
def test_a_browser_is_opened_where_there_is_a_screen(
    problem: str | None,
    arguments: list[str],
    opens: bool,
    monkeypatch: pytest.MonkeyPatch,
    run: Run,
) -> None:
    opened: list[str] = []

    def interrupt(_seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("go2_wbc.plant.mujoco.viewer.display_problem", lambda: problem)
    monkeypatch.setattr(motion_preview.webbrowser, "open", opened.append)
    monkeypatch.setattr(motion_preview.time, "sleep", interrupt)
    first, verdict = run("preview", "bow", "--port", 0, *arguments).out.splitlines()
    assert first.startswith("bow: http://127.0.0.1:")
    assert "trunk.py; Ctrl-C ends)" in first
    assert verdict.startswith("ok   bow ")
    assert opened == ([first.split()[1]] if opens else [])
