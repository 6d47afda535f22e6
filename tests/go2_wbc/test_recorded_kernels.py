"""Every compiled function, as plain Python on drawn numbers, gives what it once gave."""

import signal
import typing
import zlib
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from jaxtyping import AbstractArray

import go2_wbc
from go2_wbc.compilation import Routine
from go2_wbc.planning.height_map import HeightMap
from go2_wbc.records import Record, _looking_at, layout_of, packed
from go2_wbc.reference import Target
from go2_wbc.robot.estimator import StateEstimator
from go2_wbc.robot.latency import LAGS, Lag
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.payload_estimation import PayloadEstimator
from go2_wbc.robot.rigid_body import Payload
from go2_wbc.robot.state import SensorReading, Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from tests.engine_helpers import MODES, random_state
from tests.go2_wbc.test_recorded import MODEL, sensed, walked
from tests.recorded import assert_as_recorded

FILE = Path(__file__).with_name("recorded_kernels.json")
DRAWS, KEPT = 36, 4  #: Calls of each function, and what is kept of them
APART = 90  #: Ticks from one moment of a walk that is taken to the next
CHANGES = (0.0, 0.02, 0.2, 2.0)  #: By what share numbers of a walk are changed at most
FLIPPED = 0.03  #: Share of what may be flags that say the opposite of what a walk has
ROUNDING = 1e-12  #: What is less is 0 on some processor
NOT_ZERO = (0.0, 0.0, 0.05, 0.3)  #: Share of what is 0 on a walk that is something else
UNKNOWN = 0.05  #: Share of a map's cells
NOT_A_NUMBER = 0.1  #: Share of what sensors read that is none
SMALL = 1e-4  #: What is greater is told by its ratio to others, so that none outweighs the rest
LENGTH = 40  #: Of an axis that may have any length
LEFT_OUT = (
    *("planning.force_mpc.plan_forces", "planning.force_mpc.apply_force_plan"),
    *("planning.locomotion.plan", "planning.mpc.solve_mpc"),
    *("planning.mpc.assemble", "planning.mpc.bound", "planning.trunk.gained"),
    "wbc.trajectory_loads.room_for_feet",
)
"""What takes seconds as plain Python, or arguments that belong together: other tests hold it.
And what only makes room, in which anything may lie."""
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
        Draw(0).value(tuple[*parameters(routine)])
    except TypeError:
        return False
    return True


def parameters(routine: Routine) -> list[Any]:
    """The annotations of its parameters."""
    hints = typing.get_type_hints(routine.written, include_extras=True)
    return [hint for name, hint in hints.items() if name != "return"]


def moments(name: str) -> Iterator[dict[type, Any]]:
    """Records of a robot that walks, by kind: at some ticks of it."""
    estimator, wbc, rng = (
        StateEstimator(MODEL),
        WholeBodyController(MODEL),
        np.random.default_rng(0),
    )
    payload = PayloadEstimator(MODEL, JointFriction.none())
    for tick, (planner, now, reference) in enumerate(walked(name, wild=False), 1):
        estimator.update(sensed(now, rng))
        payload.update(now)
        if tick % APART == 0:
            wbc.solve(now, reference)
            whole = planner, estimator, estimator.watch, wbc, payload, MODEL
            parts = (vars(one).values() for one in whole)
            todo = [Target.of(reference.row), now, *(part for each in parts for part in each)]
            yield dict(rows_in(todo))


def rows_in(todo: list[Any]) -> Iterator[tuple[type, Any]]:
    """Every kind of record among these and their parts, with a row of numbers of it."""
    for one in todo:
        if isinstance(getattr(one, "row", None), np.ndarray):
            kind = type(one) if isinstance(one, Record) else type(one).__mro__[1]
            yield kind, one.row.copy()
            parts = (getattr(one, name) for name in layout_of(kind).fields)
            yield from rows_in([part for x in parts for part in (x if type(x) is tuple else (x,))])


SEEING, BLIND = [*moments("up stairs")], [*moments("trot"), *moments("at once")]
KNOWN = {HeightMap: SEEING[-1][HeightMap]}
MOMENTS = [*SEEING, *(SEEING[0] | moment | KNOWN for moment in BLIND)]


