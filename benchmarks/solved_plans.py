"""``python -m benchmarks solve``: solves the library's dynamic motions anew, into the package.

To be run whenever a dynamic motion of the library, the planner's limits or the robot change; a test
says so. Plans that no motion needs any more are removed.
"""

from collections.abc import Iterator

from controller.cli.common import ExitCode, ProgressLine
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline, find_motion, motion_names
from motions.authoring import Choice
from motions.dynamics.phases import PhaseProblem
from motions.dynamics.plan_audit import PlanLimits
from motions.dynamics.plan_cache import SHIPPED, problem_key, ship
from motions.language.keys import PhaseKey


def run() -> int:
    """Solve the library's dynamic motions anew and keep the plans in the package.

    Examples:
    python -m benchmarks solve
    """
    model = RobotModel()
    problems = shipped_problems(model)
    SHIPPED.mkdir(exist_ok=True)
    left_over = set(SHIPPED.glob("*.npz"))
    with ProgressLine() as progress:
        for number, problem in enumerate(problems.values()):
            progress.update(number / len(problems), "solving")
            left_over.discard(ship(problem, model, SHIPPED))
    for file in left_over:
        file.unlink()
    size = sum(file.stat().st_size for file in SHIPPED.glob("*.npz"))
    print(f"{len(problems)} plans in {SHIPPED}, {size / 1e3:.0f} kB")
    return ExitCode.OK


def shipped_problems(model: RobotModel) -> dict[str, PhaseProblem]:
    """The problems of all motions of the library, by their keys."""
    solved = (line for line in _timelines() if line.in_order(PhaseKey))
    asked = (span.asked for line in solved for span in compile_timeline(line, model).dynamic)
    problems = (one for one in asked if isinstance(one, PhaseProblem))
    return {problem_key(one, model, PlanLimits()): one for one in problems}


def _timelines() -> Iterator[Timeline]:
    """Every motion, with every word that its parameters know."""
    for name in motion_names():
        motion = find_motion(name)
        yield motion()
        for parameter in motion.parameters:
            if isinstance(parameter.valid, Choice):
                yield from (motion(**{parameter.name: word}) for word in parameter.valid.words)
