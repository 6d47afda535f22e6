"""``Go2Env``: the simulated robot as a Gymnasium environment, without the controller.

A step is one ``write`` of a plant whose control period is 0.02 s, in which the joint servo acts in
every physics step. A reset brings the plant back and puts it into another world; the model is built
again only for another terrain. All random values come from the seed of ``reset``.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, UInt8

from controller.learning import rewards
from controller.learning.tasks import LearningTask, find_task
from controller.observation import (
    ACTIONS,
    KD,
    KP,
    OBSERVATION,
    RATE,
    STANCE,
    STANCE_HEIGHT,
    TARGETS,
    Actuation,
    observed,
)
from go2_wbc.arguments import typed
from go2_wbc.contacts import GAITS
from go2_wbc.errors import CommandError, PlantError, needing, unknown_name
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import FALLEN_TILT, TOUCH
from go2_wbc.plant.mujoco.setup import SavedPhysics
from go2_wbc.records import Array3
from go2_wbc.validation import LARGEST
from go2_wbc.world import World

with needing("learning", "environments need gymnasium"):
    import gymnasium
    from gymnasium.spaces import Box

SENSORS = ("ideal", "noisy")
"""What the state is told with. The estimate of "imu" wants the rate of the control loop."""
FRAMES = "rgb_array"  #: The one mode of rendering

Info = dict[str, Any]
Seen = Float32[np.ndarray, " n"]
Step = tuple[Seen, float, bool, bool, Info]


class Go2Env(gymnasium.Env[Seen, np.ndarray]):
    """A Go2 that is to follow velocity commands; an action every 0.02 s.

    Attributes:
        task: what is asked, as data.
        layout: names, units and order of the observation.
        actuation: what actions mean.
    """

    metadata: dict[str, Any] = {"render_modes": [FRAMES], "render_fps": RATE}  # noqa: RUF012

    @typed("kp", "kd", "episode_time", "sensors", "action", error=CommandError)
    def __init__(
        self,
        task: LearningTask | str = "velocity",
        action: str = TARGETS,
        *,
        terms: tuple[str, ...] = OBSERVATION.names,
        sensors: str = "ideal",
        randomise: bool = True,
        kp: float = KP,
        kd: float = KD,
        episode_time: float = 20.0,
        render_mode: str | None = None,
        mjcf: Path | str | None = None,
    ) -> None:
        """An environment that is reset before its first step.

        Args:
            task: "velocity", "rough", "push", or one of your own.
            action: "targets" of the joints' servo, or "torques".
            terms: of the observation, in this order.
            sensors: "ideal", or "noisy" for white noise on all that is measured.
            randomise: draw world, delay, heading and start; False takes the middle of each.
            kp, kd: of the servo [N m/rad], [N m s/rad].
            episode_time: after which an episode is truncated [s].
            render_mode: None or "rgb_array".
            mjcf: file of a Go2 of your own, as ``MujocoPlant`` takes it, on the ground that it has.

        Raises:
            CommandError: for an unknown name, a number out of range, or a task with terrains
                together with an ``mjcf``.
            ModelMismatch: if ``mjcf`` is no Go2.
            MissingDependency: without Gymnasium.
        """
        if sensors not in SENSORS:
            raise CommandError(unknown_name("sensors", sensors, SENSORS))
        if render_mode not in (None, FRAMES):
            raise CommandError(unknown_name("render_mode", str(render_mode), [FRAMES]))
        if not (kp >= 0.0 and kd >= 0.0 and episode_time > 0.0):
            raise CommandError(f"kp, kd and episode_time must be positive: {kp, kd, episode_time}")
        own, self._sensors = find_task(task), sensors
        self.task, self._mjcf = own if randomise else own.exact, mjcf
        if mjcf is not None and own.terrains:
            raise CommandError(f"task {own.name!r} has terrains, an mjcf brings its own ground")
        self.layout = OBSERVATION.chosen(terms)
        limits = self.layout.limits
        self.observation_space = Box(-limits, limits, dtype=np.float32)
        self._plants: dict[int, tuple[MujocoPlant, SavedPhysics]] = {}
        self._plant, _ = self._plant_on(0)
        self.actuation = Actuation(action, self._plant.torque_limits, kp, kd)
        most = ACTIONS[action].limits
        self.action_space = Box(-most, most, dtype=np.float32)
        self.render_mode = render_mode
        self._last, self._step, self._is_over = round(episode_time * RATE), 0, True
        self._camera: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, Info]:
        """Begin an episode, standing.

        Args:
            seed: of all that follows; without one the random numbers go on.
            options: ``{"command": (0.5, 0.0, 0.0)}`` keeps this command for the whole episode.

        Raises:
            CommandError: for another option, or a command that is not three finite numbers.
        """
        fixed = _command_of(options or {})
        super().reset(seed=seed)
        rng, task, self._fixed = self.np_random, self.task, fixed
        number = int(rng.integers(max(len(task.terrains), 1)))
        self._plant, saved = self._plant_on(number)
        noise = np.random.default_rng(int(rng.integers(2**63))).bit_generator.state
        self._plant.restore(saved._replace(noise_state=noise))
        world = task.draw_world(rng)
        self._plant.vary(world)
        yaw = float(rng.uniform(*task.yaw))
        joints = np.tile(STANCE, 4) + task.joint_noise * rng.standard_normal(12)
        base = (0.0, 0.0, STANCE_HEIGHT, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        self._plant.place(np.array([*base, *joints]))
        self._step, self._is_over = 0, False
        self._command = self._next_command()
        self._next_shove = math.inf if task.shoves is None else rng.uniform(*task.shoves.every)
        self._last_action = np.zeros(12, dtype=np.float32)
        return self._seen(), {"world": _told(world), "terrain": number, "command": self.command}

    def step(self, action: np.ndarray) -> Step:
        """What an action of 0.02 s leads to.

        ``info["reward_terms"]`` holds what each term gave; the reward is their sum.

        Raises:
            CommandError: before ``reset``, after the end of the episode, or for what is no action.
        """
        if self._is_over:
            raise CommandError("the episode is over: call reset()")
        numbers = _numbers(action, 12)
        if numbers is None or not np.isfinite(numbers).all():
            raise CommandError(f"an action is 12 finite numbers, got {action!r:.80}")
        action = np.clip(numbers, -LARGEST, LARGEST).astype(np.float32)
        self._shove()
        has_diverged = False
        try:
            self._plant.write(self.actuation.command(action))
        except PlantError:  # of what has exploded nothing can be told
            has_diverged = True
        action = np.clip(action, -1.0, 1.0)
        self._step += 1
        gains, has_fallen = self._rewards(action, has_diverged=has_diverged)
        self._last_action = action
        if self._step % round(self.task.commands.every * RATE) == 0:
            self._command = self._next_command()
        is_late = self._step >= self._last
        self._is_over = has_fallen or is_late
        info = {"reward_terms": gains, "command": self.command}
        return self._seen(), float(sum(gains.values())), has_fallen, is_late, info

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:
        """A picture of the robot from aside, if ``render_mode`` asks for it."""
        if self.render_mode is None:
            return None
        from viz.render.snapshots import SnapshotCamera

        if self._camera is None:
            self._camera = SnapshotCamera(model_file=self._plant.model_file)
        terrains = self.task.terrains
        number = next(n for n, (plant, _) in self._plants.items() if plant is self._plant)
        blocks = terrains[number].blocks() if terrains else ()
        return self._camera.shoot(self._plant.truth().q, blocks)

    def close(self) -> None:
        """Release the plants; idempotent."""
        self._is_over = True
        for plant, _ in self._plants.values():
            plant.close()

    @property
    def command(self) -> Array3:
        """What is asked now: ahead, left [m/s], turning left [rad/s]; a copy."""
        return self._command.copy()

    @property
    def plant(self) -> MujocoPlant:
        """The robot of this episode."""
        return self._plant

    def _plant_on(self, number: int) -> tuple[MujocoPlant, SavedPhysics]:
        """The robot on a terrain, built once, and its state then."""
        if number not in self._plants:
            terrains = self.task.terrains
            terrain = terrains[number] if terrains else None
            period, sensors = 1.0 / RATE, self._sensors
            world = {"terrain": terrain, "sensors": sensors}
            plant = MujocoPlant(self._mjcf, control_period=period, **world)
            self._plants[number] = plant, plant.save()
        return self._plants[number]

    def _next_command(self) -> Array3:
        drawn = self.task.commands.draw(self.np_random)
        return drawn if self._fixed is None else self._fixed

    def _shove(self) -> None:
        shoves = self.task.shoves
        if shoves is not None and self._step / RATE >= self._next_shove:
            self._plant.push(shoves.draw(self.np_random), shoves.duration)
            self._next_shove += self.np_random.uniform(*shoves.every)

    def _rewards(
        self, action: Float32[np.ndarray, "12"], *, has_diverged: bool
    ) -> tuple[dict[str, float], bool]:
        """What each term gives, and whether the robot has fallen."""
        plant = self._plant
        state = plant.truth()
        has_fallen = has_diverged or state.tilt > FALLEN_TILT or plant.base_contact_force > TOUCH
        body = 0.0 if has_diverged else plant.base_contact_force + plant.limb_contact_force
        last, period = self._last_action, 1.0 / RATE
        moment = rewards.Moment(state, self._command, action, last, body, has_fallen, period)
        found = rewards.terms(moment)
        weights = self.task.weights
        return {name: weights[name] * period * found[name] for name in weights}, bool(has_fallen)

    def _seen(self) -> Seen:
        phase = self._step / RATE / GAITS["trot"].period % 1.0
        return observed(self.layout, self._plant.read(), self._command, phase, self._last_action)


def _command_of(options: dict[str, Any]) -> Array3 | None:
    if not isinstance(options, dict):
        raise CommandError(f"options of reset are a dictionary, got {options!r:.80}")
    if unknown := options.keys() - {"command"}:
        raise CommandError(unknown_name("option of reset", str(min(unknown)), ["command"]))
    if "command" not in options:
        return None
    command = _numbers(options["command"], 3)
    if command is None or not np.isfinite(command).all():
        raise CommandError(f"a command is three finite numbers, got {options['command']!r}")
    return command


def _numbers(given: object, size: int) -> Float[np.ndarray, " n"] | None:
    """``given`` as ``size`` numbers; None if it is none such."""
    try:
        numbers = np.array(given, dtype=float)
    except (TypeError, ValueError):
        return None
    return numbers if numbers.shape == (size,) else None


def _told(world: World) -> dict[str, float]:
    names = ("friction", "mass_scale", "joint_friction", "delay")
    return {name: float(getattr(world, name)) for name in names}
