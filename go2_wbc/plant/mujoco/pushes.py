"""External forces on the simulated robot that last for a while and overlay.

A held foot is a point on a spring and a damper, which give way to no more than a force:

    f = k (p_held - p) - d v,  |f| <= f_most
"""

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
from go2_wbc.validation import LARGEST

STIFFNESS, DAMPING = 1e4, 50.0
"""k [N/m] and d [N s/m] of a held foot: 2 cm at 200 N, and stable for a calf at steps of 2 ms."""


@dataclass(frozen=True, slots=True)
class Push:
    """An external force that acts for some more physics steps.

    Attributes:
        body: id of the body.
        p_body_point: where it acts, in the body's frame [m].
        f_world: the force in the world [N]; of what holds the point, its length is the greatest.
        steps_left: physics steps for which it still acts.
        p_world_held: where the point is held [m]; None where the force is given.
    """

    body: int
    p_body_point: Float[np.ndarray, "3"]
    f_world: Float[np.ndarray, "3"]
    steps_left: int
    p_world_held: Float[np.ndarray, "3"] | None = None


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
        if not 0.0 < duration <= LARGEST:
            raise CommandError(f"push duration must be positive and finite [s], got {duration!r}")
        body, point = self._point(at)
        steps = max(1, round(duration / self._model.opt.timestep))
        self.active = (*self.active, Push(body, point, f_world, steps))

    def hold(self, foot: str, most: float, duration: float) -> None:
        """Holds a foot where it is from the next physics step on, by a force of at most [N]."""
        self.add(np.array([0.0, 0.0, most]), duration, foot)
        push = self.active[-1]
        here = self._data.xipos[push.body] + self._arm(push)
        self.active = (*self.active[:-1], replace(push, p_world_held=here))

    def apply(self) -> None:
        """Writes the forces for one physics step."""
        wrenches = self._wrenches
        wrenches[:] = 0.0
        if not self.active:
            return
        for push in self.active:
            arm = self._arm(push)
            held = push.p_world_held
            force = push.f_world if held is None else self._holding(push, held, arm)
            wrenches[push.body, :3] += force
            wrenches[push.body, 3:] += np.cross(arm, force)
        later = (replace(push, steps_left=push.steps_left - 1) for push in self.active)
        self.active = tuple(push for push in later if push.steps_left > 0)

    def _arm(self, push: Push) -> Float[np.ndarray, "3"]:
        """From the body's centre of mass, where MuJoCo applies wrenches, to the push's point."""
        R_world_body = self._data.xmat[push.body].reshape(3, 3)
        p_world_point = self._data.xpos[push.body] + R_world_body @ push.p_body_point
        return p_world_point - self._data.xipos[push.body]

    def _holding(
        self, push: Push, held: Float[np.ndarray, "3"], arm: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "3"]:
        """The force of what holds a point [N]."""
        data, twist = self._data, np.empty(6)  # angular before linear, at the centre of mass
        body = mujoco.mjtObj.mjOBJ_BODY
        mujoco.mj_objectVelocity(self._model, data, body, push.body, twist, 0)
        velocity = twist[3:] + np.cross(twist[:3], arm)
        force = STIFFNESS * (held - data.xipos[push.body] - arm) - DAMPING * velocity
        most = float(np.linalg.norm(push.f_world))
        return force * min(1.0, most / max(float(np.linalg.norm(force)), 1e-9))

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
