"""From the check's report, and from a run, to what the viewers show."""

from dataclasses import replace

import numpy as np
import pytest

from controller.report_view import parts_of, performed, planned, verdict_of
from go2_wbc.errors import PlantError
from go2_wbc.recording import Recording
from go2_wbc.robot.rotations import yaw_rotation
from motions import CheckedMotion, Timeline
from motions import FeasibilityChecker as Checker

_YAW, _PLACE = 1.1, np.array([0.7, -0.4, 0.0])
_ROUNDING = 1e-9


@pytest.fixture(scope="module")
def nod(checker: Checker) -> CheckedMotion:
    return checker.evaluate(Timeline(name="nod").body(pitch=0.1, over=0.6).home(over=0.6))


@pytest.fixture(scope="module")
def stretched(checker: Checker) -> CheckedMotion:
    line = Timeline(name="up").body(z=0.17, over=1.0).hold(0.5).home(over=1.0)
    return checker.evaluate(line)


def test_a_feasible_plan_has_a_green_verdict(nod: CheckedMotion) -> None:
    content = planned(nod)
    assert content.is_plan
    assert content.verdict is not None
    assert content.verdict.ok
    assert content.verdict.text == "feasible"
    names = {curve.name for curve in content.verdict.curves}
    assert {"support", "torque", "friction", "joint position", "self-collision"} <= names
    assert not any(curve.is_broken for curve in content.verdict.curves)


def test_what_is_broken_says_where_and_when(stretched: CheckedMotion) -> None:
    verdict = verdict_of(stretched.report)
    assert not verdict.ok
    assert verdict.text.startswith(f"{len(stretched.report.failures)} limits broken")
    (reach,) = [annotation for annotation in verdict.annotations if annotation.limit == "reach"]
    assert reach.subject == "FL, FR, RL, RR"
    assert {"FL_foot", "RR_calf"} <= set(reach.parts)
    start = min(start for start, _ in reach.spans)
    end = max(end for _, end in reach.spans)
    assert 0.4 < start < reach.time <= end < 2.1
    (calves,) = [
        annotation for annotation in verdict.annotations if annotation.limit == "joint position"
    ]
    assert calves.subject == "FL, FR, RL, RR calf"
    assert "-0 rad" not in calves.text
    (curve,) = [curve for curve in verdict.curves if curve.name == "reach"]
    inside = np.zeros(len(curve.time), dtype=bool)
    for start, end in reach.spans:
        inside |= (curve.time >= start) & (curve.time <= end)
    np.testing.assert_array_equal(inside, curve.margin < 0.0)


@pytest.mark.parametrize(
    ("subject", "parts"),
    [
        ("FL", ("FL_foot", "FL_calf")),
        ("RR_thigh", ("RR_thigh",)),
        ("CoM", ("com",)),
        ("ZMP", ("com",)),
        ("FL_calf-base", ("FL_calf", "base")),
        ("FR thigh", ("FR_thigh",)),
        ("RL hip", ("RL_hip",)),
        ("FR foot", ("FR_foot",)),
        ("trunk turning", ("base",)),
        ("exit place", ("base",)),
    ],
)
def test_a_subject_has_its_parts(subject: str, parts: tuple[str, ...]) -> None:
    assert parts_of(subject) == parts


def test_a_run_is_seen_in_the_frame_and_at_the_time_of_its_motion(
    nod: CheckedMotion, checker: Checker
) -> None:
    plan = nod.recording()
    run = _elsewhere(plan)
    content = performed(nod, replace(run, ground=run.p_world_com), checker.model)
    own = content.recording
    assert not content.is_plan
    assert content.ghost is not None
    assert content.written is None
    rows = slice(0, len(plan.time))
    np.testing.assert_allclose(own.time[rows], plan.time, atol=_ROUNDING)
    np.testing.assert_allclose(own.q[rows], plan.q, atol=_ROUNDING)
    np.testing.assert_allclose(own.p_world_com[rows], plan.p_world_com, atol=_ROUNDING)
    ground = own.ground[run.labels.index(nod.plan.name) :][: len(own.time)]
    np.testing.assert_allclose(ground, own.p_world_com, atol=_ROUNDING)
    np.testing.assert_allclose(content.ghost.q, plan.q)
    assert own.duration == pytest.approx(plan.duration + 1.0, abs=0.02)
    assert own.labels[0] == plan.labels[0]
    assert own.labels[-1] == "afterwards"


