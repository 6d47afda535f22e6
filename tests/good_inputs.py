"""Good values for what is public, beside which ``test_bad_inputs`` tries a bad one."""

import importlib
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np


@cache
def place() -> Path:
    return Path(tempfile.mkdtemp())


@cache
def thing(name: str) -> Any:  # noqa: ANN401
    """A good value, made once."""
    import go2_wbc
    import motions
    from controller import Outcome
    from go2_wbc.plant import MujocoPlant

    makers: dict[str, Callable[[], Any]] = {
        "model": go2_wbc.RobotModel,
        "plant": MujocoPlant,
        "state": lambda: thing("plant").read(),
        "snapshot": lambda: thing("model").snapshot(thing("state")),
        "plan": lambda: motions.compile_timeline(motions.load_motion("nod"), thing("model")),
        "reference": lambda: thing("plan").at(0.5),
        "gait": lambda: go2_wbc.GAITS["trot"],
        "timeline": lambda: motions.Timeline().body(z=-0.02, over=0.5).home(over=0.5),
        "go2": _walking,
        "checker": lambda: motions.FeasibilityChecker(thing("model")),
        "checked": lambda: thing("checker").evaluate("nod"),
        "report": lambda: thing("checked").report,
        "recording": lambda: thing("checked").recording(),
        "verdict": lambda: _verdict(),
        "relation": lambda: importlib.import_module("viz").Relation(
            ("a",), "b", False, (("c",),), np.zeros((1, 4)), np.zeros(1), np.zeros((2, 2))
        ),
        "steep": lambda: motions.Timeline().body(pitch=1.0, over=0.3).home(over=0.3),
        "command": lambda: go2_wbc.JointCommand.damping(2.0),
        "wbc": lambda: go2_wbc.WholeBodyController(thing("model")),
        "planner": lambda: go2_wbc.LocomotionPlanner(
            thing("model"), thing("gait"), go2_wbc.Config().locomotion
        ),
        "outcome": lambda: Outcome(True, "done"),
        "saved": lambda: thing("plant").save(),
        "motion": lambda: motions.find_motion("nod"),
    }
    return makers[name]()


def _walking() -> object:
    from controller import GO2Controller

    go2 = GO2Controller()
    go2.walk()
    return go2


def _verdict() -> object:
    from controller.report_view import verdict_of

    return verdict_of(thing("checker").check(thing("steep")))


def _trot() -> Path:
    return importlib.import_module("controller.policies").TROT


def _page() -> object:
    return place() / "a.html"


def _of(name: str) -> Callable[[], object]:
    return partial(thing, name)


