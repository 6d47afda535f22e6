"""The benchmark of the studio draws motions that can be made, and counts all processor time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.studio import drawn, processor_time
from motions.registry import load_text

BUSY = "import time\nwhile time.process_time() < 0.3: pass\nprint(flush=True)\ntime.sleep(60)"


@pytest.mark.parametrize("kind", ["plain", "steps"])
@pytest.mark.parametrize("seconds", [10, 30])
def test_a_seed_is_a_motion_of_about_that_length(kind: str, seconds: int, tmp_path: Path) -> None:
    texts = [drawn(seed, seconds, kind) for seed in (0, 0, 1)]
    assert texts[0] == texts[1] != texts[2]
    for text in texts[1:]:
        (motion,) = load_text(tmp_path / "drawn.py", text.encode()).values()
        assert motion().end == pytest.approx(seconds, rel=0.35)
    assert ("step(" in texts[2] or "walk(" in texts[2]) == (kind == "steps")


def test_children_are_counted() -> None:
    before = processor_time(os.getpid())
    with subprocess.Popen([sys.executable, "-c", BUSY], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        assert processor_time(os.getpid()) - before > 0.25
        child.kill()
