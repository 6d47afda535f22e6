"""``python -m benchmarks plain``: does compiled code do what the Python does that it is written in?

While the demo is driven by compiled code, every kernel that is called is given the same input as
plain Python, tick by tick, and what both made is compared.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np

from benchmarks.command import Sensors
from benchmarks.study import IDEAL
from controller import GO2Controller
from controller.cli.common import ExitCode, ProgressLine
from controller.demo.steps import DemoProgress, StepResult, run_demo
from go2_wbc.compilation import Kernel, all_kernels, call_plain, load_kernels
from go2_wbc.plant import MujocoPlant

NEAR = 1e-9
"""Relative and absolute: libraries of sines differ in the last bit, and sums of their values."""


@dataclass(slots=True)
class Tally:
    """How often a kernel was called, how often not to the last bit, and the greatest difference."""

    calls: int = 0
    unequal: int = 0
    worst: float = 0.0


def copied(value: object) -> object:
    """A record that looks at a copy of its row, a copy of an array, or a number."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if not isinstance(row := getattr(value, "row", None), np.ndarray):
        return value
    if isinstance(getattr(type(value), "row", None), property):  # has its row made
        return SimpleNamespace(row=row.copy())
    copy = object.__new__(type(value))
    object.__setattr__(copy, "row", row.copy())
    return copy


def difference(ours: object, theirs: object) -> float:
    """The greatest difference of two arrays, records or numbers, of the greater of 1 and value."""
    if ours is None:
        return 0.0
    pair = (np.asarray(getattr(value, "row", value), dtype=float) for value in (ours, theirs))
    compiled, plain = (array.ravel() for array in pair)
    with np.errstate(invalid="ignore"):  # inf less inf
        apart = np.abs(compiled - plain) / np.maximum(1.0, np.abs(plain))
    is_same = (compiled == plain) | (np.isnan(compiled) & np.isnan(plain))
    return float(np.max(np.where(is_same, 0.0, apart), initial=0.0))


def compared(kernel: Kernel, tally: Tally) -> Callable[..., Any]:
    """What calls the kernel and then its Python on copies of what it was given."""
    compiled = type(kernel).__call__

    def call(self: Kernel, *arguments: object) -> object:
        copies = [copied(value) for value in arguments]
        made = compiled(self, *arguments)
        expected = call_plain(self, *copies)
        pairs = [*zip(arguments, copies, strict=True), (made, expected)]
        worst = max(difference(*pair) for pair in pairs)
        tally.calls, tally.unequal = tally.calls + 1, tally.unequal + (worst > 0.0)
        tally.worst = max(tally.worst, worst)
        return made

    return call


@contextmanager
def every_call_compared() -> Iterator[dict[str, Tally]]:
    """Until left, kernels that Python calls are run both ways; tallies by name."""
    load_kernels()
    kernels = {kernel.python.__name__: kernel for kernel in all_kernels()}
    before = {name: type(kernel).__call__ for name, kernel in kernels.items()}
    tallies = {name: Tally() for name in kernels}
    for name, kernel in kernels.items():
        type(kernel).__call__ = compared(kernel, tallies[name])
    try:
        yield tallies
    finally:
        for name, kernel in kernels.items():
            type(kernel).__call__ = before[name]


def run(
    *, sensors: Sensors = IDEAL, seconds: Annotated[float, "of robot time, %(default)g"] = 60.0
) -> int:
    """Run the demo, again and again, and hold every compiled call to its own Python.

    A row for each kernel; exit code 1 if one differs by more than 1e-9.

    Examples:
    python -m benchmarks plain                      the demo on ideal signals
    python -m benchmarks plain --sensors imu        on the robot's own sensors
    """
    progress = ProgressLine()

    def tell(step: DemoProgress) -> None:
        progress.update(step.index / step.count, step.label)

    plant = MujocoPlant(sensors=sensors)
    steps: list[StepResult] = []
    with every_call_compared() as tallies, GO2Controller(plant=plant) as go2:
        while go2.state.time < seconds:
            steps += run_demo(go2, tell).steps
        print(f"{go2.state.time:.1f} s of the robot's time")
    print(f"{'kernel':<28}{'calls':>9}{'unequal':>9}{'worst':>11}")
    for name, tally in sorted(tallies.items()):
        if tally.calls:
            print(f"{name:<28}{tally.calls:>9}{tally.unequal:>9}{tally.worst:>11.1e}")
    is_met = all(step.ok for step in steps) and all(
        tally.worst <= NEAR for tally in tallies.values()
    )
    return ExitCode.OK if is_met else ExitCode.FAILED
