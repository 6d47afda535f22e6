"""How often a motion is done in random worlds, told run by run while it is counted."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from controller.studio.orders import STOPPED, Doing
from go2_wbc.errors import StudioError
from go2_wbc.world import DOUBTFUL, World
from viz.content import ReplayContent

if TYPE_CHECKING:
    from controller.sweeps.run import Progress
    from controller.sweeps.sweep_file import Row
    from viz.content import CertifiedRate
    from viz.replay.page_data import Prepared

RUNS = (20, 50, 100, 200)  #: How many runs a page offers
MOST_RUNS = 1000  #: That may be asked for


def runs_of(order: Mapping[str, object]) -> int:
    """How many an order asks for; raises StudioError for no number from 1 to ``MOST_RUNS``."""
    runs = order.get("runs")
    if type(runs) is not int or not 1 <= runs <= MOST_RUNS:
        raise StudioError(f"runs are a number from 1 to {MOST_RUNS}, got {runs!r:.40}")
    return runs


def around(world: World) -> World:
    """The world with what is usually not known of floor, mass and joints, as ``certify`` has it."""
    chosen = {name: getattr(world, name) for name in ("friction", "payload", "sensors")}
    return replace(DOUBTFUL, **chosen)


def certified(
    write: Callable[[Path], object],
    order: Mapping[str, object],
    world: World,
    tell: Callable[[Doing], None],
    ending: threading.Event,
) -> CertifiedRate:
    """Play a motion in random worlds, as ``certify`` does.

    Args:
        write: writes the plan of the motion into a file.
        order: how many ``runs``.
        world: that is drawn around.
        tell: hears of every run.
        ending: ends it, when the runs that go on are over.

    Raises:
        StudioError: if it was ended, or for a number of runs that is none.
        CommandError, SweepError: what ``certify`` raises.
    """
    from controller.sweeps.certify import certified_rate, read_certificate
    from controller.sweeps.run import sweep
    from controller.sweeps.summary import rate_interval
    from controller.sweeps.targets import motion_target
    from motions import load_plan

    def count(rows: Sequence[Row]) -> bool:
        done = sum(bool(row["done"]) for row in rows)
        low, high = rate_interval(done, len(rows))
        tell(Doing("certifying", len(rows), runs, (done, low, high)))
        return False

    def heed(_: Progress) -> None:
        if ending.is_set():
            raise StudioError(STOPPED)

    runs = runs_of(order)
    tell(Doing("certifying", 0.0, runs))
    with TemporaryDirectory() as folder:
        file, out = Path(folder, "saved.plan"), Path(folder, "rows.sqlite")
        write(file)
        plan = load_plan(file)
        sweep(
            motion_target(plan, world=around(world)),
            runs,
            out=out,
            is_enough=count,
            on_progress=heed,
        )
        return certified_rate(read_certificate(out), plan)


def row_of(rate: CertifiedRate, motion: str, base: str) -> dict[str, object]:
    """A line of the page's table: of which text, motion and world, and what came of it."""
    known = {"n": rate.n, "done": rate.done, "interval": rate.interval, "world": rate.world}
    known["why"] = rate.why
    return {**known, "motion": motion, "base": base}


def with_rate(
    content: ReplayContent | Prepared, rate: CertifiedRate | None
) -> ReplayContent | Prepared:
    """What is shown, with the rate beside its verdict, if there are both."""
    if rate is None:
        return content
    if isinstance(content, ReplayContent):
        verdict = content.verdict and replace(content.verdict, certified=rate)
        return replace(content, verdict=verdict)
    header: dict[str, Any] = dict(content.header)
    if header["verdict"] is not None:
        header["verdict"] = {**header["verdict"], "certified": asdict(rate)}
    return replace(content, header=header)