class Draw:
    """Values for the parameters of one call, at a moment of a walk."""

    def __init__(self, number: int) -> None:
        """What is drawn depends on the ``number`` of the call, and on nothing else."""
        self._rng, self._sizes = np.random.default_rng(number), dict[str, int]()
        self._moment = MOMENTS[number % len(MOMENTS)]
        self._change = CHANGES[(number + number // len(MOMENTS)) % len(CHANGES)]

    def value(self, hint: Any) -> Any:  # noqa: ANN401 - of any kind
        """A value for a parameter; TypeError for a hint of another kind."""
        rng = self._rng
        if typing.get_origin(hint) is typing.Annotated:
            return self.value(typing.get_args(hint)[0])
        if hint is float:
            any_size = rng.choice([1.0, 1.0, -1.0]) * 10.0 ** rng.uniform(-3.0, 2.0)
            return np.float64(rng.choice([rng.uniform(0.0, 1.0), rng.normal(), any_size]))
        if hint is int:
            return int(rng.integers(0, 4))
        if hint is bool:
            return bool(rng.random() < 0.5)
        if typing.get_origin(hint) is tuple:
            return tuple(map(self.value, typing.get_args(hint)))
        if isinstance(hint, type) and issubclass(hint, AbstractArray):
            sizes = self._sizes
            each = hint.dim_str.split()
            shape = [int(n) if n.isdigit() else sizes.setdefault(n, LENGTH) for n in each]
            if "bool" in hint.dtypes:
                return rng.random(shape) < 0.5
            if "float64" in hint.dtypes:
                return rng.normal(scale=0.5, size=shape)
            return rng.integers(0, 3, size=shape).astype(np.int32)  # as MuJoCo has them
        layout_of(hint)
        return self._record(hint)

    def _record(self, kind: Any) -> Any:  # noqa: ANN401 - of any kind
        """Of drawn numbers; what a walk has of a kind is that, more or less changed."""
        rng, size = self._rng, layout_of(kind).size
        if kind is Snapshot and self._change >= CHANGES[-2] and rng.random() < 0.7:
            carried = Payload(rng.uniform(0.0, 8.0), tuple(rng.uniform(-0.1, 0.1, 3).tolist()))
            now, leg = MODEL.snapshot(random_state(rng), carried), rng.integers(4)
            now.J_contacts[leg, 2] *= rng.random() < 0.7  # else the leg is stretched
            return now
        if kind in self._moment:
            row = self._moment[kind].copy()
            if kind is not HeightMap and self._change:  # its numbers name its cells, as well
                row[np.abs(row) < ROUNDING] = 0.0
                factors, others = rng.uniform(-1.0, 1.0, row.size), rng.random(row.size)
                is_number = np.isfinite(row) & (row != np.round(row))
                row = np.where(is_number, (1.0 + self._change * factors) * row, row)
                row = np.where(np.isin(row, (0.0, 1.0)) & (others < FLIPPED), 1.0 - row, row)
                share = NOT_ZERO[CHANGES.index(self._change)]
                is_other = (row == 0.0) & (rng.random(row.size) < share)
                row = np.where(is_other, rng.normal(scale=0.2, size=row.size), row)
            if kind is SensorReading and self._change == CHANGES[1]:
                row[rng.random(row.size) < NOT_A_NUMBER] = np.nan
            record = _looking_at(kind, row)
            if kind is HeightMap and self._change >= CHANGES[-2]:
                record.height[:] += np.kron(rng.normal(scale=0.1, size=(20, 20)), np.ones((8, 8)))
                record.name[rng.random(record.name.shape) < UNKNOWN] = 0.0
            if kind is Target and rng.random() < 0.5:
                record.legs[:], record.force_weight = MODES[rng.integers(len(MODES))], 0.0
            return record
        try:
            return packed(kind()) if not issubclass(kind, Record) else undecided(kind)
        except TypeError:
            row = rng.uniform(0.0, 1.0, size) * rng.choice([1.0, -0.3], size)
            whole = rng.random(size) < 0.3  # flags and counts
            row[whole] = rng.integers(0, 3, np.count_nonzero(whole))
            record = _looking_at(kind, row)
            if kind is Lag:  # else no command is late
                record.ticks, record.known = rng.integers(LAGS), LAGS
            return record


def undecided(kind: type) -> None:
    """Records begin with nothing but 0: their numbers are drawn."""
    raise TypeError(kind)


def flat(*values: Any) -> Iterator[np.ndarray]:  # noqa: ANN401 - of any kind
    """All numbers of what was returned, or filled."""
    for value in values:
        if isinstance(value, tuple):
            yield from flat(*value)
        elif value is not None:
            yield np.asarray(getattr(value, "row", value), dtype=float).ravel()


def summed(values: Iterable[np.ndarray]) -> float:
    """A number that each of these changes by its ratio times a weight, whatever its size."""
    numbers = np.concatenate([np.zeros(0), *values])
    numbers = np.nan_to_num(numbers, nan=-7.0, posinf=1e9, neginf=-1e9)
    return float(np.arcsinh(numbers / SMALL) @ np.cos(np.arange(numbers.size)))


def too_long(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError


ROUTINES = routines()


@pytest.mark.parametrize("name", ROUTINES)
def test_a_compiled_function_gives_as_plain_python_what_is_recorded(name: str) -> None:
    routine, told = ROUTINES[name], [list[np.ndarray]() for _ in range(KEPT)]
    failed = 0
    for draw in range(DRAWS):
        values = Draw(draw)
        given = [values.value(hint) for hint in parameters(routine)]
        start, handler = list(map(np.copy, flat(*given))), signal.signal(signal.SIGVTALRM, too_long)
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
        try:
            with np.errstate(all="ignore"):
                made = [*flat(routine.written(*given))]
        except (ArithmeticError, IndexError, ValueError, TimeoutError) as error:
            failed += 1
            made = [*flat(zlib.crc32(type(error).__name__.encode()))]
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            signal.signal(signal.SIGVTALRM, handler)
        with np.errstate(invalid="ignore"):  # inf less inf
            changes = [end - begun for end, begun in zip(flat(*given), start, strict=True)]
        changes = [each for each in changes if each.any()]  # a map that stays would hide the rest
        told[draw % KEPT] += [*made, *changes]
    assert failed <= DRAWS / 2, "what is drawn for it is not what it takes"
    assert_as_recorded(FILE, name, {str(n): summed(each) for n, each in enumerate(told)})
