"""A checked motion, and a run of it, as what ``viz`` shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from go2_wbc.brief import counted
from go2_wbc.errors import PlantError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.recording import Recording, true_runs
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from motions import CheckedMotion, CompiledPlan, FeasibilityReport, Finding
from motions.authoring import Choice, Parameter
from motions.dynamics.solver import PlanTarget
from motions.feasibility import Series
from motions.plan.trajectory import as_written
from viz.content import CENTRE_OF_MASS, Annotation, MarginCurve, ReplayContent, Slider, Verdict

AFTERWARDS = "afterwards"  #: Label of what is shown of a run after its motion
_AFTERWARDS = 1.0  #: How long [s] a run is shown after the end of its motion
_TOGETHER = 0.05  #: Annotations on one limit that are this close in time [s] become one
_LEAST_SAMPLES = 2
_MOST_MARGINS = 1500  #: Samples of a margin curve: more than a chart has pixels
_MOVED, _TURNED = 0.02, np.radians(2.0)
"""A motion that ends farther from its start, [m] and [rad], moves on."""


def planned(checked: CheckedMotion) -> ReplayContent:
    """The plan with its verdict."""
    plan, shown = checked.plan, checked.recording()
    verdict, written = verdict_of(checked.report), _as_written(checked)
    return _shown(plan, ReplayContent(shown, is_plan=True, verdict=verdict, written=written))


def performed(checked: CheckedMotion, run: Recording, model: RobotModel) -> ReplayContent:
    """A run of the motion with the verdict on its plan, the plan, and what was written instead.

    Args:
        checked: of the motion that was played.
        run: holds samples that are labelled with the motion's name, from standing on four feet.
        model: of the robot that ran.

    Raises:
        PlantError: if the motion is not in the run.
    """
    own = _in_motion_frame(_part(run, checked.plan.name), model)
    plan = checked.recording()
    labels = (*plan.labels, AFTERWARDS)
    own = replace(own, labels=tuple(labels[row] for row in np.searchsorted(plan.time, own.time)))
    verdict, written = verdict_of(checked.report), _as_written(checked)
    return _shown(checked.plan, ReplayContent(own, verdict=verdict, ghost=plan, written=written))


def _as_written(checked: CheckedMotion) -> Recording | None:
    """The movement that was written, if it is not that of the plan; its forces are not known.

    It is not where parts cannot be done as they were written.
    """
    plan = checked.plan
    spans = plan.dynamic if isinstance(plan, CompiledPlan) else ()
    if not any(isinstance(span.asked, PlanTarget) for span in spans):
        return None
    shown = checked.recording()
    return replace(
        shown,
        q=as_written(plan, checked.path),
        tau=np.zeros_like(shown.tau),
        foot_forces=np.zeros_like(shown.foot_forces),
        support_margin=np.full_like(shown.support_margin, np.nan),
    )


def _shown(plan: MotionPlan, content: ReplayContent) -> ReplayContent:
    """With the beats that a plan counts in, and where it is to end if it moves on."""
    if not isinstance(plan, CompiledPlan):
        return content
    x, y, yaw = plan.end_pose
    moves_on = np.hypot(x, y) > _MOVED or abs(yaw) > _TURNED
    return replace(content, beats=plan.beats, end_pose=(x, y, yaw) if moves_on else None)


def slider(parameter: Parameter, value: float | str) -> Slider:
    """A motion's parameter as what a live page lets one choose."""
    valid = parameter.valid
    if isinstance(valid, Choice):
        return Slider(parameter.name, value, words=valid.words)
    is_whole = isinstance(parameter.default, int)
    return Slider(parameter.name, value, valid.low, valid.high, is_whole, valid.unit)


def verdict_of(report: FeasibilityReport) -> Verdict:
    """The report as what ``viz`` shows of it."""
    broken, tight = len(report.failures), len(report.warnings)
    text = "feasible" if report.ok else counted(broken, "limit") + " broken"
    if tight:
        text += f", {counted(tight, 'tight margin')}"
    margins, enough = report.margins, _LEAST_SAMPLES
    judged = [s for s in report.series if len(s.times) >= enough and s.check in margins]
    left = {check: one.margin / max(abs(one.limit), 1e-9) for check, one in margins.items()}
    judged.sort(key=lambda item: left[item.check])  # shares, as limits are of different units
    findings = (*report.failures, *report.warnings)
    return Verdict(
        ok=report.ok,
        text=text,
        annotations=_grouped([_annotation(finding, report.series) for finding in findings]),
        curves=_curves(judged),
        chance=report.probability,
        world=str(report.world),
    )


def _annotation(finding: Finding, series: tuple[Series, ...]) -> Annotation:
    is_broken = not finding.margin >= 0.0
    item = next(
        item
        for item in series
        if item.check == finding.check
        and finding.subject in item.subjects
        and finding.time in item.times
    )
    margins = item.margins[:, item.subjects.index(finding.subject)]
    runs = true_runs(margins < (0.0 if is_broken else item.tight))  # nan is neither
    return Annotation(
        limit=finding.check,
        subject=finding.subject,
        time=finding.time,
        text=_words(finding),
        is_broken=is_broken,
        spans=tuple((float(item.times[r.start]), float(item.times[r.stop - 1])) for r in runs),
        parts=parts_of(finding.subject),
    )


