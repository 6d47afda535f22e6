"""The simulated robot for learning: Gymnasium environments, and data sets of the expert.

Importing this registers the environments where Gymnasium is installed. So does
``gymnasium.make("controller.learning:Go2-v0")``; version 1 of Gymnasium uses no entry points.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.learning.dataset import read_dataset, record
    from controller.learning.environment import Go2Env
    from controller.learning.tasks import TASKS, LearningTask
    from controller.learning.vector import Go2VectorEnv
    from controller.observation import ACTIONS, OBSERVATION

__all__ = [
    "ACTIONS",
    "ENVIRONMENTS",
    "OBSERVATION",
    "TASKS",
    "Go2Env",
    "Go2VectorEnv",
    "LearningTask",
    "read_dataset",
    "record",
]

ENVIRONMENTS = {"Go2-v0": "velocity", "Go2Rough-v0": "rough", "Go2Push-v0": "push"}
"""The task of each environment, by the name that ``gymnasium.make`` takes."""

__getattr__ = lazy_exports(__name__)


def _register() -> None:
    with suppress(ImportError):
        from gymnasium import envs

        for name, task in ENVIRONMENTS.items():
            if name not in envs.registry:
                envs.register(
                    name,
                    "controller.learning.environment:Go2Env",
                    vector_entry_point="controller.learning.vector:Go2VectorEnv",
                    kwargs={"task": task},
                )


_register()
