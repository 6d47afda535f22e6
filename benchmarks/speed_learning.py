"""How fast learners get what they learn from: environments, many of them, and data sets.

Rows of ``python -m benchmarks speed``.
"""

import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from benchmarks.study import TrialResult
from controller.learning import ENVIRONMENTS, Go2Env, Go2VectorEnv, read_dataset, record
from controller.observation import ACTIONS, RATE
from controller.sweeps.trials import Trial, TrialFailed

STEPS = 1000  #: Of each measurement
ROUNDS = 5  #: One, two and many environments in turn
MANY = 8
SPREAD = 0.3  #: Of the random actions: the robot stumbles about and rarely falls
ENVIRONMENTS_TABLE = {
    "one environment, 50 actions a second, processor time": tuple(
        (f"{name}.{kind}", f"{name}, {kind}: times real time", bar)
        for name in ENVIRONMENTS
        for kind, bar in zip(ACTIONS, (">= 20", ">="), strict=True)
    ),
    "environments together, on two cores": (
        ("two", "two, times one, by the clock", ">= 1.8"),
        ("many", f"{MANY}, times one, by the clock", ">="),
    ),
}
MINUTES = 10.0
DATASET_TABLE = {
    f"data set of {MINUTES:g} minutes of the trot, on two cores": (
        ("time", "time by the clock", "<= 60 s"),
        ("rows", "rows", ">= 30000"),
    )
}


def measure_environments(_trial: Trial, found: TrialResult) -> None:
    """Random actions; what a reset after a fall takes is in it."""
    actions = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (STEPS, MANY, 12))
    actions = actions.astype(np.float32)
    for name, task in ENVIRONMENTS.items():
        for kind in ACTIONS:
            with closing(Go2Env(task, kind)) as environment:
                _spent(environment, actions[:50], time.process_time)
                spent = _spent(environment, actions, time.process_time)
                found.values[f"{name}.{kind}"] = STEPS / RATE / spent
    together = [closing(Go2VectorEnv(count, workers=2)) for count in (2, MANY)]
    with closing(Go2Env()) as one, together[0] as two, together[1] as many:
        ratios = [
            [_spent(one, actions) * envs.num_envs / _spent(envs, actions) for envs in (two, many)]
            for _ in range(ROUNDS)
        ]
    found.values |= dict(zip(("two", "many"), np.median(ratios, axis=0).tolist(), strict=True))


def _spent(
    environment: Go2Env | Go2VectorEnv,
    actions: Float32[np.ndarray, "n k 12"],
    clock: Callable[[], float] = time.perf_counter,
) -> float:
    """Time [s] that all steps take."""
    is_one = isinstance(environment, Go2Env)
    environment.reset(seed=0)
    start = clock()
    for action in actions:
        if is_one:
            _, _, has_fallen, is_late, _ = environment.step(action[0])
            if has_fallen or is_late:
                environment.reset()
        else:
            environment.step(action[: environment.num_envs])
    return clock() - start


def measure_dataset(_trial: Trial, found: TrialResult) -> None:
    """Ten minutes of robot time; starting the processes is in it."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        path = record(Path(folder, "trot.parquet"), minutes=MINUTES, workers=2)
        found.values["time"] = time.perf_counter() - start
        rows = read_dataset(path)
    if rows["fell"].any():
        raise TrialFailed(f"the expert fell in {len(set(rows['seed'][rows['fell']]))} episodes")
    found.values["rows"] = float(len(rows))
