"""External forces on the simulated robot that last for a while and overlay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.plant.mujoco.layout import MujocoLayout
from go2_wbc.robot.description import BASE_LINK


@dataclass(frozen=True, slots=True)
class Push:
    """An external force that acts for some more physics steps.

    Attributes:
        body: id of the body.
        p_body_point: where it acts, in the body's frame [m].
        f_world: the force in the world [N].
        steps_left: physics steps for which it still acts.
    """

    body: int
    p_body_point: Float[np.ndarray, "3"]
    f_world: Float[np.ndarray, "3"]
    steps_left: int


@final
class Pushes:
    """The pushes that act now on one model.

    Attributes:
        active: the pushes; each loses one step at every ``apply``.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, layout: MujocoLayout) -> None:
        self._model, self._data, self._layout = model, data, layout
        self._wrenches = data.xfrc_applied  # a view, made once because making it is slow
        self.active: tuple[Push, ...] = ()

    def add(self, force: Float[np.ndarray, "3"], duration: float, at: str) -> None:
        """Starts a push at the next physics step; see ``MujocoPlant.push``."""
        f_world = np.array(force, dtype=float)
        if f_world.shape != (3,) or not np.isfinite(f_world).all():
            raise CommandError(f"push force must be three finite numbers [N], got {force!r}")
        if not (np.isfinite(duration) and duration > 0.0):
            raise CommandError(f"push duration must be positive and finite [s], got {duration!r}")
        body, point = self._point(at)
        steps = max(1, round(duration / self._model.opt.timestep))
        self.active = (*self.active, Push(body, point, f_world, steps))

    def apply(self) -> None:
        """Writes the forces for one physics step."""
        wrenches = self._wrenches
        wrenches[:] = 0.0
        if not self.active:
            return
        for push in self.active:
            wrenches[push.body, :3] += push.f_world
            wrenches[push.body, 3:] += np.cross(self._arm(push), push.f_world)
        later = (replace(push, steps_left=push.steps_left - 1) for push in self.active)
        self.active = tuple(push for push in later if push.steps_left > 0)

    def _arm(self, push: Push) -> Float[np.ndarray, "3"]:
        """From the body's centre of mass, where MuJoCo applies wrenches, to the push's point."""
        R_world_body = self._data.xmat[push.body].reshape(3, 3)
        p_world_point = self._data.xpos[push.body] + R_world_body @ push.p_body_point
        return p_world_point - self._data.xipos[push.body]

    def _point(self, at: str) -> tuple[int, Float[np.ndarray, "3"]]:
        """Body and point that a name means."""
        model, layout = self._model, self._layout
        if at in FOOT_NAMES:
            leg = FOOT_NAMES.index(at)
            return int(layout.foot_bodies[leg]), model.geom_pos[layout.foot_geoms[leg]].copy()
        bodies = {model.body(i).name: i for i in range(1, model.nbody)} | {BASE_LINK: layout.base}
        if at not in bodies:
            raise CommandError(unknown_name("body to push", at, {*bodies, *FOOT_NAMES} - {""}))
        return bodies[at], model.body_ipos[bodies[at]].copy()
