"""What code once said, kept in files: a test fails where it says anything else.

After a change that is meant, ``GO2_WBC_RECORD=1 python -m pytest -n 0 FILE`` records anew. What the
processor's own rounding decides, as which of two equal margins is the least, is kept as null, and
not compared; found by recording under ``OPENBLAS_CORETYPE=Prescott``, ``Haswell`` and ``Zen``.
"""

import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

NEAR = 1e-6
"""Of the greater of 1 and a number: libraries differ in the last bits, and sums of their values."""


def digest(value: object) -> float | str:
    """A number of numbers, which depends on each and on their order; of a long text a checksum."""
    if isinstance(value, str):
        return value if len(value) < 60 else f"{zlib.crc32(value.encode()):08x}"
    array = np.asarray(value, dtype=float).ravel()
    numbers = np.nan_to_num(array, nan=-7.0, posinf=7.0, neginf=-9.0)
    return float(f"{numbers @ (1.5 + np.cos(np.arange(numbers.size))) + numbers.size:.7g}")


def assert_as_recorded(file: Path, case: str, told: Mapping[str, object]) -> None:
    """``told`` must be what ``file`` keeps of it: numbers, arrays and texts by their names."""
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    now = {name: digest(value) for name, value in told.items()}
    if os.environ.get("GO2_WBC_RECORD") == "1":
        open_ = {name: None for name, value in kept.get(case, {}).items() if value is None}
        kept = dict(sorted({**kept, case: {**now, **open_}}.items()))
        lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(kept[name])}" for name in kept)
        file.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    assert case in kept, f"{case} is not recorded: see this module's docstring"
    assert now.keys() == kept[case].keys()
    for name, value in now.items():
        before = kept[case][name]
        if before is None:
            continue
        if isinstance(value, str) or isinstance(before, str):
            assert value == before, f"{case}, {name}: {told[name]}"
        else:
            off = abs(value - before) / max(1.0, abs(before))
            assert off <= NEAR, f"{case}, {name}: {value} for {before}"
