"""Samples of a compiled plan, all at once, against its references one by one."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from go2_wbc.contacts import GAITS, ContactSchedule
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion
from motions.samples import PlanSamples

ROUNDING = 1e-12  # m, rad; N of 400


@pytest.mark.parametrize("name", ["high_five", "tap_dance", "sit_pretty"])
def test_samples_are_the_references(name: str) -> None:
    plan = compile_timeline(load_motion(name), RobotModel())
    times = np.array([-1.0, *np.arange(0.0, plan.duration, 0.017), plan.duration, 99.0])
    places = np.array([plan.at(float(t)).p_world_feet for t in times])
    found, expected = plan.samples(times), PlanSamples.one_by_one(plan, times, places)
    for field in fields(PlanSamples):
        one, other = getattr(found, field.name), getattr(expected, field.name)
        assert one.dtype == other.dtype
        difference = np.abs(one.astype(float) - other.astype(float))
        scale = 400.0 if field.name == "normal_force_max" else 1.0
        assert difference.max() <= scale * ROUNDING, field.name


@pytest.mark.parametrize(
    "schedule",
    [
        GAITS["trot"].schedule(),
        ContactSchedule((0.5,), np.ones((1, 4), dtype=bool)),
        ContactSchedule((0.0, 1.0, 1.5), np.array([[1, 1, 1, 1], [0, 1, 1, 1], [1, 1, 0, 1]]) > 0),
    ],
    ids=["trot", "standing", "steps"],
)
def test_contacts_at_many_times_are_those_of_each(schedule: ContactSchedule) -> None:
    times = np.concatenate([np.random.default_rng(1).uniform(-1.0, 4.0, 200), [0.0, 1.0, 0.18]])
    many = schedule.at_times(times)
    for row, t in enumerate(times.tolist()):
        one = schedule.at(t)
        for name in ("stance", "elapsed", "remaining"):
            assert getattr(many, name)[row] == pytest.approx(getattr(one, name), abs=ROUNDING), name
        assert many.load_share(0.1)[row] == pytest.approx(one.load_share(0.1), abs=1e-9)
