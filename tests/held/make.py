"""Makes the stored set of what users hold: ``python -m tests.held.make``.

Run it with the code of a release, when there is something new to hold. What was stored before is
never taken out: it is out there, in scripts and on disks.
"""

import argparse
import importlib
import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields
from operator import attrgetter
from pathlib import Path
from typing import Any, cast

import numpy as np

from benchmarks.golden_runs import STAGES
from controller import GO2Controller, sweep
from controller.cli.main import COMMANDS, PROGRAM, Program, build_parser
from go2_wbc import GAITS, MotionPlan, Recording
from go2_wbc.config import Config, override
from go2_wbc.errors import ConfigError
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import SENSORS
from motions import Timeline, compile_motion, find_motion, motion_names, save_motion, save_plan

ROOT = Path(__file__).resolve().parents[2]
STORED = Path(__file__).parent / "stored"
PLANS = {"kinematic": "nod", "dynamic": "jump_up"}  #: Motions of the library whose plans are stored
INSTANTS = 9  #: At which the numbers of a plan are stored
PACKAGES = (
    *("go2_wbc", "go2_wbc.plant", "motions", "motions.feasibility", "motions.dynamics"),
    *("motions.music", "viz", "controller", "controller.sweeps", "controller.demo"),
    "controller.bridges.ros2",
)
"""Those with an ``__all__``."""
OPEN = ("go2_wbc.errors", "go2_wbc.plant.terrain", "go2_wbc.plant.sensors")
"""Modules of which users may name every class."""
FACE = {
    "controller": ("GO2Controller", "Certificate", "Mode", "Outcome", "certify", "sweep"),
    "go2_wbc": (
        *("Gait", "JointCommand", "MujocoPlant", "Plant", "Recording", "Reference", "RobotState"),
        *("VelocityCommand", "WbcSolution", "WholeBodyController", "World", "load_config"),
    ),
    "go2_wbc.plant.terrain": ("Boxes", "Patch", "Ramp", "Slope", "Stairs"),
    "motions": (
        *("Choice", "FeasibilityChecker", "FeasibilityReport", "Finding", "Motion", "Range"),
        *("Suggestion", "Timeline", "Tolerance", "beats", "check", "compile_motion"),
        *("compile_timeline", "deg", "find_motion", "load_file", "load_motion", "load_plan"),
        *("motion", "motion_names", "save_motion", "save_plan", "suggest"),
    ),
    "viz": ("export_animation", "export_filmstrip", "export_html", "export_plot"),
}
"""Whose members and signatures users hold."""
RETURNED = ("Certificate", "FeasibilityReport", "Finding", "Motion", "Suggestion", "WbcSolution")
"""Classes that users are given, and do not make."""
BACKENDS = ("condensed", "full", "placo")
SOLVERS = ("active_set", "daqp", "proxqp", "quadprog")
MOTORS = ("ideal", "torque-speed")
WORDS = {"backend": "full", "solver": "quadprog", "motor": "ideal"}
"""Values of the keys that are words."""
Leaf = tuple[tuple[str, ...], Any]


def timeline() -> Timeline:
    """With a key of every kind that a file may hold."""
    return (
        Timeline(name="everything", physics="nearest")
        .body(x=0.01, pitch=0.05, over=0.7)
        .body_path([{"x": 0.0, "z": 0.0}, {"x": 0.02, "z": -0.01}], over=0.6)
        .hold(0.2, name="pause")
        .unweight("FL", over=0.5)
        .foot("FL", x=0.03, z=0.05, over=0.4)
        .leg("FL", hip=0.1, thigh=0.9, calf=-1.8, over=0.4, ease="linear")
        .joint("FL", "calf", -1.6, over=0.3)
        .home(over=0.6)
        .step("RR", x=0.04, over=0.5)
        .walk(x=0.2)
        .jump(height=0.08)
        .posture("sit", over=1.2)
    )


def trial(seed: int) -> dict[str, float | int | bool | str]:
    """A row with every kind of value."""
    return {"speed": 0.1 * seed, "steps": 3 * seed, "ok": seed != 1, "fall": "" if seed else "-0.0"}