def test_a_run_without_the_motion_is_refused(nod: CheckedMotion, checker: Checker) -> None:
    run = _elsewhere(nod.recording())
    with pytest.raises(PlantError, match="no motion 'nod'"):
        performed(nod, replace(run, labels=("stand",) * len(run.labels)), checker.model)


def _elsewhere(plan: Recording, name: str = "nod") -> Recording:
    """The plan done exactly, somewhere else, after standing for 1 s and before another 3 s."""
    before, after = 100, 300
    rows = np.clip(np.arange(-before, len(plan.time) + after), 0, len(plan.time) - 1)
    R = yaw_rotation(_YAW)
    q = plan.q[rows].copy()
    q[:, :3] = q[:, :3] @ R.T + _PLACE
    x, y, z, w = q[:, 3:7].T.copy()
    s, c = np.sin(_YAW / 2), np.cos(_YAW / 2)
    q[:, 3:7] = np.column_stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])
    labels = ("stand",) * before + (name,) * len(plan.time) + ("stand",) * after
    return Recording(
        time=5.0 + np.arange(len(rows)) * 0.01,
        q=q,
        v=plan.v[rows],
        tau=plan.tau[rows],
        foot_forces=plan.foot_forces[rows],
        stance=plan.stance[rows],
        p_world_com=plan.p_world_com[rows] @ R.T + _PLACE,
        support_margin=plan.support_margin[rows],
        labels=labels,
    )


def test_the_page_shows_what_was_written_beside_the_nearest_feasible(checker: Checker) -> None:
    line = Timeline(name="sway", physics="nearest")
    for side in (1.0, -1.0, 1.0):
        line = line.body(y=0.06 * side, over=0.22)
    checked = checker.evaluate(line.home(over=0.3))
    assert checked.report.ok
    content = planned(checked)
    assert content.ghost is None
    assert content.written is not None
    aside = content.written.q[:, 1]
    turns = [float(aside[np.argmin(np.abs(content.written.time - t))]) for t in (0.22, 0.44, 0.66)]
    assert turns == pytest.approx([0.06, -0.06, 0.06], abs=2e-3)
    off = np.abs(aside - content.recording.q[:, 1]).max()
    assert 0.005 < off <= 0.05
    run = performed(checked, _elsewhere(checked.recording(), "sway"), checker.model)
    assert run.ghost is not None
    assert run.written is not None
    np.testing.assert_allclose(run.ghost.q, content.recording.q)
    np.testing.assert_allclose(run.written.q, content.written.q)


def test_the_page_shows_the_beats_and_the_end_of_a_motion_that_moves_on(checker: Checker) -> None:
    line = Timeline(name="on").bpm(120).body(z=-0.01, over=2).home(over=2)
    still = planned(checker.evaluate(line))
    assert still.beats == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    assert still.end_pose is None
    moved = planned(checker.evaluate(Timeline(name="walk").walk(x=0.2)))
    assert moved.beats == ()
    assert moved.end_pose == pytest.approx((0.2, 0.0, 0.0), abs=1e-6)


def test_a_long_curve_keeps_its_least_values_and_says_whose_they_are(nod: CheckedMotion) -> None:
    times, margins = np.arange(100_000.0), np.ones((100_000, 2))
    margins[[3, 77_777], [1, 0]], margins[200:300] = (-5.0, -7.0), np.nan
    (series,) = (one for one in nod.report.series if one.check == "lag")
    long = replace(series, times=times, values=margins, limits=0 * margins, margins=margins)
    (curve,) = verdict_of(replace(nod.report, series=(long,))).curves
    assert len(curve.time) <= 3000
    broken = [
        (curve.time[k], curve.subjects[curve.worst[k]]) for k in np.flatnonzero(curve.margin < 0)
    ]
    assert broken == [(3.0, "trunk turning"), (77_777.0, "trunk")]
    assert np.isnan(curve.margin[(curve.time > 210) & (curve.time < 290)]).all()
