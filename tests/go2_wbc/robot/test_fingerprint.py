"""A fingerprint tells robots apart by their numbers."""

from __future__ import annotations

import numpy as np

from go2_wbc.robot.fingerprint import LENGTH, fingerprint
from go2_wbc.robot.model import RobotModel


def changed(mass: float) -> RobotModel:
    model = RobotModel()
    model.pin_model.inertias[1].mass += mass
    return model


def test_models_of_the_same_robot_have_the_same_fingerprint() -> None:
    own = fingerprint(RobotModel())
    assert len(own) == LENGTH
    assert own == fingerprint(RobotModel())
    assert own == fingerprint(changed(1e-12))  # as another library's rounding does


def test_another_mass_rotor_or_foot_is_another_robot() -> None:
    models = [
        RobotModel(),
        changed(1e-3),
        RobotModel(armature=np.full(12, 0.01)),
        RobotModel(foot_radius=0.023),
    ]
    assert len({fingerprint(model) for model in models}) == len(models)
