"""A plan that was saved plays number by number as before, or the reason why not is said."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.cli.common import ExitCode
from controller.cli.main import main
from go2_wbc.errors import ConfigError, MotionFileError
from go2_wbc.robot.model import RobotModel
from motions import (
    CompiledPlan,
    Timeline,
    check,
    compile_timeline,
    load_motion,
    load_plan,
    motion_names,
    save_plan,
)
from tests.motions.doctored import with_body_aside
from tests.motions.plans import library_plan

MODEL = RobotModel()
LEAN = Timeline(name="lean").body(roll=0.05, over=0.4).hold(0.2, name="held").home(over=0.4)
Change = Callable[[dict[str, Any]], object]


@pytest.fixture(scope="module")
def plan() -> CompiledPlan:
    return compile_timeline(LEAN, MODEL)


@pytest.fixture
def file(plan: CompiledPlan, tmp_path: Path) -> Path:
    return save_plan(plan, tmp_path / "lean.plan", model=MODEL)


def changed(file: Path, change: Change, **arrays: np.ndarray) -> Path:
    with np.load(file) as archive:
        parts = {name: archive[name] for name in archive.files}
    description = json.loads(str(parts["description"]))
    change(description)
    text = np.array(json.dumps(description))
    stream = io.BytesIO()
    np.savez(stream, **{**parts, **arrays, "description": text})
    file.write_bytes(stream.getvalue())
    return file


def require_same(again: CompiledPlan, plan: CompiledPlan) -> None:
    for t in np.linspace(-0.1, plan.duration + 0.1, 50):
        assert np.array_equal(again.row_at(t), plan.row_at(t))
    assert (again.name, again.entry, again.exit) == (plan.name, plan.entry, plan.exit)
    assert (again.duration, again.ramp) == (plan.duration, plan.ramp)
    assert again.spans == plan.spans
    assert repr(again.problems) == repr(plan.problems)  # nan is not equal to itself


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_of_the_library_plays_the_same_row_for_row(tmp_path: Path, name: str) -> None:
    plan = library_plan(name)
    require_same(load_plan(save_plan(plan, tmp_path / "a.plan", model=MODEL), model=MODEL), plan)


def test_feet_to_hold_up_what_was_not_done_and_beats_are_still_known(tmp_path: Path) -> None:
    plan = library_plan("high_five")
    again = load_plan(save_plan(plan, tmp_path / "a.plan", model=MODEL), model=MODEL)
    assert again.held_feet == plan.held_feet
    assert len(again.held_feet) == 1
    far = Timeline().foot("FR", x=0.6, z=0.3, over=1.0).home(over=1.0)
    plan = compile_timeline(far, MODEL)
    assert {problem.check for problem in plan.problems} >= {"way of a foot"}
    unbalanced = replace(plan, problems=(*plan.problems, plan.problems[0].__class__("a", "b", 1.0)))
    require_same(load_plan(save_plan(unbalanced, tmp_path / "far.plan")), unbalanced)
    plan = compile_timeline(Timeline().bpm(120).body(roll=0.05, over=2).home(over=1), MODEL)
    assert plan.beats == pytest.approx([0.0, 0.5, 1.0, 1.5])
    file = save_plan(plan, tmp_path / "counted.plan", model=MODEL)
    assert load_plan(file, model=MODEL).beats == plan.beats
    assert load_plan(changed(file, lambda f: f["plan"].pop("beats")), model=MODEL).beats == ()
    wrong = changed(file, lambda f: f["plan"].update(beats=[1.0, 0.5]))
    with pytest.raises(MotionFileError, match="must rise from 0 s to"):
        load_plan(wrong, model=MODEL)


def test_a_saved_plan_is_played_by_its_file_also_one_of_version_1(file: Path) -> None:
    def older(description: dict[str, Any]) -> None:
        description["version"] = 1
        del description["plan"]["held"]

    assert load_plan(changed(file, older)).held_feet == ()
    assert check(file).margins == check(LEAN).margins
    assert check(str(file)).motion == "lean"


def test_a_plan_for_another_robot_or_with_curves_of_another_number_is_refused(file: Path) -> None:
    other = RobotModel(foot_radius=0.03)
    with pytest.raises(MotionFileError, match=r"lean\.plan was compiled for another robot \("):
        load_plan(file, model=other)
    arrays: dict[str, Any] = {
        "plan.curves.c": np.zeros((4, 2, 18)),
        "plan.curves.x": np.arange(3.0),
    }
    with pytest.raises(MotionFileError, match=r"must be 30 cubics from 0 s on, got \[4, 2, 18\]"):
        load_plan(changed(file, lambda d: None, **arrays))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(format="go2_wbc.motion"), "is not a saved plan: .* not 'go2_wbc.mot"),
        (lambda d: d.update(version=9, go2_wbc="3.0"), "version 9 .* by go2_wbc 3.0; .* version 2"),
        (lambda d: d.pop("robot"), r"another robot \(None"),
        (lambda d: d.pop("plan"), "plan must be an object, got None"),
        (lambda d: d["plan"].pop("ramp"), "plan lacks ramp"),
        (lambda d: d["plan"].update(ramp=0.0), "plan.ramp must be above 0 s"),
        (lambda d: d["plan"].update(held={"up": "FL"}), "plan.held names 'up', which is none of"),
        (lambda d: d["plan"].update(wings=4), "plan: unknown field 'wings'; valid: beats"),
        (lambda d: d["plan"]["curves"]["c"].update(array="b"), "the array 'b', which is not there"),
        (lambda d: d["plan"]["contacts"].update(times=[0.0, 0.0]), "need increasing times"),
        (lambda d: d["plan"]["contacts"].update(period=1.0), "contacts must not repeat"),
    ],
)
def test_what_a_file_says_wrongly_is_named(file: Path, change: Change, message: str) -> None:
    with pytest.raises(MotionFileError, match=message) as caught:
        load_plan(changed(file, change))
    assert "lean.plan" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "array", "message"),
    [
        ("plan.curves.c", np.zeros((4, 3, 30)), "must be polynomials between increasing times"),
        ("plan.curves.x", np.array([0.0, np.nan, 1.0]), "has a value that is not finite"),
        ("plan.curves.x", np.array(["a"]), "plan.curves.x must be an array of numbers"),
        ("plan.swings", np.zeros((2, 4), dtype=bool), "a row for each of 1 contact"),
        ("plan.swings", np.zeros((1, 4)), "plan.swings must be Bool"),
        ("plan.contacts.modes", np.zeros((1, 3), dtype=bool), "modes must be Bool"),
    ],
)
def test_arrays_that_fit_no_plan_are_refused(
    file: Path, name: str, array: np.ndarray, message: str
) -> None:
    with pytest.raises(MotionFileError, match=message):
        load_plan(changed(file, lambda d: None, **{name: array}))


def test_a_file_cut_short_or_with_objects_in_it_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    for length in range(0, len(whole), len(whole) // 25):
        file.write_bytes(whole[:length])
        with pytest.raises(MotionFileError, match="damaged, cut short, or no saved plan"):
            load_plan(file)
    stream = io.BytesIO()
    np.savez(stream, description=np.array([print], dtype=object))
    file.write_bytes(stream.getvalue())
    with pytest.raises(MotionFileError, match="damaged, cut short, or no saved plan"):
        load_plan(file)


def test_a_file_with_a_changed_byte_never_gives_another_plan(
    file: Path, plan: CompiledPlan
) -> None:
    whole, rng = file.read_bytes(), np.random.default_rng(3)
    for place in rng.integers(0, len(whole), 60):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            again = load_plan(file, model=MODEL)
        except MotionFileError:
            continue
        require_same(again, plan)  # the byte was one that nobody reads, such as a date


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04", b"\x93NUMPY\x01\x00"])
def test_what_is_no_plan_is_refused(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    with pytest.raises(MotionFileError, match="damaged, cut short, or no saved plan"):
        load_plan(file)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(MotionFileError, match="there is no file"):
        load_plan(tmp_path / "none.plan")
    with pytest.raises(MotionFileError, match="is a folder"):
        load_plan(tmp_path)


def test_what_is_no_finite_plan_is_not_written_and_the_old_file_kept(
    file: Path, plan: CompiledPlan
) -> None:
    before = file.read_bytes()
    curves = plan.curves.__class__.construct_fast(plan.curves.c * np.nan, plan.curves.x)
    with pytest.raises(MotionFileError, match=r"plan\.curves\.c of 'lean' .* not finite"):
        save_plan(replace(plan, curves=curves), file)
    with pytest.raises(MotionFileError, match="save_plan needs a CompiledPlan"):
        save_plan(with_body_aside(plan, 0.1), file)
    with pytest.raises(ConfigError, match=r"valid: \.plan"):
        save_plan(plan, file.with_suffix(".npz"))
    assert file.read_bytes() == before
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_the_commands_write_and_take_saved_plans(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "nod.plan"
    assert main(["export", "nod", "--out", str(path)]) == ExitCode.OK
    assert capsys.readouterr().out == f"wrote {path}: nod\n"
    assert main(["check", str(path)]) == ExitCode.OK
    assert "the robot can do it" in capsys.readouterr().out
    assert main(["export", str(path), "--out", str(tmp_path / "nod.csv"), "--json"]) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["rows"] > 100
    assert main(["check", str(path), "--set", "times=3"]) == ExitCode.USAGE
    assert "has no parameters" in capsys.readouterr().err
    assert main(["export", str(path), "--out", str(tmp_path / "nod.json")]) == ExitCode.USAGE
    assert "needs a Timeline or a motion" in capsys.readouterr().err


def test_a_plan_is_dynamic_if_fewer_than_three_feet_stand() -> None:
    two_feet = Timeline(balance=False).foot("FL", z=0.03, over=0.5).foot("RR", z=0.03, over=0.5)
    assert compile_timeline(two_feet.home(over=0.5), MODEL).is_dynamic
    assert not compile_timeline(load_motion("wave"), MODEL).is_dynamic
