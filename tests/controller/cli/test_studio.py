"""``go2-wbc studio``: which file it edits, and what it never writes over."""

import json
import signal
import time
import urllib.request
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from controller.cli import studio
from controller.cli.common import ExitCode
from controller.cli.motion_preview import POLL_PERIOD, Live
from controller.cli.studio import _file_of
from controller.studio import session
from go2_wbc.plant.mujoco import viewer
from motions import load_file
from tests.controller.cli.conftest import Run
from tests.live_preview import LivePreview
from tests.viz.page_reader import read_message, read_pack


def test_a_file_is_begun_and_an_old_one_is_not_touched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    path, name = _file_of("greet.py")
    assert capsys.readouterr() == ("", "began greet.py\n"), "all else is on the page"
    assert (path, name) == (Path("greet.py"), None)
    assert list(load_file(path)) == ["greet"]
    path.write_text("mine", encoding="utf-8")
    assert _file_of("greet.py:bow") == (Path("greet.py"), "bow")
    assert path.read_text(encoding="utf-8") == "mine"


def test_a_motion_of_the_library_is_copied_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    monkeypatch.chdir(tmp_path)
    path, name = _file_of("wave")
    assert (path, name) == (Path("wave.py"), "wave")
    assert "wave" in load_file(path)
    told = run("studio", "wave", "--no-open", code=ExitCode.USAGE).err
    assert "wave.py exists already: go2-wbc studio wave.py" in told
    assert "'wavy'" in run("studio", "wavy", "--no-open", code=ExitCode.USAGE).err


def test_a_file_that_is_no_motion_is_told(tmp_path: Path, run: Run) -> None:
    file = tmp_path / "greet.py"
    file.write_text("def greet(:\n", encoding="utf-8")
    before = signal.getsignal(signal.SIGTERM)
    told = run("studio", file, "--no-open", "--port", 0, code=ExitCode.RUNTIME).err
    assert "greet.py, line 1: SyntaxError" in told
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("no_open", [False, True])
@pytest.mark.parametrize("problem", [None, "no display"])
@pytest.mark.parametrize("is_json", [False, True])
def test_the_page_is_opened_where_it_can_be_and_what_changes_is_told_once(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    problem: str | None,
    *,
    no_open: bool,
    is_json: bool,
) -> None:
    did, words = list[object](), ["", "looked for", "looked for", ""]
    opened = SimpleNamespace(motion="bow", url="URL", warm=lambda: did.append("warm"))

    def look() -> None:
        if not words:
            raise KeyboardInterrupt
        opened.told = words.pop(0)

    look()
    opened.look = look
    monkeypatch.setattr(session, "Studio", lambda *given: did.append(given) or nullcontext(opened))
    monkeypatch.setattr(viewer, "display_problem", lambda: problem)
    monkeypatch.setattr(studio, "POLL_PERIOD", 0.0)
    monkeypatch.setattr(studio, "_file_of", lambda word: (Path(word), None))
    monkeypatch.setattr(studio.webbrowser, "open", did.append)
    before = signal.getsignal(signal.SIGTERM)
    live = Live(port=7, no_open=no_open)
    assert studio.run("bow.py", live=live, json=is_json) == ExitCode.OK
    assert signal.getsignal(signal.SIGTERM) is before
    shows = not no_open and problem is None
    assert did == [(Path("bow.py"), None, 7), *["URL"] * shows, "warm"]
    first, *rest = capsys.readouterr().out.splitlines()
    assert ("URL" in first, rest) == (
        True,
        [] if is_json else ["looked for", "all jumps are solved"],
    )
    assert not is_json or json.loads(first) == {"url": "URL", "file": "bow.py"}


def _wait_for(title: str, url: str) -> None:
    """Until a page that is opened there shows a motion of this title."""
    for _ in range(600):
        with urllib.request.urlopen(url.replace("/?", "/data?")) as answer:
            if read_pack(read_message(answer.read())[1])[0]["title"] == title:
                return
        time.sleep(POLL_PERIOD)
    pytest.fail(f"{title} is not shown")


@pytest.mark.slow
def test_it_serves_what_is_saved_until_ctrl_c(tmp_path: Path) -> None:
    with LivePreview(command="studio", folder=tmp_path) as studio:
        assert "/?token=" in studio.url
        file = tmp_path / "my_motion.py"
        _wait_for("my_motion", studio.url)
        file.write_text(file.read_text("utf-8").replace("my_motion", "other"), encoding="utf-8")
        _wait_for("other", studio.url)
        assert studio.interrupt() == ExitCode.OK
