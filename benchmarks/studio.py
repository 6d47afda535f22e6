"""``python -m benchmarks studio``: how soon the page of the studio shows what a hand does.

A seed is a motion that nobody has tuned to: moves drawn at random, until it is long enough. In a
headless Chromium the pointer drags the ends of its bars; an edit is one move of the pointer, and it
has arrived when page, bars and verdict are those of the new text. The 3D view is not drawn: in
software a frame takes longer than all of the rest. Wants an idle machine.
"""

import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.study import Study, TrialResult
from controller.sweeps.trials import Trial
from tests.live_preview import LivePreview
from tests.viz.replay.browsing import Tab, chromium

EDITS, EDITS_A_DRAG = 200, 20
LENGTHS = (10, 30, 60)  # [s]
LEAST_LOAD = 0.05  # s of processor time in a second: less is that of waiting
REACH, STEP = 50, 10
"""How far the end of a bar is dragged, and by how much at a time [px]: its length changes."""
MOVES = (
    ".body(z={z:.3f}, pitch={angle:.3f}, over={over:.2f})",
    ".body(yaw={angle:.3f}, over={over:.2f}).home(over=0.6)",
    '.foot("{leg}", z={up:.3f}, over={over:.2f}).down("{leg}", over=0.5)',
    ".hold({over:.2f}).home(over=0.6)",
)
STEPS = (
    '.home(over=0.6).step("{leg}", {ahead:.3f}, over={over:.2f})',
    ".home(over=0.6).walk({ahead:.3f}, gait='trot')",
)
HEAD = '''"""One of many."""

from motions import Timeline, motion


@motion
def drawn() -> Timeline:
    """Drawn."""
    line = Timeline()
'''
SETTLED = "!studio.isBusy && !studio.waiting"
WATCH = """(() => {
  window.waits = [];
  window.addEventListener("pointermove", () => { window.moved = performance.now(); }, true);
  const shown = studio.redrawDraft.bind(studio);
  studio.redrawDraft = (draft) => { shown(draft); waits.push(performance.now() - moved); };
})()"""
ROWS = {
    "plain": lambda seconds: (
        ("median", "pointer to page, median", "ms"),
        ("p95", "pointer to page, p95", f"<= {150 if seconds == LENGTHS[-1] else 120} ms"),
        ("cpu", "server's processor time, median", "<= 45 ms"),
        ("cpu_p95", "server's processor time, p95", "<= 80 ms"),
    ),
    "steps": lambda _: (
        ("median", "pointer to page, median", "ms"),
        ("p95", "pointer to page, p95", "ms"),
        ("cpu", "server's processor time, median", "<= 60 ms"),
        ("cpu_p95", "server's processor time, p95", "ms"),
    ),
}


def drawn(seed: int, seconds: float, kind: str) -> str:
    """The text of a motion of about this length; ``kind`` "steps" has steps and trots, too."""
    rng = np.random.default_rng([seed, int(seconds)])
    moves, lines, length = (*MOVES, *STEPS) if kind == "steps" else MOVES, list[str](), 0.0
    while length < seconds - 2.0:
        move, over = str(rng.choice(moves)), rng.uniform(0.4, 1.2)
        values = {
            "z": rng.uniform(-0.04, 0.01),
            "angle": rng.uniform(-0.12, 0.12),
            "up": rng.uniform(0.05, 0.12),
            "ahead": rng.uniform(0.04, 0.2),
            "over": over,
            "leg": str(rng.choice(["FL", "FR", "RL", "RR"])),
        }
        lines.append(f"    line = line{move.format(**values)}\n")
        length += over + (0.6 if "home" in move else 0.0) + (2.0 if "walk" in move else 0.0)
        length += 1.7 if "foot" in move or "step" in move else 0.0  # shifts before, and down
    body = "".join(lines)
    return f"{HEAD}{body}    return line.home(over=0.8)\n"


def processor_time(process: int) -> float:
    """What a process and its children have used [s]."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="ascii")
    clock = (~process << 3) | 2  # what clock_getcpuclockid(3) gives
    return time.clock_gettime(clock) + sum(processor_time(int(one)) for one in children.split())


def rest(process: int) -> None:
    """Wait until a process has loaded what it loads meanwhile, which no edit has asked for."""
    used, now = -np.inf, processor_time(process)
    while now - used > LEAST_LOAD:
        time.sleep(1.0)
        used, now = now, processor_time(process)


def measure(trial: Trial, found: TrialResult, seconds: int, kind: str) -> None:
    """Drag the ends of bars of a motion, and wait each time for what comes of it."""
    rng = np.random.default_rng([trial.seed, seconds, 1])
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        file = Path(folder) / "drawn.py"
        file.write_text(drawn(trial.seed, seconds, kind), encoding="utf-8")
        with LivePreview(str(file), command="studio") as opened, Tab(browser) as tab:
            tab.open(opened.url)
            tab.wait_for("window.studio && replay.version")
            tab.evaluate("studio.tour.end()")
            tab.evaluate(WATCH)
            rest(opened.process_id)
            used = partial(processor_time, opened.process_id)
            times = np.array([drag(tab, rng, used) for _ in range(EDITS // EDITS_A_DRAG)])
            waits = np.array(tab.evaluate("waits"))
            found.notes["length"] = f"{tab.evaluate('replay.data.duration'):.1f} s"
            found.notes["edits"] = str(len(waits))
    found.values["median"] = float(np.median(waits))
    found.values["p95"] = float(np.quantile(waits, 0.95))
    found.values["cpu"] = 1000.0 * float(np.median(times))
    found.values["cpu_p95"] = 1000.0 * float(np.quantile(times, 0.95))


def drag(tab: Tab, rng: np.random.Generator, used: Callable[[], float]) -> Sequence[float]:
    """Drag the end of one bar to and fro, and leave it where it was; what is used for each edit."""
    edges = tab.page.locator(".bar:not(.foreign) em")
    edge = edges.nth(int(rng.integers(edges.count())))
    box = edge.bounding_box() or {}
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    times = [used()]
    steps = np.cumsum(rng.integers(1, REACH // STEP - 1, EDITS_A_DRAG - 1)) % (REACH // STEP - 1)
    for offset in (*(STEP * (1 + steps)).tolist(), 0):
        count = tab.evaluate("waits.length")
        tab.page.mouse.move(x + offset, y)
        tab.wait_for(
            f"(waits.length > {count} || studio.tools.say.className === 'bad') && {SETTLED}"
        )
        times.append(used())
    tab.page.mouse.up()
    tab.wait_for(SETTLED)
    return np.diff(times).tolist()


WORDS = {"plain": "paws and trunk", "steps": "steps and trots, too"}
STUDIES = tuple(
    Study(f"{kind}-{seconds}", {f"{seconds} s of {WORDS[kind]}": rows(seconds)}, one, sensors=None)
    for kind, rows in ROWS.items()
    for seconds in LENGTHS
    for one in (partial(measure, seconds=seconds, kind=kind),)
)
run = Benchmark(
    name="studio",
    description="How soon the studio's page shows what a hand does, in a headless Chromium.",
    studies=STUDIES,
    takes="about ten minutes",
    examples=("plain-10 --runs 3", "--json --out studio.json"),
    runs=1,
).run
