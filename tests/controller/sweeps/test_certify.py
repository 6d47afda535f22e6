"""Certificates: counted in random worlds, the same however they are run, and judged by truth."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from controller import Certificate, certify, sweep
from controller.cli.common import ExitCode
from controller.report_view import planned
from controller.sweeps.certify import (
    FEWEST,
    _narrow,
    _why,
    certified_rate,
    read_certificate,
    with_certificate,
)
from controller.sweeps.motion_study import archive_of, world_of
from controller.sweeps.sweep_file import Row
from controller.sweeps.targets import motion_target
from go2_wbc import World
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.world import DOUBTFUL
from motions import CompiledPlan, FeasibilityChecker, Timeline, deg
from tests.controller.cli.conftest import Run, Said
from tests.controller.sweeps import swept
from tests.script_server import pytest_with
from tests.viz.page_reader import read_data

BOW = Timeline(name="bow").body(pitch=deg(8), over=0.4).home(over=0.4)
MOTIONS = '''
from motions import Timeline, deg, motion

@motion
def leap() -> Timeline:
    """Leap: far more than friction gives."""
    return Timeline().body(y=0.12, over=0.1).body(y=-0.12, over=0.1).home(over=0.1)
'''
TESTS = """
import pytest
from mine import leap

@pytest.mark.certify(0.9, n=2)
def test_leap(certify_motion):
    certify_motion(leap)

@pytest.mark.certify(90)
def test_percent(certify_motion):
    certify_motion(leap)

def test_no_marker(certify_motion):
    certify_motion(leap)
