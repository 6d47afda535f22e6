"""A checked motion, and a run of it, as what ``viz`` shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import PlantError
from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions import CheckedMotion, FeasibilityReport, Finding
from motions.feasibility import Series
from viz.content import CENTRE_OF_MASS, Annotation, MarginCurve, ReplayContent, Verdict

_AFTERWARDS = 1.0
"""How long [s] a run is shown after the end of its motion."""
_TOGETHER = 0.05
"""Annotations on one limit that are this close in time [s] become one."""
_LEAST_SAMPLES = 2


def planned(checked: CheckedMotion) -> ReplayContent:
    """The plan with its verdict."""
    return ReplayContent(checked.recording(), is_plan=True, verdict=verdict_of(checked.report))


def performed(checked: CheckedMotion, run: Recording, model: RobotModel) -> ReplayContent:
    """A run of the motion with the verdict on its plan, and the plan as the ghost.

    Args:
        checked: of the motion that was played.
        run: holds samples that are labelled with the motion's name, from standing on four feet.
        model: of the robot that ran.

    Raises:
        PlantError: if the motion is not in the run.
    """
    own = _in_motion_frame(_part(run, checked.plan.name), model)
    plan = checked.recording()
    labels = tuple(_label_at(plan, float(time)) for time in own.time)
    return ReplayContent(
        replace(own, labels=labels), verdict=verdict_of(checked.report), ghost=plan
    )


def verdict_of(report: FeasibilityReport) -> Verdict:
    """The report as what ``viz`` shows of it."""
    broken, tight = len(report.failures), len(report.warnings)
    text = "feasible" if report.ok else _count(broken, "limit") + " broken"
    if tight:
        text += f", {_count(tight, 'tight margin')}"
    judged = [item for item in report.series if len(item.times) >= _LEAST_SAMPLES]
    judged = [item for item in judged if item.check in report.margins]
    judged.sort(key=lambda item: _share_left(report.margins[item.check]))
    annotations = [
        _annotation(finding, report.series) for finding in (*report.failures, *report.warnings)
    ]
    return Verdict(
        ok=report.ok,
        text=text,
        annotations=_grouped(annotations),
        curves=tuple(_curve(item) for item in judged),
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
    known = ~np.isnan(margins)
    flags = known & (margins < 0.0) if is_broken else known & (margins < item.tight)
    return Annotation(
        limit=finding.check,
        subject=finding.subject,
        time=finding.time,
        text=_words(finding),
        is_broken=is_broken,
        spans=_spans(item.times, flags),
        parts=parts_of(finding.subject),
    )


def _grouped(annotations: Sequence[Annotation]) -> tuple[Annotation, ...]:
    """One annotation for the subjects that meet the same limit at about the same time."""
    groups: list[list[Annotation]] = []
    for annotation in annotations:
        for group in groups:
            first = group[0]
            is_same = (first.limit, first.is_broken) == (annotation.limit, annotation.is_broken)
            if is_same and abs(first.time - annotation.time) < _TOGETHER:
                group.append(annotation)
                break
        else:
            groups.append([annotation])
    return tuple(_joined(group) for group in groups)


def _joined(group: Sequence[Annotation]) -> Annotation:
    return replace(
        group[0],
        subject=_together([annotation.subject for annotation in group]),
        spans=tuple(sorted({span for annotation in group for span in annotation.spans})),
        parts=tuple(dict.fromkeys(part for annotation in group for part in annotation.parts)),
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
    if subject in legs:
        return f"{subject}_foot", f"{subject}_calf"
    if subject in ("CoM", "ZMP"):
        return (CENTRE_OF_MASS,)
    links = {f"{leg}_{part}" for leg in legs for part in ("hip", "thigh", "calf", "foot")}
    named = [name for name in subject.split("-") if name in links | {"base"}]
    if named:
        return tuple(named)
    leg, _, part = subject.partition(" ")
    if leg in legs:
        return (f"{leg}_foot",) if part == "foot" else (f"{leg}_calf",)
    return ("base",)


def _curve(series: Series) -> MarginCurve:
    known = np.where(np.isnan(series.margins), np.inf, series.margins)
    return MarginCurve(
        name=series.check,
        unit=series.unit,
        time=series.times,
        margin=series.least_margins(),
        subjects=series.subjects,
        worst=known.argmin(axis=1),
        tight=series.tight,
    )


def _share_left(finding: Finding) -> float:
    """Margin over limit: what orders limits of different units."""
    return finding.margin / max(abs(finding.limit), 1e-9)


def _spans(
    times: Float[np.ndarray, " n"], flags: Bool[np.ndarray, " n"]
) -> tuple[tuple[float, float], ...]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return tuple(
        (float(times[start]), float(times[end - 1]))
        for start, end in zip(edges[::2], edges[1::2], strict=True)
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


def _label_at(plan: Recording, time: float) -> str:
    """What the plan says is done at that time."""
    if time > plan.time[-1]:
        return "afterwards"
    return plan.labels[min(int(np.searchsorted(plan.time, time)), len(plan.labels) - 1)]


def _in_motion_frame(run: Recording, model: RobotModel) -> Recording:
    """The same run, seen from the middle of its feet at the start."""
    _, p_world_feet = model.forward_kinematics(run.q[0])
    anchor = Anchor.of_feet(p_world_feet.copy(), model.foot_radius)
    R = yaw_rotation(-anchor.yaw)
    q = run.q.copy()
    q[:, :3] = (q[:, :3] - anchor.p_world) @ R.T
    q[:, 3:7] = _turned(-anchor.yaw, q[:, 3:7])
    return replace(run, q=q, p_world_com=(run.p_world_com - anchor.p_world) @ R.T)


def _turned(yaw: float, quaternions: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4"]:
    """Quaternions x y z w, turned about world z."""
    s, c = np.sin(yaw / 2), np.cos(yaw / 2)
    x, y, z, w = quaternions.T
    return np.column_stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
