"""``Go2VectorEnv``: many environments, stepped together, in the worker processes of sweeps.

Each process keeps an even share of them and steps it in one go; the calling one has a share, too:
it would only wait. An environment whose episode is over is reset by the next step, whose action it
ignores (Gymnasium's ``AutoresetMode.NEXT_STEP``).
"""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from multiprocessing.util import Finalize
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from controller.learning.environment import FRAMES, Go2Env, Info, Step, gymnasium
from controller.observation import RATE
from controller.sweeps.engine import Worker, order_of, processors
from go2_wbc.errors import CommandError, SweepError

Rows = Float32[np.ndarray, "_ _"]
Flags = Bool[np.ndarray, " _"]


class Share:
    """The environments of one worker, made where they are first needed."""

    def __init__(self, count: int, settings: dict[str, Any]) -> None:
        """``count`` of them, with these ``settings`` of ``Go2Env``."""
        self._count, self._settings = count, settings
        self._environments: list[Go2Env] = []
        self._are_over = [False] * count

    def __call__(self, asked: tuple[str, Any]) -> Any:  # noqa: ANN401
        """What they give.

        Args:
            asked: ("step", actions) gives rows of numbers, see ``_row``, and what those
                tell by number that are reset instead; ("reset", seeds and options) and ("render",
                None) what ``Go2Env`` gives, one after the other.

        Raises:
            CommandError: as ``Go2Env``.
        """
        if not self._environments:
            self._environments = [Go2Env(**self._settings) for _ in range(self._count)]
        what, given = asked
        if what == "render":
            return [environment.render() for environment in self._environments]
        if what == "step":
            told: dict[int, Info] = {}
            actions = np.frombuffer(given, dtype=np.float32).reshape(-1, 12)
            rows = [self._step(number, action, told) for number, action in enumerate(actions)]
            return np.array(rows).tobytes(), told
        seeds, options = given
        self._are_over = [False] * self._count
        pairs = zip(self._environments, seeds, strict=True)
        return [environment.reset(seed=seed, options=options) for environment, seed in pairs]

    def _step(
        self, number: int, action: Float32[np.ndarray, "12"], told: dict[int, Info]
    ) -> Float[np.ndarray, " k"]:
        environment = self._environments[number]
        if self._are_over[number]:
            self._are_over[number] = False
            seen, told[number] = environment.reset()
            gains = dict.fromkeys(environment.task.weights, 0.0)
            return _row((seen, 0.0, False, False, {**told[number], "reward_terms": gains}))
        step = environment.step(action)
        self._are_over[number] = step[2] or step[3]
        return _row(step)


def _row(step: Step) -> Float[np.ndarray, " k"]:
    """A step as numbers: reward, is over, is cut, command, terms of the reward, observation.

    Quicker to send than a tuple with dictionaries, and to put together with others.
    """
    seen, reward, is_over, is_cut, info = step
    gains = info["reward_terms"].values()
    return np.concatenate([[reward, is_over, is_cut, *info["command"], *gains], seen])


