"""What of the world around a simulated robot can change: friction, masses, the motors' delay."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import final

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.plant.mujoco.forces import MujocoLayout
from go2_wbc.plant.mujoco.model import PAYLOAD_BODY
from go2_wbc.world import World


@final
class DelayedCommands:
    """Commands on their way to the motors: each acts some physics steps after it was written."""

    def __init__(self, substeps: int, steps: int) -> None:
        """Of so many ``substeps`` a control period; delayed by ``steps``."""
        self._substeps = substeps
        self.delay(steps)

    def delay(self, steps: int) -> None:
        """Delay commands by so many physics steps from now on; those on their way are lost."""
        late, self._within = divmod(steps, self._substeps)
        nothing = np.zeros((5, 12))
        self._waiting = deque([nothing] * (late + 2), late + 2)
        """The newest is the last, and acts ``late`` periods and some steps after it was written."""

    def save(self) -> tuple[int, tuple[Float[np.ndarray, "5 12"], ...]]:
        """The delay within a period, and the commands; what ``restore`` takes."""
        return self._within, tuple(self._waiting)

    def restore(self, within: int, waiting: Sequence[Float[np.ndarray, "5 12"]]) -> None:
        """Go on with what ``save`` returned."""
        self._within, self._waiting = within, deque(waiting, len(waiting))

    def write(self, numbers: Float[np.ndarray, "5 12"]) -> None:
        """A command of a new control period."""
        self._waiting.append(numbers)

    def acting(self, step: int) -> Float[np.ndarray, "5 12"]:
        """The command that acts in a physics step of the present control period."""
        return self._waiting[1 if step >= self._within else 0]


@final
class Variation:
    """Puts a compiled model into another world, without building it anew."""

    def __init__(self, model: mujoco.MjModel, layout: MujocoLayout, *, is_users: bool) -> None:
        """Note how it was built; of a user's own MJCF friction is that of the feet's contacts."""
        self._model, self._scratch = model, mujoco.MjData(model)
        self._joints = joints = layout.joint_v
        self._slides = model.geom_priority == 0  # the others have a friction of their own
        self._priority = 0
        if is_users:
            self._slides = np.isin(layout.geom_codes, np.array(LEGS, int))
            self._priority = int(model.geom_priority[~self._slides].max(initial=0)) + 1
        names = [model.body(number).name for number in range(model.nbody)]
        self._own = np.array([name != PAYLOAD_BODY for name in names])
        self._payload = float(model.body_mass[~self._own].sum())
        self._mass, self._inertia = model.body_mass[self._own], model.body_inertia[self._own]
        self._friction = model.dof_damping[joints], model.dof_frictionloss[joints]

    def apply(self, world: World) -> None:
        """Change the model to what it would have been built to in ``world``.

        Masses and friction of joints are scaled as they were built.

        Raises:
            ConfigError: for another payload than it was built with.
        """
        if world.payload != self._payload:
            told = f"was built with {self._payload:g} kg"
            raise ConfigError(f"payload cannot become {world.payload:g} kg, the plant {told}")
        model, (damping, loss) = self._model, self._friction
        model.geom_friction[self._slides, 0] = world.friction
        model.geom_priority[self._slides] = self._priority
        model.body_mass[self._own] = self._mass * world.mass_scale
        model.body_inertia[self._own] = self._inertia * world.mass_scale
        model.dof_damping[self._joints] = world.joint_friction * damping
        model.dof_frictionloss[self._joints] = world.joint_friction * loss
        mujoco.mj_setConst(model, self._scratch)
