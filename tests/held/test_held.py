"""What users hold of the package goes on working: names, calls, options, keys and files.

``stored`` was made by ``make.py`` with the code of a release. A name, key or option may be replaced
if it warns and goes on working; the stored set stays as it is.
"""

import importlib
import json
import logging
import shutil
import tomllib
import warnings
from collections.abc import Mapping
from dataclasses import asdict, fields
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.sweeps import read_sweep
from go2_wbc import GAITS, Recording, RobotModel, WbcConfig, WholeBodyController, load_config
from go2_wbc.errors import MissingDependency
from motions import find_motion, load_motion, load_plan, motion_names, save_motion
from tests.held.make import PLANS, STORED, commands, face, leaves, nested, numbers, timeline, toml

ROUNDING = 1e-12  #: Of sums that another version may add up in another order [m, rad, N]
OURS = ("controller", "go2_wbc", "motions", "viz")
Parameters = Mapping[str, str]


def stored(name: str) -> dict[str, Any]:
    return json.loads((STORED / name).read_text(encoding="utf-8"))


def held(module: str, name: str) -> object:
    """What users import; a warning is welcome, and another module may be where it lives now."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return getattr(importlib.import_module(module), name)


@pytest.mark.parametrize("module", stored("imports.json"))
def test_every_name_can_be_imported(module: str) -> None:
    for name in stored("imports.json")[module]:
        try:
            held(module, name)
        except (ImportError, MissingDependency) as error:
            if not needs_an_extra(error):
                raise
            pytest.skip(f"{module} needs an extra: {error}")


def needs_an_extra(error: ImportError | MissingDependency) -> bool:
    """Whether what is missing is no module of ours."""
    if isinstance(error, MissingDependency):
        return True
    return (error.name or OURS[0]).split(".")[0] not in OURS


@pytest.mark.parametrize(
    ("name", "members"), stored("face.json").items(), ids=lambda v: v if isinstance(v, str) else ""
)
def test_every_member_takes_what_it_took(
    name: str, members: Mapping[str, Parameters | None]
) -> None:
    now = face(held(*name.rsplit(".", 1)))
    for member, before in members.items():
        assert member in now, f"{name}.{member} is gone"
        taken = now[member]
        if before is not None and taken is not None:
            assert broken(before, taken) == [], f"{name}.{member}"


def broken(before: Parameters, now: Parameters) -> list[str]:
    """Why calls that were right before are not now."""
    found = [f"{name} was {told}" for name, told in before.items() if not fits(told, now.get(name))]
    for name, told in now.items():
        if name not in before and "=" not in told and not told.startswith("VAR_"):
            found.append(f"{name} is new, and needed")
    by_place = [name for name in before if before[name].startswith("POSITIONAL") and name in now]
    places = [list(now).index(name) for name in by_place]
    return found if places == sorted(places) else [*found, f"in another order: {by_place}"]


def fits(before: str, now: str | None) -> bool:
    """Whether a parameter may be given as before, by place or by name, and has the same default."""
    kind, _, default = before.partition("=")
    if now is None:
        return False
    kind_now, _, default_now = now.partition("=")
    is_wider = kind == kind_now or kind_now == "POSITIONAL_OR_KEYWORD"
    return is_wider and (not default or default == default_now)


@pytest.mark.parametrize(
    ("before", "now", "is_right"),
    [
        ({"x": "KEYWORD_ONLY=1"}, {"x": "POSITIONAL_OR_KEYWORD=1"}, True),
        ({"x": "POSITIONAL_OR_KEYWORD"}, {"x": "POSITIONAL_OR_KEYWORD=2"}, True),
        ({"x": "POSITIONAL_OR_KEYWORD=1"}, {"x": "POSITIONAL_OR_KEYWORD=2"}, False),
        ({"x": "POSITIONAL_OR_KEYWORD"}, {"x": "KEYWORD_ONLY"}, False),
        ({"x": "KEYWORD_ONLY=1"}, {"x": "KEYWORD_ONLY=1", "y": "KEYWORD_ONLY"}, False),
        ({"x": "KEYWORD_ONLY=1"}, {"x": "KEYWORD_ONLY=1", "y": "KEYWORD_ONLY=0"}, True),
        ({"x": "KEYWORD_ONLY=1"}, {}, False),
    ],
)
def test_a_call_that_is_right_no_more_is_seen(
    before: Parameters, now: Parameters, is_right: bool
) -> None:
    assert (broken(before, now) == []) is is_right


def test_every_command_has_the_options_that_it_had() -> None:
    now = commands()
    for command, options in stored("commands.json").items():
        for option, before in options.items():
            taken = now[command][option]
            assert taken["flag"] == before["flag"], f"{command} {option}"
            lost = set(before["choices"] or ()) - set(taken["choices"] or before["choices"] or ())
            assert not lost, f"{command} {option}"


def test_every_gait_motion_back_end_and_solver_is_there() -> None:
    words = stored("words.json")
    assert set(words["gaits"]) <= set(GAITS)
    assert set(words["motions"]) <= set(motion_names())
    for name, parameters in words["motions"].items():
        assert set(parameters) <= {item.name for item in find_motion(name).parameters}, name
    model = RobotModel()
    for backend in words["backends"]:
        assert WholeBodyController(model, backend).backend_name == backend
    for solver in words["solvers"]:
        WholeBodyController(model, "full", WbcConfig(solver=solver))


@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_a_file_with_every_key_is_read() -> None:
    config = load_config(STORED / "config.toml")
    assert config.backend == "full"


@pytest.mark.parametrize(
    ("place", "value"),
    list(leaves(tomllib.loads((STORED / "config.toml").read_text(encoding="utf-8")))),
    ids=lambda v: ".".join(v) if isinstance(v, tuple) else "",
)
def test_every_key_is_followed_or_warned_of(
    place: tuple[str, ...], value: object, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "config.toml"
    file.write_text(toml(nested(place, value)), encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught, caplog.at_level(logging.WARNING):
        warnings.simplefilter("always")
        config = load_config(file)
    lines = [str(item.message) for item in caught] + caplog.messages
    if not any(place[-1] in line for line in lines):
        found = attrgetter(".".join(place))(config)
        assert found == (tuple(value) if isinstance(value, list) else value)


def test_a_motion_is_read_as_it_was_written(tmp_path: Path) -> None:
    file = STORED / "everything.json"
    read = load_motion(file)
    again = json.loads(save_motion(read, tmp_path / "again.json").read_text(encoding="utf-8"))
    for name, value in stored("everything.json").items():
        assert name == "go2_wbc" or again[name] == value, name
    assert read == timeline()


@pytest.mark.parametrize("name", PLANS)
def test_a_plan_asks_for_what_it_asked_for(name: str) -> None:
    plan = load_plan(STORED / f"{name}.plan")
    with np.load(STORED / "plans.npz") as expected:
        np.testing.assert_allclose(numbers(plan), expected[name], rtol=0.0, atol=ROUNDING)


def test_the_rows_of_a_sweep_are_read(tmp_path: Path) -> None:
    found = read_sweep(shutil.copy(STORED / "rows.sqlite", tmp_path))
    assert found.rows == stored("values.json")["rows"]
    assert found.failures == {}


def test_a_recording_is_read() -> None:
    with np.load(STORED / "recording.npz") as data:
        arrays: dict[str, Any] = {name: data[name] for name in data.files}
    arrays["labels"] = tuple(arrays["labels"].tolist())
    recording = Recording(**arrays)
    assert {item.name for item in fields(Recording)} >= set(arrays)
    assert Recording.load(STORED / "recording.npz").robot == recording.robot == "go2"
    assert [asdict(span) for span in recording.spans()] == stored("values.json")["spans"]
    assert len(recording.q) == len(recording.time)
