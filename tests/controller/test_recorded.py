"""Options, tables, observations and measures say what they once said."""

from argparse import ArgumentParser, _SubParsersAction
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.cli.main import COMMANDS, PROGRAM, Program, build_parser
from controller.motion_measurement import MotionMeasurement, failures_of, shares_of
from controller.observation import ACTIONS, OBSERVATION, Actuation, observed
from controller.report_view import planned
from controller.sweeps.certify import Certificate, told
from controller.sweeps.motion_study import text_of
from controller.sweeps.relation import relations
from controller.sweeps.summary import summarise
from controller.sweeps.sweep_file import columns_of, joined, row_of
from controller.teleop import PadReading, keys_help
from go2_wbc.errors import Go2WbcError
from go2_wbc.world import World
from motions import FeasibilityChecker, load_motion, load_plan
from tests.engine_helpers import random_state
from tests.held.make import PLANS, STORED
from tests.recorded import assert_as_recorded

FILE = Path(__file__).with_name("recorded.json")


def said(act: Callable[[], object]) -> str:
    """What comes of it, or why nothing does."""
    try:
        return repr(act())
    except Go2WbcError as error:
        return f"error: {error}"


def options_of(parser: ArgumentParser) -> Iterator[str]:
    """Every option of a parser and of its commands."""
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            for name, other in action.choices.items():
                yield f"{name}: {other.description}"
                yield from options_of(other)
            continue
        kind = getattr(action.type, "__name__", "")
        yield repr(
            [*action.option_strings, action.dest, action.nargs, action.default, action.choices]
            + [action.required, kind, action.help, action.metavar]
        )


@pytest.mark.parametrize("command", [command.name for command in COMMANDS])
def test_options_are_those_recorded(command: str) -> None:
    parser = build_parser(Program(PROGRAM, "", COMMANDS, ""), command)
    assert_as_recorded(FILE, f"options {command}", {"told": "\n".join(options_of(parser))})


def test_sticks_and_buttons_ask_for_what_is_recorded() -> None:
    ways = np.linspace(-1.0, 1.0, 9)
    axes = [(x, -0.5 * x, 0.3, 0.7 * x) for x in ways]
    pads = [PadReading(tuple(map(float, axis)), tuple(range(9))) for axis in axes]
    told = [said(lambda pad=pad: (pad.command, pad.keys)) for pad in (*pads, PadReading(()))]
    assert_as_recorded(FILE, "pads", {"told": "\n".join([*told, keys_help()])})


def test_observations_and_commands_are_those_recorded() -> None:
    rng = np.random.default_rng(1)
    rows, commands = [], []
    for phase in (0.0, 0.2, 0.7):
        action = rng.uniform(-1.5, 1.5, 12)
        command = rng.normal(size=3) * np.array([1.0, 1.0, 9.0])
        rows.append(observed(OBSERVATION, random_state(rng), command, phase, action))
        for kind in ACTIONS:
            meaning = Actuation(kind, np.full(12, 23.7))
            made = meaning.command(action)
            commands += [getattr(made, field.name) for field in fields(made)]
            commands.append(meaning.action(rng.normal(size=12)))
    told = {"rows": rows, "commands": np.concatenate(commands), "table": OBSERVATION.table()}
    chosen = OBSERVATION.chosen(["gravity", "clock"])
    told["chosen"] = f"{chosen.names} {chosen.parts} {chosen.units} {chosen.slices}"
    told["limits"] = np.clip(OBSERVATION.limits, -1e6, 1e6)
    assert_as_recorded(FILE, "observation", told)


def rows() -> list[dict[str, Any]]:
    """Of a study with numbers, truth values and words."""
    rng = np.random.default_rng(2)
    found = []
    for seed in range(60):
        friction, payload = rng.uniform(0.2, 1.0), rng.choice([0.0, 1.0, 2.0])
        ok = bool(friction > 0.4 + 0.1 * payload)
        row = {"friction": float(friction), "payload": float(payload), "ok": ok, "steps": seed % 7}
        why = "" if ok else ("slipped" if seed % 3 else "fell")
        row |= {"margin": float(friction - 0.4), "closest share": 0.9 - friction, "fall": why}
        found.append(row)
    return found


