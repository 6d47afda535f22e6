"""``Go2VectorEnv``: many environments, stepped together, in the worker processes of sweeps.

Each process has an even share of the environments and steps them in one go; so does the calling
process, which would only wait otherwise. An environment whose episode is over is reset by the next
step, whose action it ignores (Gymnasium's ``AutoresetMode.NEXT_STEP``).
"""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Sequence
from multiprocessing.sharedctypes import RawArray
from multiprocessing.util import Finalize
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from controller.learning.environment import FRAMES, Go2Env, Info, gymnasium
from controller.observation import RATE
from controller.sweeps.engine import Worker, order_of, processors
from go2_wbc.errors import CommandError, SweepError

Rows = Float32[np.ndarray, "_ _"]
Flags = Bool[np.ndarray, " _"]
Memory = tuple[Any, Any, Any]
"""What all processes see: actions, observations, and what else steps tell, see ``Board``."""
STEP = pickle.dumps(("step", None))


class Board:
    """Rows of numbers in memory that all processes see, one for each environment.

    Attributes:
        actions: what is to be done.
        seen: observations.
        told: reward, is over, is cut, command (3), terms of the reward.
    """

    def __init__(self, memory: Memory, count: int) -> None:
        actions, seen, told = memory
        self.actions = np.frombuffer(actions, dtype=np.float32).reshape(count, -1)
        self.seen = np.frombuffer(seen, dtype=np.float32).reshape(count, -1)
        self.told = np.frombuffer(told, dtype=np.float64).reshape(count, -1)

    @staticmethod
    def memory(count: int, size: int, terms: int) -> Memory:
        """For observations of ``size`` numbers, and so many terms of the reward.

        It has no name, so nothing is left of it when the last process ends, however that came.
        """
        return (
            RawArray("f", count * 12),
            RawArray("f", count * size),
            RawArray("d", count * (6 + terms)),
        )


class Share:
    """The environments of one worker, made where they are first needed."""

    def __init__(self, numbers: Sequence[int], count: int, settings: dict[str, Any]) -> None:
        """Those with these ``numbers``, of ``count`` in all, with ``settings`` of ``Go2Env``."""
        self._numbers, self._count, self._settings = numbers, count, settings
        self._environments: list[Go2Env] = []
        self._are_over = [False] * len(numbers)

    def __call__(self, asked: tuple[str, Any], memory: Memory) -> Any:  # noqa: ANN401
        """What they give.

        Args:
            asked: ("step", None) puts what comes of the actions on the board, and gives what those
                tell, by number, that are reset instead; ("reset", seeds and options) and ("render",
                None) give what ``Go2Env`` does, one after the other.
            memory: of the board.

        Raises:
            CommandError: as ``Go2Env``.
        """
        if not self._environments:
            self._environments = [Go2Env(**self._settings) for _ in self._numbers]
            self._board = Board(memory, self._count)
        what, given = asked
        if what == "render":
            return [environment.render() for environment in self._environments]
        if what == "step":
            told: dict[int, Info] = {}
            for place, number in enumerate(self._numbers):
                self._step(place, number, told)
            return told
        seeds, options = given
        self._are_over = [False] * len(self._numbers)
        pairs = zip(self._environments, seeds, strict=True)
        return [environment.reset(seed=seed, options=options) for environment, seed in pairs]

    def _step(self, place: int, number: int, told: dict[int, Info]) -> None:
        environment, board = self._environments[place], self._board
        if self._are_over[place]:
            self._are_over[place] = False
            seen, told[number] = environment.reset()
            board.told[number] = 0.0
            board.told[number, 3:6] = environment.command
        else:
            seen, reward, is_over, is_cut, info = environment.step(board.actions[number])
            self._are_over[place] = is_over or is_cut
            gains = info["reward_terms"].values()
            board.told[number] = [reward, is_over, is_cut, *info["command"], *gains]
        board.seen[number] = seen


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
        self._terms = [*one.task.weights]
        self.single_observation_space, self.single_action_space = (
            one.observation_space,
            one.action_space,
        )
        batch = gymnasium.vector.utils.batch_space
        self.observation_space = batch(one.observation_space, num_envs)
        self.action_space = batch(one.action_space, num_envs)
        self._shares = np.array_split(np.arange(num_envs), min(workers or processors(), num_envs))
        shares = [Share(part.tolist(), num_envs, settings) for part in self._shares]
        self._memory = Board.memory(num_envs, one.layout.size, len(self._terms))
        self._board, self._own = Board(self._memory, num_envs), shares[-1]
        self._workers = [Worker(order_of(share), self._memory) for share in shares[:-1]]
        self._trouble = ""  # why they cannot be stepped any more
        # Also of one that nobody closes: Python would wait for them at its exit.
        self._end = Finalize(self, lambda all: [one.end() for one in all], [self._workers], None, 0)

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
        *orders, own = [("reset", part) for part in parts]
        given = [one for part in self._asked(map(pickle.dumps, orders), own) for one in part]
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
        self._board.actions[:] = actions
        given = self._asked([STEP] * len(self._workers), ("step", None))
        columns = self._board.told.T.copy()  # each in memory of its own
        ends, cuts = columns[1:3].astype(bool)
        info = self._info(columns)
        for told in given:
            for number, own in told.items():  # of those that were reset instead
                info["_reward_terms"][number] = False
                info = self._add_info(info, own, number)
        return self._board.seen.copy(), columns[0], ends, cuts, info

    def render(self) -> tuple[UInt8[np.ndarray, "h w 3"], ...] | None:
        """A picture of each, if ``render_mode`` asks for it."""
        if self.render_mode is None:
            return None
        order = ("render", None)
        given = self._asked([pickle.dumps(order)] * len(self._workers), order)
        return tuple(picture for part in given for picture in part)

    def close_extras(self, **_: object) -> None:
        """End the processes."""
        self._trouble = "the environments are closed"
        self._end()

    def _asked(self, items: Iterable[bytes], own: tuple[str, Any]) -> list[Any]:
        """What each share gives, all at the same time; ``items`` are for the workers."""
        if self._trouble:
            raise SweepError(f"{self._trouble}: make them anew")
        self._trouble = "a step of the environments was interrupted"
        for worker, item in zip(self._workers, items, strict=True):
            worker.give(item)
        try:
            given = self._own(own, self._memory)
        finally:  # whatever came of the own: nobody may wait for these with the next step
            answers = [worker.wait() for worker in self._workers]
            self._trouble = ""
        return [*map(self._answered, range(len(answers)), answers), given]

    def _answered(self, number: int, answer: bytes | None) -> Any:  # noqa: ANN401
        if answer is None:
            part, how = self._shares[number].tolist(), self._workers.pop(number).end()
            self._end()
            self._trouble = f"the process of environments {part} has died ({how})"
            raise SweepError(f"{self._trouble}: make them anew")
        value, failure = pickle.loads(answer)
        if failure is not None:
            raise SweepError(f"{failure.text}\n{failure.details}")
        return value

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
