"""A short drive through the low-level interface: stand, trot, high five, lie down; measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import fmean
from typing import Final

from controller.bridges.unitree.plant import UnitreePlant
from controller.go2_controller import GO2Controller
from go2_wbc.config import Config
from go2_wbc.errors import CommandError, Go2WbcError, unknown_name
from go2_wbc.validation import FINITE, POSITIVE, ranged
from motions import FeasibilityChecker
from motions.saved.files import is_saved

SETTLE: Final = 1.5  #: Time [s] of a trot before its speed is measured
SAMPLE: Final = 0.02  #: Time [s] between two samples of the speed
REST: Final = 0.5  #: Time [s] of standing still after a trot


@dataclass(frozen=True, slots=True)
@ranged(speed=FINITE, seconds=POSITIVE)
class Trot:
    """How a trot is driven: speed [m/s], and time [s] at that speed."""

    speed: float = 0.5
    seconds: float = 4.0


@dataclass(frozen=True, slots=True)
class Step:
    """One thing that was asked for, whether it was done, and why not."""

    name: str
    ok: bool
    reason: str
    speed_error: float | None = None


def check_steps(names: list[str]) -> None:
    """Read and check what is to be driven, before the robot is asked for anything.

    Raises:
        CommandError: for an unknown step; lists the valid ones.
        MotionFileError: for a saved motion that cannot be used.
        MotionInfeasible: for one that the robot cannot do; carries the findings.
    """
    for name in names:
        if is_saved(name):
            FeasibilityChecker().plan(name)
        elif name not in STEPS:
            raise CommandError(unknown_name("step", name, (*STEPS, "FILE.json", "FILE.plan")))


def drive(
    plant: UnitreePlant, names: list[str], trot: Trot, config: Config | None = None
) -> Iterator[Step]:
    """Do the steps one after the other; ends with the first that is not done, the robot limp."""
    with GO2Controller(plant=plant, realtime=True, config=config) as go2:
        for name in names:
            step = _do(go2, name, trot)
            yield step
            if not step.ok:
                return


def _do(go2: GO2Controller, name: str, trot: Trot) -> Step:
    try:
        ok = go2.play(name) if is_saved(name) else STEPS[name](go2)
        error = _trot(go2, trot) if ok and name == "trot" else None
    except Go2WbcError as failure:
        return Step(name, False, str(failure))
    return Step(name, ok, go2.last_outcome.reason, error)


def _trot(go2: GO2Controller, trot: Trot) -> float:
    """Mean absolute error [m/s] of the estimated forward speed."""
    go2.move(trot.speed)
    go2.wait(SETTLE)
    errors = []
    for _ in range(max(1, round(trot.seconds / SAMPLE))):
        go2.wait(SAMPLE)
        errors.append(abs(float(go2.state.v[0]) - trot.speed))
    go2.stop()
    go2.wait(REST)
    return fmean(errors)


STEPS: Final[dict[str, Callable[[GO2Controller], bool]]] = {
    "stand": GO2Controller.stand,
    "sit": GO2Controller.sit,
    "trot": GO2Controller.walk,
    "high_five": GO2Controller.high_five,
    "lie_down": GO2Controller.lie_down,
}
"""What can be driven, by name."""
