"""Environments stepped together in processes give what they give alone."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason='needs pip install "go2-wbc[learning]"')

import gymnasium

from controller.learning import Go2Env, Go2VectorEnv
from go2_wbc.errors import CommandError, SweepError

ACTIONS = np.random.default_rng(0).uniform(-0.3, 0.3, (8, 3, 12)).astype(np.float32)


def test_each_gives_what_it_gives_alone_and_is_reset_by_the_step_after_its_end() -> None:
    together = gymnasium.make_vec("Go2-v0", num_envs=3, workers=2, episode_time=0.1)
    seen, infos = together.reset(seed=5)
    alone = [Go2Env(episode_time=0.1) for _ in range(3)]
    for number, environment in enumerate(alone):
        own, info = environment.reset(seed=5 + number)
        assert np.array_equal(seen[number], own)
        assert infos["world"]["friction"][number] == info["world"]["friction"]
    for step, actions in enumerate(ACTIONS):
        seen, rewards, ends, cuts, infos = together.step(actions)
        for number, environment in enumerate(alone):
            if step == 5:
                own, info = environment.reset()
                assert infos["world"]["friction"][number] == info["world"]["friction"]
                expected = (0.0, False, False)
            else:
                own, *expected, info = environment.step(actions[number])
                for name, gain in info["reward_terms"].items():
                    assert infos["reward_terms"][name][number] == gain
                assert np.array_equal(infos["command"][number], info["command"])
            steps = infos["_reward_terms"][number], infos["reward_terms"]["_turn"][number]
            assert steps == (step != 5, step != 5)
            assert infos["_command"][number]
            assert ("_world" in infos) == (step == 5)
            assert np.array_equal(seen[number], own)
            assert (rewards[number], ends[number], cuts[number]) == tuple(expected)
        assert cuts.all() == (step == 4)
    assert together.observation_space.contains(seen)
    assert together.action_space.contains(ACTIONS[0])
    together.close()
    together.close()


def test_one_that_nobody_closes_ends_with_its_program() -> None:
    program = (
        "from controller.learning import Go2VectorEnv; envs = Go2VectorEnv(2, workers=2); "
        "print(envs.reset(seed=0)[0].shape); kept = [envs]; kept.append(kept); raise SystemExit(3)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=120)
    assert (done.returncode, done.stdout) == (3, b"(2, 50)\n"), done.stderr


def test_wrong_numbers_are_named_and_so_is_a_worker_that_dies() -> None:
    for number, workers, task in ((0, 1, "push"), (1, -1, "push"), (1, 1, "swim")):
        with pytest.raises(CommandError):
            Go2VectorEnv(number, workers=workers, task=task)
    together = Go2VectorEnv(2, workers=2)
    with pytest.raises(CommandError, match="seeds"):
        together.reset(seed=[1])
    together.reset(seed=0)
    with pytest.raises(CommandError, match=r"\(2, 12\)"):
        together.step(np.zeros((1, 12), dtype=np.float32))
    with pytest.raises(SweepError, match="finite"):
        together.step(np.stack([np.full(12, np.nan), np.zeros(12)]).astype(np.float32))
    os.kill(together._workers[0]._process.pid or 0, signal.SIGKILL)
    for _ in range(2):
        with pytest.raises(SweepError, match=r"environments \[0\] has died \(killed by SIGKILL\)"):
            together.step(np.zeros((2, 12), dtype=np.float32))
    together.close()
    with pytest.raises(SweepError, match="closed"):
        together.reset(seed=0)


def test_after_an_action_that_is_refused_nobody_is_told_of_the_step_before() -> None:
    """Of the calling process's own share it was: the workers' answers waited for the next step."""
    together, alone = Go2VectorEnv(2, workers=2), Go2Env()
    together.reset(seed=0)
    with pytest.raises(CommandError, match="finite"):
        together.step(np.stack([np.zeros(12), np.full(12, np.nan)]).astype(np.float32))
    seen, _ = together.reset(seed=3)
    assert np.array_equal(seen[0], alone.reset(seed=3)[0])
    for actions in ACTIONS:
        seen, *_ = together.step(actions[:2])
        assert np.array_equal(seen[0], alone.step(actions[0])[0])
    together.close()