def leaves(table: Mapping[str, Any], place: tuple[str, ...] = ()) -> Iterator[Leaf]:
    """Every key of nested tables with its value."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*place, key))
        else:
            yield (*place, key), value


def nested(place: tuple[str, ...], value: object) -> dict[str, Any]:
    """Nested tables with this one key."""
    for key in reversed(place):
        value = {key: value}
    return value  # type: ignore[return-value]


def toml(table: Mapping[str, Any], place: tuple[str, ...] = ()) -> str:
    """``table`` as TOML; JSON writes lists, words and numbers in the same way."""
    own = [f"{k} = {json.dumps(v)}" for k, v in table.items() if not isinstance(v, Mapping)]
    parts = [toml(v, (*place, k)) for k, v in table.items() if isinstance(v, Mapping)]
    head = [f"\n[{'.'.join(place)}]"] if place and own else []
    return "\n".join([*head, *own, *parts])


def numbers(plan: MotionPlan) -> np.ndarray:
    """(INSTANTS, n) what the plan asks for."""
    rows = []
    for t in np.linspace(0.0, plan.duration, INSTANTS).tolist():
        at = plan.at(t)
        rows.append(np.hstack([np.ravel(attrgetter(n)(at)) for n in STAGES["reference"][1:]]))
    return np.array(rows, float)


def signature(call: Callable[..., object]) -> dict[str, str]:
    """Kind and default of each parameter, ``self`` left out."""
    found = {}
    for name, item in inspect.signature(call).parameters.items():
        is_plain = isinstance(item.default, str | int | float | bool | None)
        default = repr(item.default) if is_plain else "..."
        told = "" if item.default is item.empty else f"={default}"
        found[name] = f"{item.kind.name}{told}"
    return {name: told for name, told in found.items() if name != "self"}


def face(thing: object) -> dict[str, dict[str, str] | None]:
    """Of a function its signature; of a class its public members and theirs, and how it is made."""
    if not inspect.isclass(thing):
        return {"": signature(cast("Callable[..., object]", thing))}
    made = {} if thing.__name__ in RETURNED else {"": signature(thing)}
    members = {name: _member(thing, name) for name in dir(thing) if not name.startswith("_")}
    return {**made, **members}


def _member(kind: type, name: str) -> dict[str, str] | None:
    value = inspect.getattr_static(kind, name)
    if isinstance(value, staticmethod | classmethod):
        value = getattr(kind, name)
    if inspect.isbuiltin(value) or inspect.ismethoddescriptor(value):
        return None  # of a text, say: Python's own have no signature before 3.13
    return signature(value) if inspect.isroutine(value) else None


def imports() -> dict[str, list[str]]:
    """Names by module: what packages export, and what documents and examples import."""
    found = {name: set(importlib.import_module(name).__all__) for name in PACKAGES}
    for name in OPEN:
        module = importlib.import_module(name)
        kinds = inspect.getmembers(module, inspect.isclass)
        found[name] = {n for n, kind in kinds if kind.__module__ == name and n[0] != "_"}
    pattern = re.compile(r"from ((?:go2_wbc|motions|viz|controller)[\w.]*) import ([\w, ]+)")
    places = ("README.md", "docs/**/*.md", "docs/**/*.ipynb", "examples/**/*.py", "ros2/**/*.py")
    for place in places:
        for file in sorted(ROOT.glob(place)):
            for name, imported in pattern.findall(file.read_text(encoding="utf-8")):
                words = {word.split(" as ")[0].strip() for word in imported.split(",")}
                found.setdefault(name, set()).update(filter(None, words))
    return {name: sorted(words) for name, words in sorted(found.items())}


def commands() -> dict[str, dict[str, Any]]:
    """The options of every command: what each takes."""
    program = Program(PROGRAM, "", COMMANDS, "")
    return {
        command.name: _options(build_parser(program, command.name), command.name)
        for command in COMMANDS
    }


def _options(parser: argparse.ArgumentParser, name: str) -> dict[str, Any]:
    (own,) = (a.choices[name] for a in parser._actions if isinstance(a.choices, dict))
    found: dict[str, Any] = {}
    for action in own._actions:
        for word in action.option_strings or [action.dest]:
            listed = None if action.choices is None else [str(item) for item in action.choices]
            found[word] = {"flag": action.nargs == 0, "choices": listed}
    return found


def configuration() -> dict[str, Any]:
    """Every key that a file may set, away from its default where another value is valid."""
    config, found = Config(), {}
    for place, value in leaves(asdict(config)):
        for other in (WORDS[place[-1]],) if isinstance(value, str) else (*_others(value), value):
            change = nested(place, other)
            try:
                override(Config(), change, "alone")
                config = override(config, change, "together")
            except ConfigError:
                continue
            table = found
            for key in place[:-1]:
                table = table.setdefault(key, {})
            table[place[-1]] = other
            break
    return found


def _others(value: object) -> Iterator[object]:
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield from (value + 1, value - 1)
    elif isinstance(value, float):
        more, less = float(f"{1.03 * value:.3g}"), float(f"{0.97 * value:.3g}")
        yield from (other for other in (more, less, value + 0.05) if other != value)
    elif isinstance(value, tuple):
        yield from (list(items) for items in zip(*map(_others, value), strict=False))


def write(name: str, value: object) -> None:
    """Write ``value`` as JSON."""
    text = json.dumps(value, indent=1) + "\n"
    (STORED / name).write_text(text, encoding="utf-8")


def main() -> None:
    """Write every file anew."""
    STORED.mkdir(exist_ok=True)
    write("imports.json", imports())
    write("commands.json", commands())
    write(
        "face.json",
        {
            f"{module}.{name}": face(getattr(importlib.import_module(module), name))
            for module, names in FACE.items()
            for name in names
        },
    )
    library = {name: [p.name for p in find_motion(name).parameters] for name in motion_names()}
    words = {"backends": BACKENDS, "solvers": SOLVERS, "gaits": list(GAITS), "sensors": SENSORS}
    write("words.json", {**words, "motors": MOTORS, "motions": library})
    (STORED / "config.toml").write_text(toml(configuration()) + "\n", encoding="utf-8")
    save_motion(timeline(), STORED / "everything.json")
    plans = {}
    for name, motion in PLANS.items():
        plan = compile_motion(motion, RobotModel())
        save_plan(plan, STORED / f"{name}.plan")
        plans[name] = numbers(plan)
    np.savez_compressed(STORED / "plans.npz", **plans)
    rows = STORED / "rows.sqlite"
    found = sweep(importlib.import_module("tests.held.make").trial, 3, out=rows, fresh=True)
    with GO2Controller() as go2:
        go2.stand()
        go2.walk()
        recording = go2.recording(rate=10.0)
    arrays: dict[str, Any] = {f.name: getattr(recording, f.name) for f in fields(Recording)}
    np.savez_compressed(STORED / "recording.npz", **arrays)
    spans = [asdict(span) for span in recording.spans()]
    write("values.json", {"rows": found.rows, "spans": spans})


if __name__ == "__main__":
    main()
