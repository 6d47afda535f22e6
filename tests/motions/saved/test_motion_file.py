"""A motion that was saved is the same motion when it is loaded, or the reason why not is said."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

import go2_wbc
from controller.cli.common import ExitCode
from controller.cli.main import main
from go2_wbc.curves import Ease
from go2_wbc.errors import ConfigError, MotionFileError, TimelineError
from motions import Timeline, check, find_motion, load_motion, motion_names, save_motion
from motions.language.keys import Key
from motions.saved import values
from motions.saved.files import KINDS
from tests.motions.saved.random_timelines import Written, timeline_of, written

TIMELINE = (
    Timeline(name="small")
    .body(pitch=0.1, over=0.5)
    .foot("FR", z=0.05, over=0.5)
    .body_path([{"z": -0.01}, {"z": -0.02}], over=1.0)
)
Change = Callable[[dict[str, Any]], object]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return save_motion(TIMELINE, tmp_path / "small.json")


def changed(file: Path, change: Change) -> Path:
    fields = json.loads(file.read_text())
    change(fields)
    file.write_text(json.dumps(fields))
    return file


def test_every_kind_of_key_can_be_saved() -> None:
    def names(parent: type[Key]) -> set[str]:  # a class with slots is made twice
        own = {parent.__name__} if parent.__module__.startswith("motions.") else set()
        return own.union(*map(names, parent.__subclasses__()))

    traced = {"CallMark"}  # taken out before anything is saved
    assert {kind.__name__ for kind in KINDS.values()} == names(Key) - {"Key"} - traced


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_of_the_library_comes_back_as_it_was(tmp_path: Path, name: str) -> None:
    path = save_motion(find_motion(name), tmp_path / f"{name}.json")
    assert load_motion(path) == load_motion(str(path)) == load_motion(name)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(written)
def test_any_timeline_comes_back_as_it_was(tmp_path: Path, drawn: Written) -> None:
    line = timeline_of(drawn)
    again = load_motion(save_motion(line, tmp_path / "any.json"))
    assert again == line
    assert type(again) is Timeline


def test_a_file_has_a_line_for_each_key_and_what_it_leaves_out_its_default(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = file.read_text().splitlines()
    assert sum('"key": ' in line for line in lines) == len(TIMELINE.keys)
    fields = json.loads(file.read_text())
    assert (fields["format"], fields["version"]) == ("go2_wbc.motion", 1)
    assert fields["go2_wbc"] == go2_wbc.__version__
    names = ("name", "balance", "cursor", "clock", "floor", "last_start")
    changed(file, lambda fields: [fields.pop(name) for name in names])
    assert load_motion(file).keys == TIMELINE.keys
    assert load_motion(file).name == "motion"
    with pytest.raises(TimelineError, match="has no parameters, got times"):
        load_motion(file, times=3)
    for least, expected in ((0, nullcontext()), (1, pytest.raises(MotionFileError, match="larg"))):
        monkeypatch.setattr(values, "LARGEST_FILE", file.stat().st_size - least)
        with expected:
            load_motion(file)


def test_a_saved_motion_is_played_and_checked_by_the_name_of_its_file(tmp_path: Path) -> None:
    path = save_motion(load_motion("bow"), tmp_path / "mine.json")
    assert check(str(path)).ok
    assert check(path).margins == check("bow").margins


def set_key(name: str, value: object) -> Change:
    return lambda fields: fields["keys"][0].update({name: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.update(format="go2_wbc.plan"), "is not a saved motion: .* not 'go2_wbc.plan'"),
        (lambda f: f.pop("format"), '"format": "go2_wbc.motion"'),
        (lambda f: f.update(version=2), "has version 2 .* reads up to version 1: install a newer"),
        (lambda f: f.update(version="1"), "version must be a whole number, got '1'"),
        (lambda f: f.update(version=True), "version must be a whole number, got True"),
        (lambda f: f.update(tempo=3), "unknown field 'tempo'; valid: balance, clock"),
        (lambda f: f.update(entry="fly"), "unknown the motion.entry 'fly'; valid: lie, sit, stand"),
        (lambda f: f.update(balance=1), "balance must be true or false, got 1"),
        (lambda f: f.update(name=3), "name must be a word, got 3"),
        (lambda f: f["clock"].update(instants=[1.0, 0.5]), "beats must come one after the other"),
        (lambda f: f["clock"].update(instants=[1.0]), "a tempo needs 2 beats or more, got 1"),
        (lambda f: f["keys"][3].update(shares=[1.5]), r"keys\[3\]: shares must be as many as"),
        (lambda f: f["keys"][3].update(through=[]), r"keys\[3\]: shares must be as many as"),
        (lambda f: f.update(cursor=10**400), "cursor must be a finite number, got 1000"),
        (lambda f: f.pop("keys"), "keys must be a list, got None"),
        (lambda f: f.update(keys=[3]), r"keys\[0\] must be an object, got 3"),
        (lambda f: f["keys"].append(f["keys"][0]), "body pitch moves twice at once"),
        (set_key("key", "wing"), r"keys\[0\]: unknown key 'wing'; valid: balance, body"),
        (set_key("start", "now"), r"keys\[0\].start must be a finite number, got 'now'"),
        (set_key("end", -1.0), "must start at 0 s or later and end later, got 0.0 -1.0"),
        (set_key("ease", "bouncy"), "ease 'bouncy'; valid: cubic, hold"),
        (set_key("channel", "w"), "unknown channel 'w'; valid: pitch, roll"),
        (lambda f: f["keys"][0].pop("value"), r"keys\[0\] lacks value"),
        (
            lambda f: f["keys"][2]["target"].update(values=[0.0, 0.0, -0.1]),
            r"keys\[2\]: a foot cannot go below the ground: z is -0.1",
        ),
        (
            lambda f: f["keys"][2]["target"].update(values=[0.0, 0.0]),
            "values must be 3 values, got 2",
        ),
    ],
)
def test_what_a_file_says_wrongly_is_named(file: Path, change: Change, message: str) -> None:
    with pytest.raises(MotionFileError, match=message) as caught:
        load_motion(changed(file, change))
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999"])
def test_a_number_that_is_not_finite_is_refused(file: Path, number: str) -> None:
    file.write_text(file.read_text().replace('"value": 0.1', f'"value": {number}'))
    with pytest.raises(MotionFileError, match="finite number"):
        load_motion(file)


def test_a_file_cut_short_anywhere_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    for length in range(0, len(whole) - 2, 37):
        file.write_bytes(whole[:length])
        with pytest.raises(MotionFileError, match="damaged or cut short"):
            load_motion(file)


@pytest.mark.parametrize("text", ["", "[]", "3", "[" * 100_000, '{"format": ["a"]}', "\xff"])
def test_what_is_no_motion_is_refused(file: Path, text: str) -> None:
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(MotionFileError, match=r"small\.json"):
        load_motion(file)


def test_a_missing_file_a_folder_and_a_place_that_cannot_be_written_are_named(
    tmp_path: Path,
) -> None:
    with pytest.raises(MotionFileError, match=r"there is no file .*none\.json"):
        load_motion(tmp_path / "none.json")
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(MotionFileError, match=r"folder\.json is a folder, not a file"):
        load_motion(tmp_path / "folder.json")
    with pytest.raises(ConfigError, match="a folder has this name"):
        save_motion(TIMELINE, tmp_path / "folder.json")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot write"):
        save_motion(TIMELINE, tmp_path / "file" / "small.json")


@dataclass(frozen=True, slots=True)
class HomeMade(Key):
    """A key that no file knows."""

    @property
    def track(self) -> str:
        return "home-made"


def test_what_a_file_cannot_hold_is_refused_and_the_old_file_kept(file: Path) -> None:
    before = file.read_bytes()
    with pytest.raises(MotionFileError, match=r"keys\[0\] \(body z\)\.ease\.function is <function"):
        save_motion(Timeline().body(z=0.01, over=1.0, ease=lambda s: s * s), file)
    home_made = HomeMade(0.0, 1.0, Ease.LINEAR)
    with pytest.raises(MotionFileError, match="a file cannot hold a HomeMade"):
        save_motion(replace(TIMELINE, keys=(home_made,)), file)
    with pytest.raises(MotionFileError, match="needs a Timeline or a motion, got 'wave'"):
        save_motion("wave", file)
    with pytest.raises(ConfigError, match=r"valid: \.json"):
        save_motion(TIMELINE, file.with_suffix(".txt"))
    assert file.read_bytes() == before
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_the_commands_write_and_take_saved_motions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "two_nods.json"
    assert main(["export", "nod", "--set", "times=2", "--out", str(path), "--json"]) == ExitCode.OK
    said = json.loads(capsys.readouterr().out)
    assert said == {"motion": "nod", "file": str(path)}
    assert load_motion(path) == load_motion("nod", times=2)
    assert main(["check", str(path)]) == ExitCode.OK
    assert "the robot can do it" in capsys.readouterr().out
    assert main(["check", str(path), "--set", "times=3"]) == ExitCode.USAGE
    assert "has no parameters" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "none.json")]) == ExitCode.USAGE
    assert "there is no file" in capsys.readouterr().err