"""


@pytest.fixture(scope="module")
def bows(tmp_path_factory: pytest.TempPathFactory) -> Certificate:
    return certify(BOW, 4, workers=2, out=tmp_path_factory.mktemp("bows") / "rows.sqlite")


def test_a_motion_that_is_done_is_certified_with_its_interval(bows: Certificate) -> None:
    assert (bows.motion, bows.n, bows.done, bows.rate) == ("bow", 4, 4, 1.0)
    assert bows.interval == pytest.approx((0.025 ** (1 / 4), 1.0))  # Clopper-Pearson, n of n
    assert bows.meets(0.39)
    assert bows.meets(bows.interval[0])
    assert not bows.meets(0.4)
    assert {"code", "version", "plan", "libraries"} <= set(bows.about)
    assert len({row["friction"] for row in bows.worst}) == 4
    assert {row["seed"] for row in bows.worst} == {0, 1, 2, 3}
    long = replace(bows, about={**bows.about, "libraries": "x " * 99})
    assert max(map(len, long.table().splitlines())) <= 80
    assert "done in 4 of 4 runs" in bows.table()
    assert json.loads(json.dumps(bows.as_dict(), allow_nan=False))["rate"] == 1.0


def test_finished_runs_are_not_repeated_and_one_worker_gives_the_same(
    bows: Certificate, tmp_path: Path
) -> None:
    told: list[float] = []
    again = certify(BOW, 4, out=bows.path, on_progress=lambda p: told.append(p.rate))
    assert told == [0.0]  # nothing was left to do
    assert again == bows
    alone = certify(BOW, 2, workers=1, out=tmp_path / "one.sqlite")
    assert set(map(str, alone.worst)) <= set(map(str, bows.worst))


def test_a_motion_that_asks_for_the_nearest_is_certified_as_that() -> None:
    swayed = Timeline(name="sway", physics="nearest").hold(0.2).body(y=0.06, over=0.2)
    line = swayed.body(y=-0.06, over=0.2).home(over=0.3).hold(0.3)
    target = motion_target(line)
    nearest = FeasibilityChecker().plan(line)
    assert isinstance(nearest, CompiledPlan)
    assert nearest.dynamic
    assert target.about["plan"] == archive_of(nearest)


def test_runs_are_in_samples_of_the_world_that_is_stated(tmp_path: Path) -> None:
    world = World(friction=0.3, payload=2.0, payload_place=(0.05, 0.0, 0.05))
    found = certify(BOW, 2, world=world, out=tmp_path / "rows.sqlite")
    assert all(0.27 <= float(row["friction"]) <= 0.33 for row in found.worst)
    assert world_of(found.about["world"]) == world
    with pytest.raises(ConfigError, match="depend on something else"):
        certify(BOW, 2, out=tmp_path / "rows.sqlite")


def test_a_sweep_ends_with_the_fewest_first_rows_that_are_enough(tmp_path: Path) -> None:
    def is_enough(rows: Sequence[Row]) -> bool:
        return sum(bool(row["ok"]) for row in rows) >= 3

    for workers in (1, 3):
        found = sweep(
            swept.trial,
            40,
            workers=workers,
            out=tmp_path / f"{workers}.sqlite",
            is_enough=is_enough,
        )
        assert [row["seed"] for row in found.rows] == list(range(7))  # 0, 3 and 6 are ok
    again = sweep(swept.trial, 40, out=tmp_path / "3.sqlite", is_enough=is_enough)
    assert len(again.rows) == 7
    certain: list[Row] = [{"done": True}] * FEWEST  # of all done, the interval is 0.168 wide
    assert not _narrow(0.2)(certain[1:])
    assert (_narrow(0.16)(certain), _narrow(0.17)(certain)) == (False, True)


def test_a_page_shows_the_certificate_and_whether_it_holds(bows: Certificate) -> None:
    assert read_certificate(bows.path) == bows
    checked = FeasibilityChecker(world=DOUBTFUL).evaluate(BOW)
    shown = with_certificate(planned(checked), bows, checked.plan).verdict
    assert shown is not None
    assert shown.certified is not None
    assert shown.chance == checked.report.probability
    found = shown.certified
    assert (found.n, found.done, found.interval) == (4, 4, bows.interval)
    assert found.world == str(DOUBTFUL)
    assert [run.seed for run in found.worst] == [row["seed"] for row in bows.worst]
    assert found.versions["plan"] == bows.about["plan"]
    assert not found.outdated
    other = FeasibilityChecker().evaluate(BOW.scale(0.5)).plan
    assert "another plan than" in certified_rate(bows, other).outdated
    old = replace(bows, about={**bows.about, "code": "0"})
    assert "another code than" in certified_rate(old, checked.plan).outdated


def test_what_holds_no_runs_of_a_motion_is_no_certificate(tmp_path: Path) -> None:
    swept_file = sweep(swept.trial, 2, workers=1, out=tmp_path / "rows.sqlite").path
    with pytest.raises(CommandError, match="only motions are certified"):
        read_certificate(swept_file)
    with pytest.raises(ConfigError, match="there is no file"):
        read_certificate(tmp_path / "none.sqlite")


@pytest.fixture
def certify_leap(tmp_path: Path, run: Run) -> Callable[..., Said]:
    """``go2-wbc certify`` of the leap, whose file is kept."""
    (tmp_path / "mine.py").write_text(MOTIONS, encoding="utf-8")
    return partial(
        run, "certify", f"{tmp_path / 'mine.py'}:leap", "--out", tmp_path / "rows.sqlite"
    )


def test_certify_and_preview_write_pages_with_the_certificate(
    certify_leap: Callable[..., Said], tmp_path: Path, run: Run
) -> None:
    page, other, rows = (tmp_path / name for name in ("leap.html", "preview.html", "rows.sqlite"))
    assert "leap.html" in certify_leap("--n", 1, "--html", page).out
    words = ("preview", f"{tmp_path / 'mine.py'}:leap", "--certificate", rows, "--html", other)
    run(*words, code=ExitCode.FAILED)
    for file in (page, other):
        header, _ = read_data(file.read_text(encoding="utf-8"))
        assert header["verdict"]["certified"]["n"] == 1
        assert header["verdict"]["certified"]["outdated"] == ""
        assert header["verdict"]["world"] == str(DOUBTFUL)


@pytest.mark.parametrize("width", [0.0, 1.5, -0.1])
def test_a_width_that_is_none_is_refused(width: float, tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="width"):
        certify(BOW, 2, width=width, out=tmp_path / "rows.sqlite")


def test_what_physics_does_not_give_is_named_and_fails_below_the_rate_that_is_asked_for(
    certify_leap: Callable[..., Said],
) -> None:
    assert "leap: done in 0 of 2 runs" in certify_leap("--n", 2).out
    told = certify_leap("--n", 2, "--at-least", 0.5, "--json", code=ExitCode.FAILED)
    certificate = json.loads(told.out)
    assert (certificate["done"], certificate["rate"]) == (0, 0.0)
    assert all("trunk" in row["harm"] and not row["done"] for row in certificate["worst"])


def test_the_marker_requires_a_rate_and_says_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    (tmp_path / "mine.py").write_text(MOTIONS, encoding="utf-8")
    (tmp_path / "test_mine.py").write_text(TESTS, encoding="utf-8")
    done = pytest_with("controller.pytest_plugin", tmp_path, "-rfE", "test_mine.py")
    assert "'leap' must be done in 90 % of the runs" in done.stdout
    assert "done in 0 of 2 runs" in done.stdout
    assert "got 90" in done.stdout
    assert "certify_motion needs the marker" in done.stdout
    assert "Traceback" not in done.stdout


def test_the_commonest_reason_of_failures_is_told_once_where_it_was_worst() -> None:
    rows = [
        {"done": False, "harm": "trunk 9.5 deg off; slip 30 mm"},
        {"done": True, "harm": ""},
        {"done": False, "harm": "fell; trunk 39.0 deg off"},
        {"done": False, "harm": "fell"},
        {"done": False, "harm": "trunk 12.1 deg off"},
    ]
    assert _why(rows) == "4 of 5 runs failed, 3 of them: trunk 39.0 deg off"
    assert _why(rows[3:4]) == "1 of 1 runs failed: fell"
    assert _why(rows[1:2]) == ""
