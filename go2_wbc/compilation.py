"""Functions that are compiled: plain Python with annotations.

A ``subroutine`` is called by compiled code, a ``kernel`` by Python as well. Numba's signature
is made from the annotations:

    @subroutine
    def ground_at(g: Ground, x: float, y: float) -> float: ...

    @kernel
    def plan(now: Snapshot, s: Planner, c: Walk, target: Target) -> None: ...

An argument may be a number, a flag, an array, a triple, or a record (``records``). Python passes
records to a kernel, which is entered with their rows: this costs 0.2 us per call. A subroutine that
is called from Python runs as plain Python. With ``GO2_WBC_PLAIN=1`` in the environment kernels do,
too: a debugger steps from the planner into a foothold.

Numba compiles a kernel for this processor when it is first called, or by ``load_kernels``, about 20
s for all, announced by one line of the log; see ``machine_code``, which keeps it between runs. No
fast-math flag is set: the bits of a result depend on the inputs only.
"""

from __future__ import annotations

import os
import subprocess
import sys
import typing
from collections.abc import Callable, Sequence
from functools import cached_property
from importlib import import_module
from typing import Any, TypeVar, cast, overload

import numpy as np

from go2_wbc.records import Record
from go2_wbc.written import Foreign, Written

__all__ = [
    "Foreign",
    "Kernel",
    "Routine",
    "all_kernels",
    "call_plain",
    "kernel",
    "load_kernels",
    "plain",
    "subroutine",
]

F = TypeVar("F", bound=Callable[..., Any])

PLAIN_VARIABLE = "GO2_WBC_PLAIN"
"""Environment variable; 1 runs every kernel as the Python that it is written in."""
_IS_PLAIN = os.environ.get(PLAIN_VARIABLE, "0") not in ("", "0")
MODULES = (
    "go2_wbc.algebra.active_set",
    "go2_wbc.planning.height_map",
    "go2_wbc.planning.locomotion",
    "go2_wbc.planning.rest",
    "go2_wbc.plant.mujoco.forces",
    "go2_wbc.plant.sensors",
    "go2_wbc.reference",
    "go2_wbc.robot.estimator",
    "go2_wbc.robot.latency",
    "go2_wbc.robot.leg_kinematics",
    "go2_wbc.robot.motor",
    "go2_wbc.robot.motor_watch",
    "go2_wbc.robot.payload_estimation",
    "go2_wbc.robot.rigid_body",
    "go2_wbc.robot.rotations",
    "go2_wbc.robot.safety",
    "go2_wbc.robot.sensor_watch",
    "go2_wbc.tracking.plan_curves",
    "go2_wbc.tracking.plan_tracking",
    "go2_wbc.wbc.condensed",
    "go2_wbc.wbc.constraints",
    "go2_wbc.wbc.tasks",
    "go2_wbc.wbc.trajectory_loads",
)
"""Modules that hold kernels."""
_PROBED = 8  #: Of so many kernels one is looked for, to see whether many are missing


class Routine(Written):
    """A function that Numba is told of when code that calls it is compiled."""

    @property
    def signature(self) -> Any:
        """As Numba has it."""
        if self._signature is None:
            from go2_wbc.machine_code import signature_of  # numba; only who compiles waits for it

            self._signature = signature_of(self)
        return self._signature

    _signature: Any = None

    @cached_property
    def _numba_type_(self) -> Any:
        """What Numba asks a global variable for, once it compiles code that names it."""
        from go2_wbc.machine_code import as_callee

        return as_callee(self)


class Kernel(Routine):
    """A function that Python enters by its machine code.

    Each is of a class of its own, whose ``__call__`` is made of the function's parameters.
    """

    def load(self) -> None:
        """Load or compile it now, if that has not been done."""
        if not _IS_PLAIN:
            _ = self.compiled

    @cached_property
    def compiled(self) -> Callable[..., Any]:
        """The machine code, loaded or compiled now; it takes rows in the place of records."""
        from go2_wbc.machine_code import entered

        code, takes_rows = entered(self)
        pairs = zip(self.parameters, takes_rows, strict=True)
        given = ", ".join(f"{name}.row" if is_row else name for name, is_row in pairs)
        space: dict[str, Any] = {"_compiled": code}
        call = f"def call(_self, {', '.join(self.parameters)}):\n    return _compiled({given})"
        exec(call, space)
        type(self).__call__ = space["call"]
        return code


def subroutine(function: F) -> F:
    """A function that compiled code calls, part of the machine code of each kernel that does."""
    return cast(F, Routine(function))


@overload
def kernel(function: F, /) -> F: ...
@overload
def kernel(*, nogil: bool) -> Callable[[F], F]: ...
def kernel(function: Any = None, /, *, nogil: bool = False) -> Any:
    """A function that Python calls, compiled.

    With ``nogil`` other threads run meanwhile: for one that works long enough to delay a control
    loop, on arrays that no other thread changes.
    """
    if function is None:
        return lambda written: _made(written, nogil=nogil)
    return _made(function, nogil=False)


def _made(function: Callable[..., Any], *, nogil: bool) -> Kernel:
    written = function.python if isinstance(function, Routine) else function
    call = call_plain if _IS_PLAIN else _first_call
    return type(function.__name__, (Kernel,), {"__call__": call})(written, nogil=nogil)


def _first_call(self: Kernel, *arguments: Any) -> Any:
    self.load()
    return self(*arguments)


def plain(function: F) -> F:
    """The Python in which a kernel or a subroutine is written."""
    return cast(F, cast(Routine, function).python)


def call_plain(self: Kernel, *arguments: Any) -> Any:
    """The Python: a record where there is only a row, numbers that divide by 0 as compiled ones."""
    hints = typing.get_type_hints(self.written).values()
    given = [_as_compiled(value, hint) for value, hint in zip(arguments, hints, strict=False)]
    with np.errstate(all="ignore"):
        return self.python(*given)


def _as_compiled(value: Any, hint: Any) -> Any:
    if isinstance(hint, type) and issubclass(hint, Record):
        return value if isinstance(value, hint) else hint.of(value.row)
    return np.float64(value) if hint is float else value


def all_kernels() -> list[Kernel]:
    """Every kernel there is, none of them loaded."""
    return [
        value
        for module in map(import_module, MODULES)
        for value in vars(module).values()
        if isinstance(value, Kernel) and value.written.__module__ == module.__name__
    ]


def load_kernels(*, backwards: bool = False) -> None:
    """Compile every kernel, or load it: half a second, or about 30 s the first time.

    Before a robot is taken over: a loop must not wait for a compiler. Where many are missing,
    another process helps, from the end of the list: each finds what the other has kept.
    """
    kernels = all_kernels()
    helper = None if backwards or _IS_PLAIN else _helper(kernels)
    for made in reversed(kernels) if backwards else kernels:
        made.load()
    if helper is not None:
        helper.kill()
        helper.wait()


def _helper(kernels: Sequence[Kernel]) -> subprocess.Popen[bytes] | None:
    """A process that compiles the last ones first, where that is worth it."""
    from go2_wbc.machine_code import KeptCode

    if (os.cpu_count() or 1) < 2 or all(KeptCode(made).is_there() for made in kernels[::_PROBED]):
        return None
    script = "from go2_wbc.compilation import load_kernels; load_kernels(backwards=True)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-c", script]
    return subprocess.Popen(command, env=environment, stdin=quiet, stdout=quiet, stderr=quiet)
