"""A studio as its page sees it: drafts, saves, what is refused, and a file that misbehaves."""

import json
import time
import wave
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.studio import running
from controller.studio.session import Studio
from controller.studio.songs import music
from go2_wbc.errors import StudioError
from tests.viz.page_reader import read_message, read_pack

GREET = '''"""Greets."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def greet(times: Annotated[int, Range(1, 3)] = 1) -> Timeline:
    """Greet."""
    line = Timeline().body(pitch=deg(10.0), over=0.6).home(over=0.6)
    for _ in range(times):
        line = line.foot("FR", z=0.08, over=0.5).down("FR", over=0.5)
    return line.home(over=0.6)
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("studio")


@pytest.fixture(scope="module")
def opened(folder: Path) -> Iterator[Studio]:
    file = folder / "greet.py"
    file.write_text(GREET, encoding="utf-8")
    with Studio(file, None, 0) as studio:
        yield studio


@pytest.fixture
def studio(opened: Studio, folder: Path) -> Studio:
    """With the file as it was at first."""
    (folder / "greet.py").write_text(GREET, encoding="utf-8")
    _look(opened)
    return opened


@pytest.fixture
def file(folder: Path) -> Path:
    return folder / "greet.py"


def _look(studio: Studio) -> bool:
    """What was saved rests from the first look to the second."""
    return studio.look() or studio.look()


def _shown(data: bytes) -> dict[str, Any]:
    header, _ = read_pack(data)
    return header


def _data(studio: Studio, known: bytes = b"") -> bytes:
    """What the page shows now that has shown ``known``."""
    has = _shown(known)["version"] if known else ""
    return read_message(studio._server.changes(has), known)[1]


def _editor(studio: Studio) -> dict[str, Any]:
    """What the page shows now."""
    return _shown(_data(studio))["editor"]


def _told(studio: Studio, order: dict[str, object]) -> dict[str, Any]:
    """What is told of an edit that shows no draft."""
    answer = studio.edit(order)
    assert not isinstance(answer, bytes)
    return answer


def _edit(studio: Studio, bar: int, **order: object) -> dict[str, Any]:
    editor = _editor(studio)
    site = {"site": editor["bars"][bar]["site"], "base": editor["base"], "commit": True}
    answer = studio.edit({**site, **order})
    if isinstance(answer, bytes):
        return {"data": read_message(answer)[1]}
    return json.loads(json.dumps(answer))


def test_bars_are_the_calls_of_the_file(studio: Studio) -> None:
    editor = _editor(studio)
    assert studio.motion == "greet"
    told = [(bar["name"], bar["parts"], bar["runs"], bar["broken"]) for bar in editor["bars"]]
    assert told == [
        ("body", ["trunk"], 1, ""),
        ("home", ["trunk"], 1, ""),
        ("foot", ["FR"], 1, ""),
        ("down", ["FR"], 1, ""),
        ("home", ["trunk"], 1, ""),
    ]
    assert (editor["file"], editor["undo"], editor["redo"]) == ("greet.py", editor["undo"], False)


def test_a_draft_is_shown_and_not_saved(studio: Studio, file: Path) -> None:
    before = _editor(studio)
    answer = _edit(studio, 0, op="set", name="pitch", value=50.0, commit=False)
    draft = _shown(answer["data"])
    assert draft["editor"]["bars"][0]["broken"] != "", "the trunk would meet its legs"
    assert not draft["verdict"]["ok"]
    assert "slots" not in draft["editor"]["bars"][0], "the page knows what is written"
    assert file.read_text(encoding="utf-8") == GREET
    assert _editor(studio) == before


def test_a_page_gets_what_has_changed_and_has_the_whole_to_the_byte(studio: Studio) -> None:
    rng, shown, sent, whole = np.random.default_rng(0), _data(studio), 0, 0
    values = {"pitch": (5.0, 30.0), "over": (0.4, 1.2), "z": (0.03, 0.12)}
    for number in range(40):
        editor = _editor(studio)
        bar = editor["bars"][int(rng.integers(len(editor["bars"])))]
        name = str(rng.choice([slot["name"] for slot in bar["slots"] if slot["name"] in values]))
        order = {
            "op": "set", "site": bar["site"], "name": name, "base": editor["base"],
            "value": round(float(rng.uniform(*values[name])), 2), "commit": number % 4 == 3,
        }  # fmt: skip
        answer = studio.edit({**order, "has": _shown(shown)["version"]})
        if not isinstance(answer, bytes):
            assert answer.keys() == {"site"}
            shown = _data(studio, shown)
            assert shown == _data(studio)
            continue
        _, shown = read_message(answer, shown)
        assert shown == studio._server._sent[_shown(shown)["version"]].data
        sent, whole = sent + len(answer), whole + len(shown)
    assert sent < 0.8 * whole


def test_an_edit_is_saved_shown_and_undone(studio: Studio, file: Path) -> None:
    answer = _edit(studio, 0, op="set", name="over", value=0.9)
    assert answer == {"site": _editor(studio)["bars"][0]["site"]}
    assert file.read_text(encoding="utf-8") == GREET.replace("(10.0), over=0.6", "(10.0), over=0.9")
    editor = _editor(studio)
    assert editor["bars"][0]["span"][2] == pytest.approx(0.9)
    assert editor["undo"]
    assert studio.edit({"op": "undo"}) == {}
    assert file.read_text(encoding="utf-8") == GREET
    assert _editor(studio)["bars"][0]["span"][2] == pytest.approx(0.6)


def test_a_call_that_moves_nothing_is_told_and_a_pause_is_none(studio: Studio) -> None:
    _edit(studio, 0, op="insert", title="Pause")
    _edit(studio, 0, op="duplicate")
    told = [(bar["name"], bar["is_idle"]) for bar in _editor(studio)["bars"]]
    assert told[:3] == [("body", False), ("body", True), ("hold", False)]
    assert not any(is_idle for _, is_idle in told[3:])


def test_what_the_language_refuses_is_not_written(studio: Studio, file: Path) -> None:
    answer = _edit(studio, 2, op="delete")
    told = "the front right foot is not up there: raise it before (line 13)"
    assert answer["error"] == told
    assert file.read_text(encoding="utf-8") == GREET


def test_a_page_that_shows_an_older_text_changes_nothing(studio: Studio, file: Path) -> None:
    old = _editor(studio)
    theirs = GREET.replace("over=0.6)\n", "over=0.7)\n", 1)
    file.write_text(theirs, encoding="utf-8")
    order = {"op": "delete", "site": old["bars"][0]["site"], "base": old["base"], "commit": True}
    assert "saved elsewhere" in str(_told(studio, order)["error"])
    assert file.read_text(encoding="utf-8") == theirs
    assert _editor(studio)["bars"][1]["span"][2] == pytest.approx(1.3), "theirs is shown"


def test_a_text_that_somebody_breaks_is_told_and_can_be_undone(studio: Studio, file: Path) -> None:
    file.write_text(GREET.replace("return line", "return lines"), encoding="utf-8")
    assert _look(studio)
    assert "NameError" in str(studio._server._error)
    assert studio.edit({"op": "undo"}) == {}
    assert file.read_text(encoding="utf-8") == GREET
    assert studio._server._error is None


def test_a_file_that_is_away_is_told(studio: Studio, file: Path) -> None:
    file.unlink()
    assert not _look(studio)
    assert "cannot read greet.py" in str(studio._server._error)
    assert "cannot read" in _edit(studio, 0, op="delete")["error"]
    assert not file.exists()
    file.write_text(GREET, encoding="utf-8")  # as it was: nothing is new, but it is there
    assert _look(studio)
    assert studio._server._error is None
    assert not _look(studio)


def test_a_chosen_parameter_is_no_edit(studio: Studio, file: Path) -> None:
    studio._choose({"times": 2})
    bars = _editor(studio)["bars"]
    assert [bar["runs"] for bar in bars if bar["name"] == "foot"] == [2, 2]
    assert file.read_text(encoding="utf-8") == GREET
    studio._choose({})


def test_a_motion_that_cannot_be_done_is_made_possible(studio: Studio, file: Path) -> None:
    assert "error" not in _edit(studio, 0, op="set", name="pitch", value=46.0)
    changes = studio.mend({})["changes"]
    assert isinstance(changes, tuple)
    call, _ = changes[0]
    assert _edit(studio, 0, op="change", which=7)["error"]
    assert "error" not in _edit(studio, 0, op="change", which=0)
    assert f"return line.home(over=0.6){call}\n" in file.read_text(encoding="utf-8")
    assert _shown(_data(studio))["verdict"]["ok"]


def test_physics_plays_it_beside_the_plan(studio: Studio) -> None:
    studio.warm()
    answer = studio.play({})
    assert isinstance(answer, bytes)
    told, data = read_message(answer)
    shown = _shown(data)
    assert not shown["is_plan"]
    assert shown["ghost"] is not None
    assert str(told["told"]).startswith("played in MuJoCo: done")


def test_what_is_exported_lies_beside_the_file(studio: Studio, file: Path) -> None:
    page = file.with_suffix(".html")
    folder = str(file.parent.resolve())
    wrote = {"told": "wrote greet.html", "file": "greet.html", "folder": folder}
    assert studio.export({"kind": "html"}) == wrote
    before = page.read_text(encoding="utf-8")
    assert "class Studio" not in before
    page.write_text("mine", encoding="utf-8")
    assert studio.export({"kind": "html"}) == {"exists": "greet.html"}
    assert page.read_text(encoding="utf-8") == "mine"
    assert studio.export({"kind": "html", "again": True}) == wrote
    assert page.read_text(encoding="utf-8") == before
    assert "kind" in str(studio.export({"kind": "../../evil"})["error"])


def test_an_exported_page_plays_the_song(studio: Studio, file: Path) -> None:
    song = file.with_name("tune.wav")
    with wave.open(str(song), "wb") as sound:
        sound.setparams((1, 2, 22_050, 0, "NONE", ""))
        noise = np.random.default_rng(0).integers(-9000, 9000, 22_050, dtype=np.int16)
        sound.writeframes(noise.tobytes())
    page, sizes = file.with_suffix(".html"), list[int]()
    for name in (None, "tune.wav", "../tune.wav"):
        assert "told" in studio.export({"kind": "html", "song": name, "again": True})
        sizes.append(page.stat().st_size)
    assert sizes[1] > sizes[0] + 2000
    assert sizes[2] == sizes[0]
    song.unlink()


@pytest.mark.slow
def test_a_file_that_never_ends_is_stopped_and_the_next_one_runs(
    studio: Studio, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process = studio._runner._process.pid
    monkeypatch.setattr(running, "LONGEST_WAIT", 60.0)  # a busy machine may need it for 2 s of work
    endless = GREET.replace("    line = Time", "    while times: pass\n    line = Time")
    file.write_text(endless, encoding="utf-8")
    _look(studio)
    assert "ran for longer than 2 s; it was stopped" in str(studio._server._error)
    file.write_text(GREET, encoding="utf-8")
    _look(studio)
    assert studio._server._error is None
    assert studio._runner._process.pid == process, "the robot need not be loaded again"
    monkeypatch.setattr(running, "LONGEST_WAIT", 0.5)
    for text, told in (
        (GREET + "\nimport time\ntime.sleep(99)\n", "ran for longer than 0.5 s; it was stopped"),
        (GREET + "\nimport os\nos._exit(3)\n", "has ended the process"),
        (GREET + "\nimport sys\nsys.exit(3)\n", "the file ends the program"),
    ):
        file.write_text(text, encoding="utf-8")
        _look(studio)
        assert told in str(studio._server._error)
    file.write_text(GREET, encoding="utf-8")
    _look(studio)
    assert studio._server._error is None


def test_a_file_without_a_motion_does_not_open(tmp_path: Path) -> None:
    file = tmp_path / "none.py"
    with pytest.raises(StudioError, match=r"cannot read none\.py"):
        Studio(file, None, 0)
    file.write_text("x = 1\n", encoding="utf-8")
    start = time.monotonic()
    with pytest.raises(StudioError, match="defines no motion"):
        Studio(file, None, 0)
    assert time.monotonic() - start < running.LONGEST_WORK


def test_another_motion_of_the_file_is_chosen(studio: Studio, file: Path) -> None:
    assert "unknown motion" in str(studio.choose({"motion": "bow"})["error"])
    other = GREET + "\n\n" + GREET[GREET.index("@motion") :].replace("greet", "bow")
    file.write_text(other, encoding="utf-8")
    _look(studio)
    assert studio.choose({"motion": "bow"}) == {}
    assert studio.motion == "bow"
    assert studio.choose({"motion": "greet"}) == {}


def test_what_is_no_song_beside_the_file_is_refused(file: Path) -> None:
    for name in ("../song.wav", "song.wav", 7):
        assert "unknown song" in str(music(file, {"name": name})["error"])
    file.with_name("song.wav").write_bytes(b"no sound")
    assert "song.wav" in str(music(file, {"name": "song.wav"})["error"])


def test_nothing_is_copied_from_where_no_call_ends(studio: Studio) -> None:
    assert "no call ends" in str(studio.copy({"sites": [[1, 1]]})["error"])


HELPERS = """from motions import Timeline, deg, motion


def nod(line: Timeline, angle: float) -> Timeline:
    return line.body(pitch=deg(angle), over=0.5)


@motion
def greet() -> Timeline:
    line = nod(Timeline(), 5.0)
    for angle in (4.0, 3.0):
        line = nod(line, angle)
    return line.home(over=0.5)
"""


def test_a_bar_of_a_helper_is_edited_where_it_is_called(studio: Studio, file: Path) -> None:
    file.write_text(HELPERS, encoding="utf-8")
    _look(studio)
    editor = _editor(studio)
    bars = [bar for bar in editor["bars"] if bar["name"] == "body"]
    assert [bar["slots"][0]["value"] for bar in bars] == [5.0, 4.0, 3.0]
    site, base = bars[2]["site"], editor["base"]
    offers = {"op": "offers", "site": site, "number": 2, "base": base}
    offered = _told(studio, offers)["offers"]
    assert [offer["op"] for offer in offered] == ["parameter", "pace"]
    order = {"op": "set", "site": site, "number": 2, "name": "pitch", "value": 6.5, "base": base}
    assert "error" not in _told(studio, {**order, "commit": True})
    assert file.read_text(encoding="utf-8") == HELPERS.replace("4.0, 3.0", "4.0, 6.5")


def test_a_loop_is_written_out_and_the_whole_undone(studio: Studio, file: Path) -> None:
    text = GREET.replace("range(times)", "range(2)")
    file.write_text(text, encoding="utf-8")
    _look(studio)
    editor = _editor(studio)
    (bar, *_) = (bar for bar in editor["bars"] if bar["name"] == "foot")
    order = {"op": "unroll", "site": bar["site"], "number": 0, "base": editor["base"]}
    assert "error" not in _told(studio, {**order, "commit": True})
    line = '    line = line.foot("FR", z=0.08, over=0.5).down("FR", over=0.5)\n'
    assert 2 * line in file.read_text(encoding="utf-8")
    studio.edit({"op": "undo"})
    assert file.read_text(encoding="utf-8") == text


def test_what_is_computed_is_written_out_once_its_lines_were_shown(
    studio: Studio, file: Path
) -> None:
    text = GREET.replace("over=0.6).home", "over=sum((0.2, 0.4))).home")
    text = text.replace('foot("FR"', 'foot("".join("FR")')
    file.write_text(text, encoding="utf-8")
    _look(studio)
    editor = _editor(studio)
    bar = [bar["name"] for bar in editor["bars"]].index("foot")
    order: dict[str, object] = {"op": "write_out", "bar": bar, "base": editor["base"]}
    offers = {"op": "offers", "site": editor["bars"][bar]["site"], "base": editor["base"]}
    assert "write_out" in [offer["op"] for offer in _told(studio, offers)["offers"]]
    told = _told(studio, {"op": "propose", "proposed": order, "base": editor["base"]})
    assert (
        '-        line = line.foot("".join("FR"), z=0.08, over=0.5).down("FR", over=0.5)'
        in told["diff"]
    )
    assert '+        line = line.foot("FR", z=0.08, over=0.5).down("FR", over=0.5)' in told["diff"]
    assert told["fixed"] == []
    assert file.read_text(encoding="utf-8") == text, "shown only"
    for wrong in ({"bar": 99}, {"bar": "a"}, {}):
        assert "error" in _told(studio, {"base": editor["base"], "op": "write_out", **wrong})
    assert "error" not in _told(studio, {**order, "commit": True})
    assert file.read_text(encoding="utf-8") == text.replace('"".join("FR")', '"FR"')
    studio.edit({"op": "undo"})
    assert file.read_text(encoding="utf-8") == text


def test_of_a_choice_it_is_told_which_value_plays(studio: Studio, file: Path) -> None:
    chosen = "over=0.5 if times > 2 else 0.7).down"
    text = GREET.replace("over=0.5).down", chosen).replace("deg(10.0)", "deg(8 if times else 10)")
    file.write_text(text.replace("0.6).home", "0.6 if times else times * 0.7).home"), "utf-8")
    _look(studio)
    slots = {
        bar["name"]: [(one["value"], one["plays"]) for one in bar["slots"]]
        for bar in _editor(studio)["bars"]
    }
    assert slots["foot"] == [("FR", None), (0.08, None), (0.5, False), (0.7, True)]
    assert slots["body"][:2] == [(8, True), (10, False)]
    assert slots["body"][2] == (0.6, True)


def test_bars_of_other_files_are_written_out_here_or_read_there(studio: Studio, file: Path) -> None:
    helper = file.with_name("elsewhere.py")
    helper.write_text(
        "from motions import Timeline\n\n\ndef dip(deep: float) -> Timeline:\n"
        "    return Timeline().body(z=-deep, over=0.5).home(over=0.5)\n",
        encoding="utf-8",
    )
    text = GREET.replace("from motions", "from elsewhere import dip\nfrom motions").replace(
        "line.home(over=0.6)", "line.home(over=0.6).then(dip(0.01 * times))"
    )
    file.write_text(text, encoding="utf-8")
    _look(studio)
    editor = _editor(studio)
    (bar, *_) = (k for k, one in enumerate(editor["bars"]) if one["file"])
    known = {"bar": bar, "base": editor["base"]}
    read = _told(studio, {"op": "read", **known})
    assert (read["line"], read["file"]) == (5, str(helper.resolve()))
    assert read["text"] == helper.read_text(encoding="utf-8").splitlines()
    assert "error" in _told(studio, {"op": "read", "bar": 0, "base": editor["base"]})
    offers = {"op": "offers", "site": [0, 0], **known}
    assert [offer["op"] for offer in _told(studio, offers)["offers"]] == ["write_out"]
    order = {"op": "write_out", **known}
    told = _told(studio, {"op": "propose", "proposed": order, "base": editor["base"]})
    assert told["fixed"] == ["times"], "what it was called with is a number then"
    assert "error" not in _told(studio, {**order, "commit": True})
    assert ".then(Timeline().body(z=-0.01, over=0.5).home(over=0.5))" in file.read_text("utf-8")


def test_an_empty_motion_is_shown_and_begun(studio: Studio, file: Path) -> None:
    empty = "from motions import Timeline, deg, motion\n\n\n@motion\ndef greet() -> Timeline:\n"
    file.write_text(f"{empty}    return Timeline()\n", encoding="utf-8")
    _look(studio)
    editor = _editor(studio)
    assert editor["bars"] == []
    order = {"op": "begin", "title": "Tilt the trunk", "base": editor["base"]}
    assert "error" not in _told(studio, {**order, "commit": True})
    assert [bar["name"] for bar in _editor(studio)["bars"]] == ["body"]


def test_modules_beside_the_file_are_read_anew_and_random_numbers_are_told(
    studio: Studio, file: Path
) -> None:
    helper = file.with_name("deepness.py")
    helper.write_text("DEEP = -0.02\n", encoding="utf-8")
    text = GREET.replace("from motions", "from deepness import DEEP\nfrom motions").replace(
        "pitch=deg(10.0)", "z=DEEP"
    )
    file.write_text(text, encoding="utf-8")
    _look(studio)
    before = _shown(_data(studio))["verdict"]["chance"]
    assert _editor(studio)["notes"] == []
    helper.write_text("DEEP = -0.30\n", encoding="utf-8")
    file.write_text(f"{text}# again\n", encoding="utf-8")
    _look(studio)
    assert _shown(_data(studio))["verdict"]["chance"] < before
    text = f"import random\n{GREET}".replace("def greet(", "def other(").replace(
        "z=0.08", "z=random.uniform(0.05, 0.08)"
    )
    studio.motion = "other"
    file.write_text(text, encoding="utf-8")
    _look(studio)
    (note,) = _editor(studio)["notes"]
    assert "random" in note
    studio.motion = "greet"
