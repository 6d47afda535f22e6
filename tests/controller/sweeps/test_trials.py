"""Trials draw what they say."""

import pytest

from controller.sweeps.trials import (
    FRICTION_RANGE,
    MASS_RANGE,
    NOMINAL_FRICTION,
    YAW_RANGE,
    Trial,
)


def test_trials_draw_inside_their_ranges_and_fill_them() -> None:
    trials = [Trial(seed) for seed in range(200)]
    for values, (low, high) in (
        ([t.friction for t in trials], FRICTION_RANGE),
        ([t.mass_scale for t in trials], MASS_RANGE),
        ([t.initial_yaw for t in trials], YAW_RANGE),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high


def test_a_trial_is_decided_by_its_seed() -> None:
    a, b, other = Trial(5), Trial(5), Trial(6)
    assert (a.friction, a.mass_scale, a.initial_yaw) == (b.friction, b.mass_scale, b.initial_yaw)
    assert a.mass_scale != other.mass_scale


def test_nominal_friction_changes_nothing_else() -> None:
    drawn, nominal = Trial(3), Trial(3, has_nominal_friction=True)
    assert nominal.friction == NOMINAL_FRICTION
    assert (nominal.mass_scale, nominal.initial_yaw) == (drawn.mass_scale, drawn.initial_yaw)


def test_the_plant_of_a_trial_is_what_the_trial_says() -> None:
    nominal_mass = 16.085
    trial = Trial(4)
    plant = trial.plant()
    assert plant.total_mass == pytest.approx(nominal_mass * trial.mass_scale, rel=1e-3)
    assert plant.read().rpy[2] == pytest.approx(trial.initial_yaw, abs=0.1)
    plant.close()
