"""How often a motion is done in random worlds, as the studio counts it."""

import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pytest

from controller.studio.certifying import around, certified, runs_of
from controller.studio.orders import STOPPED, Doing
from controller.studio.session import Studio
from controller.sweeps import certify, run
from controller.sweeps.motion_study import MotionStudy
from controller.sweeps.summary import rate_interval
from controller.sweeps.sweep_file import Row
from controller.sweeps.targets import Target
from go2_wbc.errors import StudioError
from go2_wbc.world import DOUBTFUL, World
from motions import load_plan
from tests.held.make import STORED
from tests.viz.page_reader import read_data, read_message, read_pack
from viz.content import CertifiedRate

NOD = '''"""Nods."""

from motions import Timeline, deg, motion


@motion
def nod() -> Timeline:
    """Nod."""
    return Timeline().body(pitch=deg(6.0), over=0.5).home(over=0.5)
'''
RUNS = 4


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    path = tmp_path_factory.mktemp("studio") / "nod.py"
    path.write_text(NOD, encoding="utf-8")
    with Studio(path, None, 0) as opened, pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "processors", lambda: 1)  # another worker starts longer than it runs
        yield opened


@pytest.mark.parametrize("runs", [0, 7.5, True, "20", None, 1001])
def test_only_so_many_runs_may_be_asked_for(runs: object) -> None:
    with pytest.raises(StudioError, match="runs are a number from 1 to 1000"):
        runs_of({"runs": runs})


def test_worlds_are_drawn_around_the_one_that_is_chosen() -> None:
    assert around(World()) == DOUBTFUL
    own = around(World(friction=0.3, payload=2.0, sensors="imu"))
    assert (own.friction, own.payload, own.sensors) == (0.3, 2.0, "imu")
    assert own.friction_uncertainty == DOUBTFUL.friction_uncertainty


def test_that_it_begins_is_told_before_the_plan_is_written() -> None:
    told = list[Doing]()

    def refuse(_: Path) -> None:
        assert told == [Doing("certifying", 0.0, RUNS)]
        raise StudioError("no plan")

    with pytest.raises(StudioError, match="no plan"):
        certified(refuse, {"runs": RUNS}, World(), told.append, threading.Event())


@pytest.mark.parametrize("ends", [False, True])
def test_runs_are_counted_as_they_come_until_it_is_ended(
    monkeypatch: pytest.MonkeyPatch, *, ends: bool
) -> None:
    told, ending, done = list[Doing](), threading.Event(), (True, False, True)

    def swept(
        target: Target,
        n: int,
        *,
        out: Path,
        is_enough: Callable[[Sequence[Row]], bool],
        on_progress: Callable[[object], None],
    ) -> None:
        study = target.function
        assert isinstance(study, MotionStudy)
        assert (n, study.world) == (RUNS, around(World(friction=0.3)))
        out.touch()
        for k in (1, 2, 3):
            on_progress(None)
            assert not is_enough([{"done": one} for one in done[:k]])
        if ends:
            ending.set()
        on_progress(None)

    monkeypatch.setattr(run, "sweep", swept)
    judged = Mock(return_value=Mock(spec=CertifiedRate))
    monkeypatch.setattr(certify, "read_certificate", Path.exists)
    monkeypatch.setattr(certify, "certified_rate", judged)
    plan = partial(shutil.copy, STORED / "kinematic.plan")
    with pytest.raises(StudioError, match=STOPPED) if ends else nullcontext():
        rate = certified(plan, {"runs": RUNS}, World(friction=0.3), told.append, ending)
        assert rate is judged.return_value
        are_written, of = judged.call_args.args
        assert (are_written, of.name) == (True, load_plan(STORED / "kinematic.plan").name)
    counted = [(sum(done[:k]), *rate_interval(sum(done[:k]), k)) for k in (1, 2, 3)]
    runs = [Doing("certifying", k, RUNS, rate) for k, rate in enumerate(counted, 1)]
    assert told == [Doing("certifying", 0.0, RUNS), *runs]


@pytest.mark.slow
def test_every_run_is_told_and_the_interval_narrows(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = list[Doing]()
    monkeypatch.setattr(
        studio, "_told_of", lambda which, one: told.append(one) if which == "certify" else None
    )
    assert studio.certify({"runs": 0})["error"]
    row = studio.certify({"runs": RUNS})["row"]
    assert isinstance(row, dict)
    counted = [one for one in told if one is not None and one.rate is not None]
    assert [one.done for one in counted] == list(range(1, RUNS + 1))
    widths = [one.rate[2] - one.rate[1] for one in counted if one.rate is not None]
    assert widths == sorted(widths, reverse=True)
    assert widths[-1] < 0.8 * widths[0]
    assert (row["n"], row["motion"], row["base"]) == (RUNS, "nod", studio._project.base)
    assert row["interval"] == rate_interval(row["done"], RUNS)
    header = read_pack(read_message(studio._server.changes(""), b"")[1])[0]
    certified = header["verdict"]["certified"]
    assert (certified["n"], certified["done"], certified["outdated"]) == (RUNS, row["done"], "")
    assert len(certified["worst"]) == RUNS
    page = studio._project.path.with_suffix(".html")
    assert "told" in studio.export({"kind": "html"})
    assert read_data(page.read_text("utf-8"))[0]["verdict"]["certified"] == certified
    studio.meet({"friction": 0.4})
    studio.export({"kind": "html", "again": True})
    assert read_data(page.read_text("utf-8"))[0]["verdict"]["certified"] is None, "another world"
    studio.meet({})


def counting(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> tuple[threading.Thread, list[object]]:
    """A count of 200 runs that goes on in another thread, and where its answer will be."""
    begun, answers = threading.Event(), list[object]()
    monkeypatch.setattr(
        studio, "_told_of", lambda which, one: begun.set() if which == "certify" else None
    )
    count = threading.Thread(target=lambda: answers.append(studio.certify({"runs": 200})))
    count.start()
    assert begun.wait(60.0)
    return count, answers


@pytest.mark.slow
def test_the_next_edit_ends_it(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    count, answers = counting(studio, monkeypatch)
    editor = read_pack(read_message(studio._server.changes(""), b"")[1])[0]["editor"]
    order = {"op": "set", "site": editor["bars"][0]["site"], "name": "over", "value": 0.6}
    assert isinstance(studio.edit({**order, "base": editor["base"]}), bytes)
    count.join()
    assert answers == [{"error": STOPPED}]


@pytest.mark.slow
def test_one_that_was_ended_stays_so_when_the_next_begins(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    count, answers = counting(studio, monkeypatch)
    studio.cancel({})
    assert "row" in studio.certify({"runs": 1})
    count.join(60.0)
    assert answers == [{"error": STOPPED}]