OWNERS: dict[str, Callable[[], object]] = {
    "controller.GO2Controller.move": lambda: (thing("go2").move(), thing("go2"))[1],
    "motions.Timeline.down": lambda: thing("timeline").foot("FL", z=0.05, over=0.3),
    "motions.Timeline.joint": lambda: thing("timeline").leg(
        "FL", hip=0.0, thigh=0.9, calf=-1.9, over=0.3
    ),
}
"""What some methods need another object for."""
THINGS: dict[str, Callable[[], object]] = {
    "ContactSchedule": lambda: thing("gait").schedule(),
    "Gait": _of("gait"),
    "JointCommand": _of("command"),
    "MujocoPlant": _of("plant"),
    "Recording": _of("recording"),
    "RobotModel": _of("model"),
    "WholeBodyController": _of("wbc"),
    "LocomotionPlanner": _of("planner"),
    "GO2Controller": _of("go2"),
    "CompiledPlan": _of("plan"),
    "FeasibilityChecker": _of("checker"),
    "Timeline": _of("timeline"),
    "Motion": _of("motion"),
    "World": lambda: importlib.import_module("go2_wbc").World(),
    "Reference": _of("reference"),
    "SeenTerrain": lambda: importlib.import_module("controller.telemetry").SeenTerrain(
        importlib.import_module("go2_wbc.planning.height_map").HeightMap(), ""
    ),
}
MADE_INSIDE = {
    *("Beats", "Certificate", "CheckedMotion", "CompiledPlan", "FeasibilityReport", "Finding"),
    *("Motion", "Outcome", "Snapshot", "Suggestion", "WbcSolution", "MotionInfeasible"),
    *("QpInfeasible", "Go2WbcError", "of_row", "of", "from_decision", "replaced", "part_names"),
    *("HeightMap", "Sight", "Footsteps", "HeldFoot", "SeenTerrain", "SavedPhysics", "Telemetry"),
    *("OdometryCovariance", "Anchor", "BodyTarget", "of_feet", "of_deviations", "Rows", "Bounds"),
    *("Problem", "ResidualRow", "BuiltIn", "Curve", "PosturePlan", "Health", "PartFault"),
    *("RobotDescription", "RobotProfile", "MotorModel", "named", "Series", "Departure", "Source"),
    *("Explanation", "BindingLimit", "Gain", "Contradiction", "Demand", "Multipliers", "Limit"),
    *(
        "Key",
        "OwnEase",
        "BeatClock",
        "TimelineData",
        "Payload",
        "CertifiedRun",
        "CertifiedRate",
        "against",
        "steady",
        "CommandRanges",
        "Term",
    ),
}
"""Results, which nobody but the project makes; and what is made in every tick."""
EXEMPT = {
    *(f"motions.Timeline({name})" for name in ("keys", "cursor", "clock", "counted", "floor")),
    *(f"motions.Timeline({name})" for name in ("counted_from", "last_start", "shift_beats")),
    *("motions.Timeline.in_order", "motions.Timeline.body_value"),
}
"""What a timeline remembers of its making."""
EXEMPT |= {
    *(f"go2_wbc.{name}" for name in ("RobotState", "Reference", "JointReference", "JointCommand")),
    *(
        "go2_wbc.JointCommand.torque",
        "go2_wbc.JointCommand.asked",
        *(
            "go2_wbc.LocomotionPlanner.update(delay)",
            "go2_wbc.WholeBodyController.solve(relax)",
            "go2_wbc.Recording(robot)",
            "viz.Relation(stats)",
        ),
    ),
    *("motions.CompiledPlan.row_at", "motions.CompiledPlan.feedback_at"),
    *("go2_wbc.ContactSchedule.at", "go2_wbc.LocomotionPlanner.why_not_resting"),
    *("go2_wbc.LocomotionPlanner.follow_feet", "controller.Sidecar"),
}
"""What is made or asked in every tick is not checked there: what takes it refuses what is wrong."""
EXEMPT_HUGE = {"go2_wbc.VelocityCommand", "go2_wbc.BodyPose"}
"""Where it is followed a velocity is clipped, with a warning, and a pose is refused."""
LEGAL = {("go2-wbc new name", "nonsense")}  #: What is not wrong at all


def _value(value: object) -> Callable[[], object]:
    return lambda: value


