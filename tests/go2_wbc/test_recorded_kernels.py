"""Every compiled function, as plain Python on drawn numbers, gives what it once gave."""

import signal
import typing
import zlib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from jaxtyping import AbstractArray

import go2_wbc
from go2_wbc.compilation import Routine
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.height_map import HeightMap
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.plant.terrain import Waves
from go2_wbc.records import Record, _looking_at, layout_of, packed
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from tests.engine_helpers import random_state, standing_q, state_of
from tests.go2_wbc.planning.seen import exact_map
from tests.recorded import assert_as_recorded

FILE = Path(__file__).with_name("recorded_kernels.json")
DRAWS, KEPT = 24, 4  #: Calls of each function, and what is kept of them
LENGTH = 40  #: Of an axis that may have any length
LEFT_OUT = (
    *("planning.force_mpc.plan_forces", "planning.force_mpc.apply_force_plan"),
    *("planning.locomotion.plan", "planning.mpc.solve_mpc"),
    *("planning.mpc.assemble", "planning.mpc.bound", "planning.trunk.gained"),
)
"""What takes seconds as plain Python, or arguments that belong together: other tests hold it."""
LONGEST = 5.0  #: Processor time [s] of a call: on such numbers a loop may be a long one


def routines() -> dict[str, Routine]:
    """By module and name."""
    root, found = Path(go2_wbc.__file__).parent, dict[str, Routine]()
    for file in sorted(root.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if "@subroutine" in text or "@kernel" in text:
            name = ".".join(file.relative_to(root.parent).with_suffix("").parts)
            for value in vars(import_module(name)).values():
                if isinstance(value, Routine) and value.written.__module__ == name:
                    found[value.name.removeprefix("go2_wbc.")] = value
    return {name: found[name] for name in found if name not in LEFT_OUT and is_drawn(found[name])}


def is_drawn(routine: Routine) -> bool:
    """Whether its parameters are numbers, arrays and records: of others nothing is drawn."""
    try:
        drawn(tuple[*parameters(routine)], np.random.default_rng(0), {})
    except TypeError:
        return False
    return True


def parameters(routine: Routine) -> list[Any]:
    """The annotations of its parameters."""
    hints = typing.get_type_hints(routine.written, include_extras=True)
    return [hint for name, hint in hints.items() if name != "return"]


MODEL = RobotModel()


def usual() -> dict[type, Any]:
    """Records of a robot that walks over waves, by kind."""
    waves = exact_map(Waves(0.08, start=0.2), -1.5, 1.5, 0.8)
    planner = LocomotionPlanner(MODEL, GAITS["trot"], LocomotionConfig(), waves)
    now = MODEL.snapshot(state_of(standing_q()))
    planner.start(now)
    for tick in range(1, 150):
        planner.update(
            now.replaced(state=state_of(standing_q(), time=0.002 * tick)), VelocityCommand(0.5)
        )
    assert planner._heights is not None
    found: dict[type, Any] = {HeightMap: planner._heights}
    todo = [planner._state, planner._walk]
    while todo:
        one = todo.pop()
        kind = type(one) if issubclass(type(one), Record) else type(one).__mro__[1]
        found.setdefault(kind, one)
        parts = (getattr(one, name) for name in layout_of(kind).fields)
        each = (part if isinstance(part, tuple) else (part,) for part in parts)
        todo += [part for group in each for part in group if hasattr(part, "row")]
    return found


USUAL = usual()


def drawn(hint: Any, rng: np.random.Generator, sizes: dict[str, int]) -> Any:  # noqa: ANN401 - of any kind
    """A value for a parameter; TypeError for a hint of another kind."""
    if typing.get_origin(hint) is typing.Annotated:
        return drawn(typing.get_args(hint)[0], rng, sizes)
    if hint is float:
        return np.float64(rng.choice([rng.uniform(0.0, 1.0), rng.normal()]))
    if hint is int:
        return int(rng.integers(0, 4))
    if hint is bool:
        return bool(rng.random() < 0.5)
    if typing.get_origin(hint) is tuple:
        return tuple(drawn(part, rng, sizes) for part in typing.get_args(hint))
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        shape = [
            int(n) if n.isdigit() else sizes.setdefault(n, LENGTH) for n in hint.dim_str.split()
        ]
        if "bool" in hint.dtypes:
            return rng.random(shape) < 0.5
        if "float64" in hint.dtypes:
            return rng.normal(scale=0.5, size=shape)
        return rng.integers(0, 3, size=shape).astype(np.int32)  # as MuJoCo has them
    layout_of(hint)
    return record_of(hint, rng)


def record_of(kind: Any, rng: np.random.Generator) -> Any:  # noqa: ANN401 - of any kind
    """A record of drawn numbers; what a walk has of a kind is that, a little changed."""
    layout = layout_of(kind)
    if kind is Snapshot:
        return MODEL.snapshot(random_state(rng))
    if kind in USUAL:
        row = USUAL[kind].row.copy()
        numbers = np.isfinite(row) & (row != np.round(row))  # no flag, and no count
        row[numbers] *= rng.uniform(0.8, 1.2, np.count_nonzero(numbers))
        return _looking_at(kind, row)
    try:
        return packed(kind()) if not issubclass(kind, Record) else undecided(kind)
    except TypeError:
        row = rng.uniform(0.0, 1.0, layout.size) * rng.choice([1.0, -0.3], layout.size)
        return _looking_at(kind, row)


def undecided(kind: type) -> None:
    """Records begin with nothing but 0: their numbers are drawn."""
    raise TypeError(kind)


def flat(value: Any) -> Iterator[float]:  # noqa: ANN401 - of any kind
    """All numbers of what was returned, or filled."""
    if isinstance(value, tuple):
        for part in value:
            yield from flat(part)
    elif value is not None:
        yield from np.asarray(getattr(value, "row", value), dtype=float).ravel().tolist()


def too_long(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError


ROUTINES = routines()


@pytest.mark.parametrize("name", ROUTINES)
def test_a_compiled_function_gives_as_plain_python_what_is_recorded(name: str) -> None:
    routine, told = ROUTINES[name], [list[float]() for _ in range(KEPT)]
    failed = 0
    for draw in range(DRAWS):
        rng, sizes = np.random.default_rng(draw), dict[str, int]()
        given = [drawn(hint, rng, sizes) for hint in parameters(routine)]
        before = signal.signal(signal.SIGVTALRM, too_long)
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
        try:
            with np.errstate(all="ignore"):
                made = routine.written(*given)
            all_of_it = [*flat(made), *flat(tuple(given))]
        except (ArithmeticError, IndexError, ValueError, TimeoutError) as error:
            failed += 1
            all_of_it = [float(zlib.crc32(type(error).__name__.encode())), *flat(tuple(given))]
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            signal.signal(signal.SIGVTALRM, before)
        told[draw % KEPT] += np.arcsinh(all_of_it).tolist()  # so that none outweighs all
    assert failed < DRAWS / 2, "what is drawn for it is not what it takes"
    assert_as_recorded(FILE, name, {str(group): each for group, each in enumerate(told)})