class Go2VectorEnv(gymnasium.vector.VectorEnv[Rows, np.ndarray, np.ndarray]):
    """``num_envs`` environments in processes; ``gymnasium.make_vec("Go2-v0", 8)`` makes them.

    What they give depends on the seeds alone, not on the number of workers.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012, Gymnasium's own
        "render_modes": [FRAMES],
        "render_fps": RATE,
        "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 2,
        *,
        workers: int | None = None,
        **settings: Any,  # noqa: ANN401
    ) -> None:
        """Start the processes.

        Args:
            num_envs: how many environments.
            workers: processes, this one among them; by default as many as processors.
            settings: of ``Go2Env``.

        Raises:
            CommandError: for a number below 1, or as ``Go2Env``.
        """
        for name, count in (("num_envs", num_envs), ("workers", workers or 1)):
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise CommandError(f"{name} must be a whole number, at least 1, got {count!r}")
        one = Go2Env(**settings)
        one.close()
        self.num_envs, self.render_mode = num_envs, one.render_mode
        self._size, self._terms = one.layout.size, [*one.task.weights]
        self.single_observation_space, self.single_action_space = (
            one.observation_space,
            one.action_space,
        )
        batch = gymnasium.vector.utils.batch_space
        self.observation_space = batch(one.observation_space, num_envs)
        self.action_space = batch(one.action_space, num_envs)
        self._shares = np.array_split(np.arange(num_envs), min(workers or processors(), num_envs))
        shares = [Share(len(part), settings) for part in self._shares]
        self._own, self._workers = shares[-1], [Worker(order_of(share)) for share in shares[:-1]]
        # Also of one that nobody closes: Python would wait for them at its exit.
        self._end = Finalize(self, _end_all, [self._workers], exitpriority=0)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Rows, Info]:
        """Begin an episode everywhere.

        Args:
            seed: of each, or of the first; the others then have the next ones.
            options: as of ``Go2Env.reset``, for all.

        Raises:
            CommandError: for another number of seeds.
            SweepError: if a worker has died, or what it was given is not valid.
        """
        first = seed if isinstance(seed, int) else None
        super().reset(seed=first)
        seeds: Sequence[int | None] = [None] * self.num_envs
        if seed is not None:
            seeds = range(seed, seed + self.num_envs) if isinstance(seed, int) else seed
        if len(seeds) != self.num_envs:
            raise CommandError(f"{self.num_envs} environments want as many seeds, got {len(seeds)}")
        parts = [([seeds[number] for number in part], options) for part in self._shares]
        given = [one for part in self._asked("reset", parts) for one in part]
        info: Info = {}
        for number, (_, own) in enumerate(given):
            info = self._add_info(info, own, number)
        return np.array([seen for seen, _ in given]), info

    def step(self, actions: np.ndarray) -> tuple[Rows, Float[np.ndarray, " _"], Flags, Flags, Info]:
        """A step of each; see ``Go2Env.step``.

        Raises:
            CommandError: for actions of another shape.
            SweepError: as ``reset``.
        """
        actions = np.asarray(actions, dtype=np.float32)
        if actions.shape != (self.num_envs, 12):
            raise CommandError(f"actions must be ({self.num_envs}, 12), got {actions.shape}")
        given = self._asked("step", [actions[part].tobytes() for part in self._shares])
        flat = np.frombuffer(b"".join(rows for rows, _ in given))
        columns = flat.reshape(self.num_envs, -1).T.copy()  # each in memory of its own
        seen = columns[-self._size :].T.astype(np.float32, order="C")
        ends, cuts = columns[1:3].astype(bool)
        info = self._info(columns)
        for part, (_, told) in zip(self._shares, given, strict=True):
            for number, own in told.items():  # of those that were reset instead
                info["_reward_terms"][part[number]] = False
                info = self._add_info(info, own, int(part[number]))
        return seen, columns[0], ends, cuts, info

    def render(self) -> tuple[UInt8[np.ndarray, "h w 3"], ...] | None:
        """A picture of each, if ``render_mode`` asks for it."""
        if self.render_mode is None:
            return None
        given = self._asked("render", [None] * len(self._shares))
        return tuple(picture for part in given for picture in part)

    def close_extras(self, **_: object) -> None:
        """End the processes."""
        self._end()

    def _asked(self, what: str, parts: Sequence[object]) -> list[Any]:
        """What each share gives, all at the same time."""
        for worker, part in zip(self._workers, parts[:-1], strict=True):
            worker.give(pickle.dumps((what, part)))
        own = self._own((what, parts[-1]))
        return [*map(_answered, self._workers), own]

    def _info(self, columns: Float[np.ndarray, "k n"]) -> Info:
        """What Gymnasium's ``_add_info`` would make of the ``info`` of all."""
        have = np.ones(self.num_envs, dtype=bool)
        terms: Info = dict(zip(self._terms, columns[6:], strict=False))
        terms |= dict.fromkeys([f"_{name}" for name in self._terms], have)
        command = columns[3:6].T.copy()
        return {
            "reward_terms": terms,
            "_reward_terms": have,
            "command": command,
            "_command": np.ones(self.num_envs, dtype=bool),
        }


def _end_all(workers: Sequence[Worker]) -> None:
    for worker in workers:
        worker.end()


def _answered(worker: Worker) -> Any:  # noqa: ANN401
    answer = worker.wait()
    if answer is None:
        raise SweepError("a worker of the environments has died: make them anew")
    value, failure = pickle.loads(answer)
    if failure is not None:
        raise SweepError(f"{failure.text}\n{failure.details}")
    return value
