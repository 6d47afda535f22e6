"""What can be ordered by name, and as a motion; both end in jobs of the desk. No ROS here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from controller.bridges.ros2.desk import Answer, Desk, Job, Reply
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.reference import MotionPlan, Posture
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, compile_timeline, load_motion, motion_names
from motions.authoring import Value

HIGH_FIVE = "high_five"
STOP, DAMP = "stop", "damp"
ORDERS: Mapping[str, Callable[[GO2Controller], bool]] = {
    "sit": lambda go2: go2.sit(),
    "up": lambda go2: go2.stand(),
    "walk": lambda go2: go2.walk(),
    "stand": lambda go2: go2.stand(),
    "lie_down": lambda go2: go2.lie_down(),
    HIGH_FIVE: lambda go2: go2.high_five(),
    "recover": lambda go2: go2.recover(),
}
"""What happens for a name; ``up`` and ``stand`` are the same."""
COMMANDS = (*ORDERS, STOP, DAMP)
"""All names, the seeds' own three first."""


def order(desk: Desk, command: str, reply: Reply) -> None:
    """Carry out ``command`` (any case); ``reply`` is called once, when it has happened."""
    name = command.strip().lower()
    if name == DAMP:
        reply(desk.damp())
    elif name == STOP:
        _stop(desk, reply)
    elif name in ORDERS:
        act = ORDERS[name]
        refusal = desk.submit(Job(name, lambda go2, _job: act(go2), reply))
        if refusal:
            reply(Answer(False, refusal))
    else:
        reply(Answer(False, unknown_name("command", command, COMMANDS)))


def _stop(desk: Desk, reply: Reply) -> None:
    if desk.cancel(STOP, reply):
        return
    refusal = desk.submit(Job(STOP, lambda go2, _job: _come_to_rest(go2), reply))
    if refusal:
        reply(Answer(False, refusal))


def _come_to_rest(go2: GO2Controller) -> bool:
    if go2.mode is not Mode.WALKING:
        return True
    go2.stop()
    return go2.last_outcome.ok


def motion_job(motion: str, settings: Sequence[str], reply: Reply) -> Job:
    """The job that goes to where a motion starts and plays it."""
    plans: list[MotionPlan] = []

    def prepare() -> None:
        values = parse_settings(settings)
        timeline, model = load_motion(motion, **values), RobotModel()
        plan = compile_timeline(timeline, model)
        FeasibilityChecker(model).check(plan).raise_if_infeasible()
        plans.append(plan)

    def act(go2: GO2Controller, job: Job) -> bool:
        values = parse_settings(settings)
        if motion == HIGH_FIVE and values.keys() <= {"side", "hold"}:
            job.phase = "playing"
            return go2.high_five(str(values.get("side", "right")), float(values.get("hold", 2.0)))
        (plan,) = plans
        if not _take_entry(go2, plan) or job.is_cancelled:
            return False
        job.phase = "playing"
        return go2.play(plan, check=False)

    return Job(motion, act, reply, prepare)


def _take_entry(go2: GO2Controller, plan: MotionPlan) -> bool:
    if plan.entry is Posture.STAND:
        return go2.mode in (Mode.STANDING, Mode.WALKING) or go2.stand()
    if plan.entry is Posture.SIT:
        return go2.sit()
    return go2.lie_down()


def check_motion_name(motion: str) -> None:
    """Raise CommandError for a motion that the library does not have; lists those it has."""
    if motion not in motion_names():
        raise CommandError(unknown_name("motion", motion, motion_names()))


def parse_settings(settings: Sequence[str]) -> dict[str, Value]:
    """``["hold=2.0", "side=left"]`` as values.

    Raises:
        CommandError: for one that is not NAME=VALUE.
    """
    return dict(_setting(text) for text in settings)


def _setting(text: str) -> tuple[str, Value]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise CommandError(f"a setting must be name=value, got {text!r}")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value