def _grouped(annotations: Sequence[Annotation]) -> tuple[Annotation, ...]:
    """One annotation for the subjects that meet the same limit at about the same time."""
    groups: list[list[Annotation]] = []
    for item in annotations:
        meets = (item.limit, item.is_broken)
        alike = (
            group
            for group in groups
            if (group[0].limit, group[0].is_broken) == meets
            and abs(group[0].time - item.time) < _TOGETHER
        )
        group = next(alike, None)
        if group is None:
            groups.append([item])
        else:
            group.append(item)
    return tuple(
        replace(
            group[0],
            subject=_together([item.subject for item in group]),
            spans=tuple(sorted({span for item in group for span in item.spans})),
            parts=tuple(dict.fromkeys(part for item in group for part in item.parts)),
        )
        for group in groups
    )


def _together(subjects: Sequence[str]) -> str:
    """Names as a list; ``FL_calf, RR_calf`` is said as ``FL, RR calf``."""
    parts = {subject.partition("_")[2] for subject in subjects}
    if len(subjects) > 1 and len(parts) == 1 and parts != {""}:
        return ", ".join(s.partition("_")[0] for s in subjects) + f" {parts.pop()}"
    return ", ".join(subjects)


def _words(finding: Finding) -> str:
    if not np.isfinite(finding.value):
        return finding.note or "not possible"
    value = finding.value + 0.0  # never "-0"
    text = f"{value:.3g} {finding.unit}".strip() + f", limit {finding.limit:.3g}"
    return f"{text} ({finding.note})" if finding.note else text


def parts_of(subject: str) -> tuple[str, ...]:
    """Links that a subject of a check concerns; the trunk if it is none of the others."""
    legs = [leg.name for leg in LEGS]
    links = {f"{leg}_{part}" for leg in legs for part in ("hip", "thigh", "calf", "foot")}
    if subject in ("CoM", "ZMP"):
        return (CENTRE_OF_MASS,)
    if named := tuple(name for name in subject.split("-") if name in links | {"base"}):
        return named
    leg, _, part = subject.partition(" ")
    if leg not in legs:
        return ("base",)
    places = (part,) if part else ("foot", "calf")
    return tuple(f"{leg}_{place}" for place in places)


def _curves(judged: Sequence[Series]) -> tuple[MarginCurve, ...]:
    """Of the least margins of steps, where there are more samples than are shown."""
    found = dict[int, MarginCurve]()
    for count in {len(item.times) for item in judged}:  # of one length all at once
        rows = [row for row, item in enumerate(judged) if len(item.times) == count]
        step = -(-count // _MOST_MARGINS)
        steps = np.full((len(rows), -(-count // step) * step), np.inf)
        for own, row in zip(steps, rows, strict=True):
            own[:count] = judged[row].least[0]
        best, *others = steps.reshape(len(rows), -1, step).transpose(2, 0, 1).copy()
        at = np.zeros(best.shape, dtype=int)
        for after, other in enumerate(others, 1):  # half the time of argmin
            at[other < best] = after
            best = np.minimum(best, other)
        best[np.isinf(best)] = np.nan
        at += np.arange(0, count, step)
        found |= {
            row: _curve(judged[row], *pair) for row, *pair in zip(rows, best, at, strict=True)
        }
    return tuple(found[row] for row in range(len(judged)))


def _curve(
    series: Series, margin: Float[np.ndarray, " n"], rows: Int[np.ndarray, " n"]
) -> MarginCurve:
    return MarginCurve(
        name=series.check,
        unit=series.unit,
        time=series.times[rows],
        margin=margin,
        subjects=series.subjects,
        worst=series.least[1][rows],
        tight=series.tight,
    )


def _part(run: Recording, name: str) -> Recording:
    """The samples of the motion and a moment after it."""
    rows = np.flatnonzero(np.array(run.labels) == name)
    if len(rows) < _LEAST_SAMPLES:
        raise PlantError(f"the run holds no motion {name!r}")
    until = run.time[rows[-1]] + _AFTERWARDS
    end = int(np.searchsorted(run.time, until, side="right"))
    part = run.part(slice(int(rows[0]), end))
    return replace(part, time=part.time - part.time[0])


def _in_motion_frame(run: Recording, model: RobotModel) -> Recording:
    """The same run, seen from the middle of its feet at the start."""
    _, p_world_feet = model.forward_kinematics(run.q[0])
    anchor = Anchor.of_feet(p_world_feet.copy(), model.foot_radius)
    turn = Rotation.from_euler("z", -anchor.yaw)
    q = run.q.copy()
    q[:, :3] = turn.apply(q[:, :3] - anchor.p_world)
    q[:, 3:7] = (turn * Rotation.from_quat(q[:, 3:7])).as_quat()
    return replace(
        run,
        q=q,
        p_world_com=turn.apply(run.p_world_com - anchor.p_world),
        ground=(run.ground - anchor.p_world) @ turn.as_matrix().T,
    )
