"""What a user of the public names writes, as strict type checkers read it; nothing here is run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np

import controller
import go2_wbc
import motions
import viz
from controller import Certificate, GO2Controller, Mode, Outcome, certify, sweep
from go2_wbc import (
    GAITS,
    LEGS,
    Config,
    ContactSchedule,
    Explanation,
    Gait,
    Go2WbcError,
    JointCommand,
    JointReference,
    Leg,
    LocomotionPlanner,
    MotionInfeasible,
    MotionPlan,
    MujocoPlant,
    Plant,
    Posture,
    QpInfeasible,
    Recording,
    Reference,
    RobotModel,
    RobotState,
    Snapshot,
    Stance,
    Task,
    VelocityCommand,
    WbcConfig,
    WbcSolution,
    WholeBodyController,
    World,
    load_config,
)
from go2_wbc.plant.mujoco.lidar import LidarConfig
from go2_wbc.plant.terrain import Blocks, Course, Stairs
from go2_wbc.wbc.problem import SIZE, Rows
from motions import (
    Beats,
    CheckedMotion,
    Choice,
    CompiledPlan,
    FeasibilityChecker,
    FeasibilityReport,
    Finding,
    Motion,
    Playable,
    Range,
    Suggestion,
    Timeline,
    Tolerance,
    beats,
    check,
    compile_motion,
    compile_timeline,
    deg,
    find_motion,
    load_file,
    load_motion,
    load_plan,
    motion,
    motion_names,
    save_motion,
    save_plan,
    suggest,
)
from viz import (
    ANIMATION_SUFFIXES,
    HTML_SUFFIXES,
    PLOT_SUFFIXES,
    Annotation,
    MarginCurve,
    Relation,
    ReplayContent,
    Verdict,
    export_animation,
    export_distributions,
    export_filmstrip,
    export_html,
    export_plot,
    export_relations,
    margin_figure,
)


@motion
def greet(
    taps: Annotated[int, Range(1, 5)] = 2, side: Annotated[str, Choice("left", "right")] = "right"
) -> Timeline:
    """Bow, then tap the ground."""
    line = Timeline(tolerance=Tolerance()).body(pitch=deg(15), z=-0.04, over=0.8).home(over=0.8)
    for _ in range(taps):
        line = line.foot("FR" if side == "right" else "FL", z=0.06, over=0.4).down("FR", over=0.3)
    return line.body_path([{"z": -0.02}, {"z": 0.0}], over=1.0).lift(["FL", "RR"])


def drive() -> list[str]:
    """Everything that the robot can be asked."""
    config = Config(wbc=WbcConfig(friction=0.5))
    ground = Course((Stairs(count=3, way="both"), Blocks(height=0.04)))
    plant: Plant = MujocoPlant(terrain=ground, lidar=LidarConfig(rays=200), sensors="imu")
    said = list[str]()
    with GO2Controller(plant=plant, config=config) as go2:
        done: bool = go2.take_over() or go2.stand()
        done = done and go2.walk("trot") and go2.turn_left(deg(90))
        go2.move(linear_x=0.3, angular_z=0.1)
        go2.stop()
        done = done and go2.move_forward(0.5) and go2.high_five("left") and go2.sit()
        mode: Mode = go2.mode
        outcome: Outcome = go2.last_outcome
        state: RobotState = go2.state
        command: VelocityCommand = go2.command
        recording: Recording = go2.recording()
        said += [mode.value, outcome.reason, f"{state.time:.1f}", str(command), str(done)]
        said.append(str(recording.duration + float(recording.tau.max())))
        said += [str(fault) for fault in go2.health.faults]
        said.append(f"{go2.terrain.height(1.0, 0.0):.2f} m" if go2.terrain else "blind")
        try:
            go2.play(greet(taps=3))
        except MotionInfeasible as error:
            said += [str(failure) for failure in error.findings]
        except QpInfeasible as error:
            said.append(str(error))
        except Go2WbcError as error:
            said.append(f"{type(error).__name__}: {error}")
    return said


def design(song: Path) -> Timeline:
    """A motion, its check and its files."""
    report: FeasibilityReport = check(greet, friction=0.6)
    findings: list[Finding] = [*report.failures, *report.warnings]
    suggestions: tuple[Suggestion, ...] = suggest(greet())
    checker = FeasibilityChecker()
    checked: CheckedMotion = checker.evaluate("wave")
    plan: CompiledPlan = compile_timeline(greet(), checker.model)
    same: MotionPlan = compile_motion("wave", checker.model)
    playable: Playable = plan
    found: Motion = find_motion("wave")
    own: Motion = load_file(Path("greet.py"))["greet"]
    rhythm: Beats = beats(song)
    line: Timeline = load_motion("wave").then(greet()).repeat(2).mirror()
    save_plan(plan, Path("greet.plan"))
    save_motion(line, Path("greet.json"))
    stored = load_plan(Path("greet.plan"))
    print(findings, suggestions, checked, same, playable, found, own, rhythm.times, stored)
    print(motion_names(), Posture.STAND is Stance.STAND, World(friction=0.4))
    return line


class Load(Task):
    """A task of one's own."""

    weight = 1e-2
    name = "load"
    unit = "N"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """One row."""
        del snapshot, reference
        return Rows(np.ones((1, SIZE)), np.zeros(1))


def engine(plan: MotionPlan) -> JointCommand:
    """One tick by hand."""
    model = RobotModel()
    plant = MujocoPlant()
    snapshot: Snapshot = model.snapshot(plant.read())
    reference: Reference = plan.at(0.5)
    gait: Gait = GAITS["trot"]
    leg: Leg = LEGS[0]
    schedule: type[ContactSchedule] = ContactSchedule
    planner: type[LocomotionPlanner] = LocomotionPlanner
    config = load_config("go2.toml").wbc
    wbc = WholeBodyController(model, config=config, extra_tasks=[Load()])
    solution: WbcSolution = wbc.solve(snapshot, reference)
    why: Explanation = solution.explain()
    print([limit.multiplier for limit in why.binding], why)
    print(gait.period, leg.name, schedule, planner, JointReference, np.abs(solution.tau).max())
    return JointCommand.torque(np.zeros(12))


def show(recording: Recording) -> None:
    """Pages, films and plots."""
    verdict = Verdict(ok=True, text="done", annotations=(), curves=(), coarse="")
    content = ReplayContent(recording, verdict=verdict, proposal=None)
    kinds: list[type] = [Annotation, MarginCurve, Relation]
    export_html(content, Path(f"page{HTML_SUFFIXES[0]}"), title="A page")
    export_animation(content, Path(f"film{ANIMATION_SUFFIXES[0]}"))
    export_filmstrip(recording, Path("strip.png"))
    print(kinds, PLOT_SUFFIXES, export_plot, export_distributions, margin_figure)
    print(export_relations)


def many() -> Certificate:
    """Experiments."""
    result = sweep("wave", n=20)
    print(
        len(result.rows), controller.__name__, go2_wbc.__version__, motions.__name__, viz.__name__
    )
    return certify("wave", n=40)
