"""Functions that the tests sweep: quick, and known for every seed."""

import math
import os
import re
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np

ODD = [0.1 + 0.2, -0.0, math.nan, math.inf, -math.inf, 5e-324, 1.7976931348623157e308]
"""Floats that are easily lost on the way."""


def trial(seed: int) -> dict[str, object]:
    numbers = np.random.default_rng(seed).normal(size=(40, 40))
    return {
        "x": math.sin(seed),
        "norm": np.linalg.svd(numbers, compute_uv=False).sum(),  # by BLAS: its threads decide
        "n": seed * seed,
        "ok": seed % 3 == 0,
        "word": "ü" * (seed % 4),
    }


def odd_floats(seed: int) -> dict[str, object]:
    return {"value": ODD[seed % len(ODD)]}


def raise_on_5(seed: int) -> dict[str, object]:
    if seed == 5:
        raise ValueError("five is too much")
    return trial(seed)


def die_on_5(seed: int) -> dict[str, object]:
    if seed == 5:
        os.kill(os.getpid(), signal.SIGSEGV)
    return trial(seed)


def exit_on_5(seed: int) -> dict[str, object]:
    if seed == 5:
        os._exit(9)
    return trial(seed)


def die_once(seed: int) -> dict[str, object]:
    """Dies with seed 3 as long as the file named by the variable is not there."""
    file = Path(os.environ["GO2_WBC_TEST_FILE"])
    if seed == 3 and not file.exists():
        file.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return trial(seed)


def talk(seed: int) -> dict[str, object]:
    print("printed", seed)
    sys.stdout.flush()
    return trial(seed)


def threads(seed: int) -> dict[str, object]:
    return {"blas": os.environ["OPENBLAS_NUM_THREADS"], "hash": os.environ["PYTHONHASHSEED"]}


def process(seed: int) -> dict[str, object]:
    return {"pid": os.getpid(), "parent": os.getppid()}


def surroundings(seed: int) -> dict[str, object]:
    """What a worker has from its parent, and the threads of the process that has forked it."""
    status = Path(f"/proc/{os.getppid()}/status").read_text()
    return {
        "folder": str(Path.cwd()),
        "variable": os.environ.get("GO2_WBC_TEST_VARIABLE", ""),
        "place": sys.path[-1],
        "robot": "pinocchio" in sys.modules,
        "threads": int(status.partition("Threads:")[2].split()[0]),
        "number": float(np.random.random()),  # noqa: NPY002 - nobody has seeded it
    }


def slow(seed: int) -> dict[str, object]:
    """Long enough that a test can kill its parent in the middle."""
    end = time.process_time() + 0.01
    while time.process_time() < end:
        pass
    return trial(seed)


def wait_for_ever(seed: int) -> dict[str, object]:
    threading.Event().wait()
    return {}


def stuck(seed: int) -> dict[str, object]:
    """Tells its number in the file named by the variable, then lets no other thread run."""
    Path(os.environ["GO2_WBC_TEST_FILE"]).write_text(str(os.getpid()))
    re.match("(a+)+$", "a" * 60 + "b")
    return {}


def no_row(seed: int) -> object:
    return [seed]
