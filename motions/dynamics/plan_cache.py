"""Dynamic plans are solved once: kept on disk by a hash of everything that they depend on.

So is, that none was found.
"""

from __future__ import annotations

import hashlib
import json
import logging
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from go2_wbc.errors import ConfigError, MotionError, PlanNotFound
from go2_wbc.files import write_atomically
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory
from motions.dynamics.phases import PhaseProblem, Progress, Tolerance
from motions.dynamics.plan_audit import PlanLimits
from motions.dynamics.solver import PlanTarget, accept, nearest, solve

_log = logging.getLogger(__name__)
_PACKAGES = ("crocoddyl", "pin")
SHIPPED = Path(__file__).parent / "solved"
"""Plans that come with the package, by ``problem_key``: whatever solved them, each is judged when
it is read."""


def solve_cached(
    problem: PhaseProblem,
    model: RobotModel,
    *,
    progress: Progress | None = None,
    limits: PlanLimits | None = None,
    folder: Path | None = None,
) -> DynamicTrajectory:
    """What ``solve`` finds, read from disk if it was found before, or comes with the package.

    A damaged file is solved and written anew; where nothing can be written, that is logged and the
    plan returned all the same. What is read is judged like what is solved.

    Args:
        problem, model, progress, limits: see ``solve``.
        folder: where plans are kept; by default beside the compiled kernels, see
            ``CACHE_VARIABLE``.

    Raises:
        MissingDependency: if it must be solved and crocoddyl is not installed.
        PlanNotFound: if there is no such plan.
    """
    limits = limits or PlanLimits()
    path = (folder or plan_folder()) / f"{_key(problem, model, limits)}.npz"
    known = (SHIPPED / f"{problem_key(problem, model, limits)}.npz", path)
    found = partial(solve, problem, model, progress=progress, limits=limits)
    return _kept(known, problem.tolerance, model, found)


def nearest_cached(
    written: PlanTarget,
    model: RobotModel,
    *,
    tolerance: Tolerance,
    progress: Progress | None = None,
) -> DynamicTrajectory:
    """What ``nearest`` finds, read from disk if it was found before; see ``solve_cached``.

    Raises:
        MissingDependency: if it must be solved and crocoddyl is not installed.
        PlanNotFound: if there is no such plan within the tolerance.
    """
    arrays = (written.times, written.q, written.stance, *_numbers(model))
    key = _hash((astuple(PlanLimits()), _versions()), arrays)
    found = partial(nearest, written, model, tolerance=tolerance, progress=progress)
    return _kept((plan_folder() / f"{key}.npz",), tolerance, model, found)


def _kept(
    files: tuple[Path, ...],
    tolerance: Tolerance,
    model: RobotModel,
    solved: Callable[[], DynamicTrajectory],
) -> DynamicTrajectory:
    """The plan of the first of ``files`` that has one, judged; or a new one, put into the last.

    That there is none within the tolerance is kept beside it.
    """
    for file in files:
        if (plan := _read(file)) is not None:
            accept(plan, tolerance, model)
            return plan
    failure = files[-1].with_name(f"{files[-1].stem}-{_hash(astuple(tolerance))[:8]}.json")
    if (known := _read_failure(failure)) is not None:
        raise known
    try:
        plan = solved()
    except PlanNotFound as error:
        message, *_ = str(error).split("\n")
        _write(failure, json.dumps([message, error.reasons]).encode())
        raise
    _write(files[-1], plan.to_bytes())
    return plan


def _read_failure(path: Path) -> PlanNotFound | None:
    try:
        message, reasons = json.loads(path.read_text(encoding="utf-8"))
        return PlanNotFound(str(message), tuple(map(str, reasons)))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError) as error:
        _log.warning("%s is of no use: its plan is looked for anew (%s)", path, error)
        return None


def plan_folder() -> Path:
    """Where solved plans are kept."""
    from go2_wbc.machine_code import cache_root

    return cache_root() / "plans"


def ship(problem: PhaseProblem, model: RobotModel, folder: Path) -> Path:
    """Solve ``problem`` and write the plan into ``folder``; the file.

    Raises:
        MissingDependency: if crocoddyl is not installed.
        PlanNotFound: if there is no such plan.
        ConfigError: if the folder cannot be written.
    """
    limits = PlanLimits()
    found = solve(problem, model, limits=limits)
    path = folder / f"{problem_key(problem, model, limits)}.npz"
    return write_atomically(path, found.to_bytes(is_small=True))


def keep(problem: PhaseProblem, model: RobotModel, plan: DynamicTrajectory) -> None:
    """Keep ``plan``, found in another way, as what ``solve_cached`` answers to ``problem``."""
    _write(plan_folder() / f"{_key(problem, model, PlanLimits())}.npz", plan.to_bytes())


def _read(path: Path) -> DynamicTrajectory | None:
    try:
        return DynamicTrajectory.from_bytes(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, MotionError) as error:
        _log.warning("the plan in %s is of no use and will be solved anew (%s)", path, error)
        return None


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
        write_atomically(path, content)
    except (OSError, ConfigError) as error:
        _log.warning("the dynamic plan cannot be kept in %s: %s", path.parent, error)


def _key(problem: PhaseProblem, model: RobotModel, limits: PlanLimits) -> str:
    """A hash of all that the plan depends on."""
    return _hash((problem_key(problem, model, limits), _versions()))


def _hash(words: object, arrays: Iterable[np.ndarray] = ()) -> str:
    digest = hashlib.sha256(repr(words).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array, float).tobytes())
    return digest.hexdigest()[:32]


def problem_key(problem: PhaseProblem, model: RobotModel, limits: PlanLimits) -> str:
    """A hash of what is asked, of which robot; any plan that keeps the limits answers it.

    The tolerance only says whether a plan is accepted.
    """
    digest = hashlib.sha256()
    for phase in problem.phases:
        feet = sorted((int(leg), place) for leg, place in phase.feet.items())
        stance = sorted(map(int, phase.stance))
        digest.update(repr((phase.duration, stance, phase.body, feet, phase.label)).encode())
    for state in (problem.initial, problem.final):
        digest.update(b"rest" if state is None else state.q.tobytes() + state.v.tobytes())
    digest.update(repr(astuple(limits)).encode())
    for array in _numbers(model):
        digest.update(np.ascontiguousarray(array, float).tobytes())
    return digest.hexdigest()[:32]


def _numbers(model: RobotModel) -> Iterator[np.ndarray]:
    """Everything of the robot that a plan depends on."""
    pin_model = model.pin_model
    for inertia in pin_model.inertias:
        yield inertia.toDynamicParameters()
    for placement in (*pin_model.jointPlacements, *(f.placement for f in pin_model.frames)):
        yield placement.homogeneous
    motor = model.motor
    yield from (pin_model.armature, pin_model.gravity.linear, model.q_lower, model.q_upper)
    yield from (model.speed_limits, motor.peak, motor.knee_speed, motor.no_load_speed)
    yield np.array([model.foot_radius])


@cache
def _versions() -> tuple[str, ...]:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest(), *map(_version, _PACKAGES)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
