"""Many trials on all cores: each seed draws a world of its own, each process runs its share.

"spawn" starts clean processes on every system; what they run must be a function of this file, and
the work must lie below the last `if`.
"""

import math
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant

TRIALS, DISTANCE = 6, 0.5  # m


@dataclass(frozen=True)
class Trial:
    """A world and what came of it."""

    seed: int
    friction: float
    payload: float
    ok: bool
    error: float  # m, off the distance that was asked


def run(seed: int) -> Trial:
    """Walk ``DISTANCE`` in the world of ``seed``."""
    rng = np.random.default_rng(seed)
    friction, payload = rng.uniform(0.4, 1.0), rng.uniform(0.0, 2.0)
    plant = MujocoPlant(friction=friction, payload=payload, initial_joint_noise=0.02, seed=seed)
    with GO2Controller(plant=plant) as go2:
        stood, start = go2.stand(), go2.state.p_world_base[:2].copy()
        ok = stood and go2.move_forward(DISTANCE)
        error = abs(math.dist(start, go2.state.p_world_base[:2]) - DISTANCE)
    return Trial(seed, friction, payload, ok, error)


if __name__ == "__main__":
    workers = os.cpu_count() or 1
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        trials = list(pool.map(run, range(TRIALS)))
    for trial in trials:
        world = f"friction {trial.friction:.2f}, payload {trial.payload:.1f} kg"
        print(f"seed {trial.seed}: {world}: {trial.ok}, {1000 * trial.error:.1f} mm off")
    done = sum(trial.ok for trial in trials)
    print(f"{done} of {TRIALS} done in {workers} processes")
    if done < TRIALS:
        raise SystemExit("a trial was not done")