WITH: dict[str, dict[str, object]] = {
    "motions.Timeline.body": {"z": -0.02},
    "motions.Timeline.foot": {"z": 0.05},
    "motions.Timeline.walk": {"x": 0.2},
}
"""What some need that could be left out."""
LIKE: dict[str, Callable[[], object]] = {
    "Recording": _of("recording"),
    "Relation": _of("relation"),
    "Verdict": _of("verdict"),
    "MarginCurve": lambda: thing("verdict").curves[0],
    "Annotation": lambda: thing("verdict").annotations[0],
}
"""What else a value has whose fields are tried one by one."""
GOOD: dict[str, Callable[[], object]] = {
    **{name: _of(name) for name in ("model", "snapshot", "state", "reference", "gait", "command")},
    **{name: _of(name) for name in ("plan", "timeline", "recording", "verdict", "checker")},
    **dict.fromkeys(("over", "x", "y", "z", "t", "factor", "duration", "angle"), _value(0.1)),
    **dict.fromkeys(("hip", "low", "kp", "kd", "distance", "seconds", "until"), _value(0.1)),
    **{"high": _value(1.0), "thigh": _value(0.8), "calf": _value(-1.5), "period": _value(0.5)},
    **{"duty": _value(0.6), "offsets": _value((0.0, 0.5, 0.5, 0.0)), "name": _value("nod")},
    **{"leg": _value("FL"), "joint": _value("hip"), "legs": _value(("FL", "RR")), "n": _value(1)},
    **{"motion": _value("nod"), "what": _value("nod"), "times": _value(2), "path": _page},
    "motions.Timeline.on_beats(times)": _value((0.5, 1.0)),
    "motions.Timeline.pose(name)": _value("low"),
    "motions.Timeline.look_at(x)": _value(1.0),
    **{
        "stance": _value("sit"),
        "points": _value([{"z": -0.02}, {"z": 0.0}]),
        "amplitude": _value(0.5),
    },
    "motions.Timeline.path(points)": _value([(0.2, 0.0)]),
    **{"beats_per_minute": _value(120.0), "others": _of("timeline"), "title": _value("a title")},
    **{
        "force": lambda: np.zeros(3),
        "q": lambda: np.array(thing("state").q),
        "world": _value(None),
    },
    **{"v": lambda: np.zeros(18), "a": lambda: np.zeros(18), "tau": lambda: np.zeros(12)},
    **{"q_des": lambda: np.zeros(12), "v_des": lambda: np.zeros(12), "side": _value("left")},
    **{"modes": lambda: np.ones((2, 4), dtype=bool), "kind": _value("dead motor")},
}
GOOD |= {
    "go2_wbc.JointCommand.asked(q)": lambda: np.zeros(12),
    "go2_wbc.JointCommand.asked(v)": lambda: np.zeros(12),
    "go2_wbc.LocomotionPlanner.update(command)": lambda: thing("go2").command,
    **{"seed": _value(3), "value": _value(0.5), "network": _value(lambda x: x[:12])},
    "sidecar": lambda: importlib.import_module("controller.policies").Policy.load(_trot()).sidecar,
    **dict.fromkeys(("go2_wbc.Gains(kp)", "go2_wbc.Gains(kd)"), _value((1.0, 1.0, 1.0))),
    "go2_wbc.JointFriction.by_part(dry)": _value((0.1, 0.1, 0.2)),
    "go2_wbc.ContactSchedule(times)": _value((0.0, 0.5)),
    "go2_wbc.ContactSchedule.at_times(times)": lambda: np.zeros(3),
    "go2_wbc.Recording.load(path)": lambda: thing("recording").save(place() / "a.npz"),
    "motions.save_motion(motion)": _of("timeline"),
    "motions.save_motion(path)": lambda: place() / "a.json",
    "motions.save_plan(path)": lambda: place() / "a.plan",
    "motions.compile_motion(motion)": _of("timeline"),
    "motions.load_plan(path)": lambda: importlib.import_module("motions").save_plan(
        thing("plan"), place() / "b.plan"
    ),
    "go2_wbc.MujocoPlant.restore(saved)": _of("saved"),
    "go2_wbc.LocomotionPlanner(config)": lambda: (
        importlib.import_module("go2_wbc").Config().locomotion
    ),
    "viz.export_relations(relations)": lambda: [thing("relation")],
    "viz.export_relations(path)": lambda: place() / "a.svg",
    "viz.export_html(shown)": _of("recording"),
    "viz.export_animation(shown)": _of("recording"),
    "viz.export_animation(path)": lambda: place() / "a.gif",
    "viz.export_filmstrip(path)": lambda: place() / "a.png",
    "viz.export_plot(path)": lambda: place() / "a.svg",
    "viz.export_distributions(path)": lambda: place() / "a.svg",
    "viz.export_distributions(numbers)": _value({"a": [1.0, 2.0]}),
    "viz.export_distributions(rates)": _value({"a": (0.5, 0.4, 0.6)}),
}
