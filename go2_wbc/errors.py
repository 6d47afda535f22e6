"""Every exception of the project, in one tree.

    Go2WbcError
    ├── ConfigError             a configuration file or value is wrong
    ├── DescriptionError        robot files are missing, broken or do not match
    ├── ModelMismatch           a user's MJCF lacks something the controller needs
    ├── MissingDependency       an optional package is not installed; names the install line
    ├── CommandError            a command is not finite or not valid
    ├── ModeError               a call that the present mode does not allow
    ├── ClosedError             a call after close()
    ├── BridgeError             other middleware cannot be reached or used
    ├── StudioError             a motion's file cannot be edited as asked; it stays as it was
    ├── PolicyError             a learned policy, or its sidecar, cannot be used; says why
    ├── SweepError              a run over seeds cannot begin or go on; says what is kept
    ├── QpError
    │   ├── QpInfeasible        no solution satisfies the constraints; carries residuals
    │   └── SolverUnavailable   unknown or uninstalled QP solver; lists the valid ones
    ├── IkError                 an inverse-kinematics target was not reached
    ├── PlantError
    │   └── PlantTimeout        the plant stopped answering
    └── MotionError
        ├── TimelineError       an authored motion is written wrongly
        ├── DynamicMotionRefused  it jumps or stands on few feet, and nobody allowed that
        ├── MotionFileError     a saved motion or plan cannot be used; says why
        ├── MotionInfeasible    the motion breaks a limit; carries the findings
        ├── PlanNotFound        no dynamic motion does what was asked; says what binds, where
        └── StanceMismatch      the motion starts from another stance

A third-party exception is converted where the library is called (``raise ... from``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches


class Go2WbcError(Exception):
    """Base of every error that this project raises on purpose."""


class ConfigError(Go2WbcError):
    """A configuration file or value is wrong."""


class DescriptionError(Go2WbcError):
    """The robot's files are missing, broken, or do not describe a Go2."""


class ModelMismatch(Go2WbcError):
    """A user's MJCF lacks something that the controller needs."""


class MissingDependency(Go2WbcError):
    """An optional package is not installed; the message names the install line."""


class CommandError(Go2WbcError, ValueError):
    """A command is not finite or outside what is valid."""


class ModeError(Go2WbcError):
    """The present mode does not allow this call."""


class ClosedError(Go2WbcError):
    """The object was used after ``close()``."""


class BridgeError(Go2WbcError):
    """Other middleware cannot be reached or used; says why."""


class StudioError(Go2WbcError):
    """A motion's file cannot be edited as asked; it stays as it was."""


class PolicyError(Go2WbcError, ValueError):
    """A learned policy or its sidecar cannot be used, or has given what is not finite."""


class SweepError(Go2WbcError):
    """A run over seeds cannot begin or go on; says why, and that the finished rows are kept."""


class QpError(Go2WbcError):
    """The whole-body QP could not be solved."""


@dataclass(frozen=True, slots=True)
class ResidualRow:
    """One line of a residual table: what was asked, how far the best answer is from it."""

    name: str
    norm: float
    unit: str


class QpInfeasible(QpError):
    """No solution satisfies the constraints of the QP.

    Attributes:
        solver: name of the solver that gave up.
        residuals: one row per task and constraint at the best point without the constraints.
    """

    def __init__(self, solver: str, status: str, residuals: Sequence[ResidualRow] = ()) -> None:
        self.solver = solver
        self.status = status
        self.residuals = tuple(residuals)
        lines = [f"{solver} found no solution of the whole-body QP ({status})"]
        lines += [f"  {row.name:<24} {row.norm:12.4g} {row.unit}" for row in self.residuals]
        super().__init__("\n".join(lines))


class SolverUnavailable(QpError):
    """The QP solver asked for is unknown or not installed."""


class IkError(Go2WbcError):
    """An inverse-kinematics target was not reached.

    Attributes:
        residuals: how far each target is missed.
    """

    def __init__(self, message: str, residuals: Sequence[ResidualRow] = ()) -> None:
        self.residuals = tuple(residuals)
        super().__init__(message)


class PlantError(Go2WbcError):
    """The robot or simulator failed."""


class PlantTimeout(PlantError):
    """The plant stopped answering."""


class MotionError(Go2WbcError):
    """A motion cannot be played."""


class TimelineError(MotionError, ValueError):
    """An authored motion is written wrongly; the message says what and how to write it."""


class DynamicMotionRefused(MotionError):
    """A motion with flight or few feet was asked of hardware without being allowed."""


class MotionFileError(MotionError, ValueError):
    """A saved motion or plan is damaged, of another version or robot, or cannot be a file."""


class MotionInfeasible(MotionError):
    """The motion breaks a limit; ``findings`` says which, where and when."""

    def __init__(self, name: str, findings: Sequence[object]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n  ".join([f"motion {name!r} is infeasible:", *map(str, findings)]))


class PlanNotFound(MotionError):
    """No dynamic motion was found that does what was asked; says what binds, and where.

    Attributes:
        reasons: one line for each thing that is in the way.
    """

    def __init__(self, message: str, reasons: Sequence[str] = ()) -> None:
        self.reasons = tuple(reasons)
        super().__init__("\n  ".join([message, *self.reasons]))


class StanceMismatch(MotionError):
    """The motion starts from another stance than the robot is in."""


def unknown_name(kind: str, name: str, valid: Iterable[str]) -> str:
    """Message for a name that does not exist, with all that do, and the nearest."""
    names = sorted(valid)
    nearest = _nearest(str(name), names)
    hint = f"; did you mean {nearest!r}?" if nearest else ""
    return f"unknown {kind} {name!r}; valid: {', '.join(names)}{hint}"


def _nearest(name: str, names: Sequence[str]) -> str | None:
    """The name that is meant, whatever its case: with the same letters (LF is FL), or close."""
    by_letters = {"".join(sorted(each.lower())): each for each in reversed(names)}
    if same := by_letters.get("".join(sorted(name.lower()))):
        return same
    folded = {each.lower(): each for each in reversed(names)}
    close = get_close_matches(name.lower(), list(folded), 1)
    return folded[close[0]] if close else None


EXTRAS: Mapping[str, str] = {
    "dynamics": "jumps, hops, rears: trajectory optimisation",
    "music": "the beats of a song: dance",
    "sweep": "sweeps as Parquet files",
    "cluster": "sweeps on many machines",
    "policies": "learned policies: walk(policy=...), in ONNX files",
    "gamepad": "a gamepad for teleop",
    "learning": "Gymnasium's environments, data sets",
    "mcap": "recordings as MCAP files, for Foxglove",
    "rerun": "recordings as rrd files, for Rerun (490 MB)",
    "video": "films as MP4 files",
    "examples": "what some examples show their point with",
    "notebooks": "the notebooks: jupyter lab",
    "unitree": "Unitree's protocol: unitree-sim, unitree-drive",
}
"""What a user may want beside ROS 2, by the name of the extra."""


def install_line(extra: str, python: str = "python") -> str:
    """The command that adds an extra to the installed project, wherever it came from."""
    return f'{python} -m pip install "go2-wbc[{extra}]"'


@contextmanager
def needing(extra: str, told: str) -> Iterator[None]:
    """While what an ``extra`` brings is imported.

    Raises:
        MissingDependency: if it cannot be; with what is ``told``, why, and the line that adds it.
    """
    try:
        yield
    except ImportError as error:
        raise MissingDependency(f"{told} ({error}): {install_line(extra)}") from error
