"""What a page makes of the block that it has is, to the byte, the block that was meant."""

import numpy as np
import pytest

from tests.viz.page_reader import read_message, read_pack
from viz.replay.packing import Pack, Packed, message

ARRAYS = {"q": (2, 7), "margin": (1, 1), "worst": (1, 3), "none": (1, 0)}
"""Of what a page shows: whether it is stored in 16 bits, and its width."""


def drawn(rng: np.random.Generator, rows: int = 400) -> dict[str, np.ndarray]:
    return {name: rng.normal(size=(rows, width)) for name, (_, width) in ARRAYS.items()}


def edited(arrays: dict[str, np.ndarray], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Some rows changed, taken out or put in, at one place that all of them have."""
    first, last = np.sort(rng.integers(0, len(arrays["q"]), 2)).tolist()
    more = int(rng.integers(0, 30))
    return {
        name: np.vstack([old[:first], rng.normal(size=(more, old.shape[1])), old[last:]])
        for name, old in arrays.items()
    }


def packed(arrays: dict[str, np.ndarray], note: object) -> Packed:
    pack = Pack()
    for name, array in arrays.items():
        if ARRAYS[name][0] == 2:
            pack.add_quantised(name, array)
        else:
            pack.add(name, array.astype(np.float32))
    return pack.packed({"note": note})


@pytest.mark.parametrize("seed", range(20))
def test_changes_make_the_whole_of_what_a_page_has(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arrays = drawn(rng)
    old = packed(arrays, "a")
    for k in range(10):
        if rng.random() < 0.2:
            arrays.pop(str(rng.choice(list(arrays))), None)  # such as a limit that is not asked
        if not len(arrays.get("q", ())):
            arrays = drawn(rng, int(rng.integers(2, 400)))
        arrays = edited(arrays, rng)
        new = packed(arrays, list(range(k)))
        told, made = read_message(message({"told": k}, new, old), old.data)
        assert (told["told"], made) == (k, new.data)
        assert read_message(message({}, new))[1] == new.data, "to a page that has nothing"
        old = new


def test_what_has_not_changed_is_not_sent() -> None:
    rng = np.random.default_rng(0)
    arrays = drawn(rng)
    old = packed(arrays, "")
    arrays["margin"] = arrays["margin"].copy()
    arrays["margin"][200] += 0.1
    new = packed(arrays, "")
    assert len(message({}, new)) > 10_000
    assert len(message({}, new, old)) < 500


def test_arrays_that_are_equal_are_stored_once() -> None:
    times, pack = np.arange(1000.0), Pack()
    for k in range(5):
        pack.add(f"{k}", times)
    data = pack.packed({}).data
    assert len(data) < 10_000
    _, arrays = read_pack(data)
    assert all(np.array_equal(arrays[f"{k}"], times) for k in range(5))


def test_arrays_that_only_begin_alike_are_each_stored() -> None:
    times, pack = np.arange(1000.0), Pack()
    others = [np.where(times < 1000 - k, times, -times) for k in range(5)]
    for k, other in enumerate(others):
        pack.add(f"{k}", other)
    _, arrays = read_pack(pack.packed({}).data)
    assert all(np.array_equal(arrays[f"{k}"], other) for k, other in enumerate(others))