def test_summaries_and_relations_are_those_recorded() -> None:
    study = rows()
    columns = columns_of(study[0])
    told = {
        "summary": repr(summarise(study, columns).as_dict()),
        "joined": repr(joined(columns, study[1])),
    }
    for over in ((), ("friction",), ("payload", "friction"), ("steps",), ("nothing",), ("ok",) * 3):
        told[f"over {over}"] = said(lambda over=over: relations(study, columns, over))
    mixed = (
        {"a": 1, "b": 2.0},
        {"a": 1.5, "b": 2},
        {"a": True, "b": 2},
        {"a": 1},
        {"a": "x", "b": 1},
    )
    told["mixed"] = "\n".join(
        said(lambda one=one: joined({"a": "int", "b": "float"}, one)) for one in mixed
    )
    given = ({}, 3, {"seed": 1}, {"A": 1, "a": 2}, {"n": 2**63}, {"n": -(2**63)}, {"n": None})
    told["given"] = "\n".join(said(lambda one=one: row_of(one)) for one in given)
    assert_as_recorded(FILE, "study", told)


def test_certificates_are_told_as_recorded() -> None:
    usual = {"friction": 0.45, "mass_scale": 1.1, "closest": "torque", "closest_share": 0.87}
    worst = tuple(
        {"seed": seed, **usual, "done": seed > 1, "harm": "slipped" * (2 - seed)}
        for seed in range(3)
    )
    about = {"go2_wbc": "1.0", "plan": 9 * "abc ", "world": text_of(World(0.4))}
    told_of: dict[str, object] = {
        "rows": "\n".join(said(lambda row=row: told(row)) for row in worst)
    }
    for n, done in ((60, 60), (60, 41), (200, 3), (1, 0)):
        interval = (max(done / n - 0.1, 0.0), min(done / n + 0.05, 1.0))
        shown = worst[: n % 7], about, Path("wave.sqlite"), "it fell" * (n - done)
        one = Certificate("wave", n, done, interval, *shown)
        meets = [one.meets(least) for least in (0.0, one.interval[0], 0.5, 1.0)]
        told_of[f"{done} of {n}"] = f"{said(one.table)} {said(one.as_dict)} {one.rate} {meets}"
    assert_as_recorded(FILE, "certificates", told_of)


SOUND: dict[str, Any] = {
    **{field.name: 0.0 for field in fields(MotionMeasurement)},
    **{"fall": None, "said": True, "reason": "", "joint_distance": 0.1},
}


@pytest.mark.parametrize("kind", PLANS)
def test_what_is_wrong_with_a_run_is_told_as_recorded(kind: str) -> None:
    plan, told_of = load_plan(STORED / f"{kind}.plan"), dict[str, object]()
    for name, value in SOUND.items():
        for share in (0.3, 1.0, -0.5):
            new = {float: 0.1 * share, bool: False}.get(type(value), "fell")
            run = replace(MotionMeasurement(**SOUND), **{name: new})
            measured = (run.ok, run.lines(), run.as_dict(), failures_of(run, plan))
            told_of[f"{name} {share}"] = f"{measured} {shares_of(run, plan)}"
    assert_as_recorded(FILE, f"measured {kind}", told_of)


@pytest.mark.parametrize("name", ["wave", "bow", "cross_step", "lift_leg"])
def test_a_report_is_shown_as_recorded(name: str, checker: FeasibilityChecker) -> None:
    for change in ("", "hurried"):
        line = load_motion(name)
        checked = checker.evaluate(line.scale_time(0.25) if change else line)
        content = planned(checked)
        verdict = content.verdict
        assert verdict is not None
        texts, numbers = list[str](), list[float]()
        take_apart((asdict(verdict), content.end_pose), texts, numbers)
        found = {"texts": "\n".join(texts), "numbers": numbers}
        assert_as_recorded(FILE, f"shown {name} {change}", found)


def take_apart(value: object, texts: list[str], numbers: list[float]) -> None:
    """Words and numbers of nested values."""
    if isinstance(value, Mapping):
        value = tuple(value.items())
    if isinstance(value, list | tuple):
        for part in value:
            take_apart(part, texts, numbers)
    elif isinstance(value, np.ndarray | int | float):
        numbers += np.asarray(value, dtype=float).ravel().tolist()
    else:
        texts.append(str(value))
