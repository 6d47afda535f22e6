"""Plays of motions that the check has passed: what is counted, and which motions and worlds."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import false_negatives
from benchmarks.__main__ import main
from benchmarks.false_negatives import EVERY, FIRST_WORLD, LIBRARY, judged, passed_play, render
from benchmarks.probability_runs import NOT_READY, PAYLOAD, world_of
from controller.cli.common import ExitCode
from controller.sweeps.rows import Row, row_of
from go2_wbc.world import World
from motions import Timeline, deg


def _row(seed: int, *, passed: bool = True, fell: bool = False, harm: str = "") -> Row:
    where = {"motion": "nod", "stratum": "easy", "friction": 0.5, "payload": 0.0}
    done = passed and not (fell or harm)
    return {"seed": seed, **where, "passed": passed, "done": done, "fell": fell, "harm": harm}


def test_only_what_passed_and_began_is_counted_as_played() -> None:
    rows = [_row(0), _row(1, passed=False), _row(2, harm="slip 12 mm"), _row(3, harm=NOT_READY)]
    values = judged(rows, 2)
    assert (values["passed"], values["asked"], values["played"], values["done"]) == (True, 4, 2, 1)
    assert values["not_ready"] == 1
    assert not judged(rows, 3)["passed"]  # fewer than wanted are no proof


def test_one_fall_is_named_and_fails() -> None:
    rows = [_row(0), _row(7, fell=True, harm="fell; not done")]
    values = judged(rows, 2)
    assert (values["passed"], values["fell"]) == (False, [7])
    text = render(rows, values)
    assert "seed 7 fell: nod" in text
    assert "1 of 2 fell" in text
    assert text.endswith("NO")
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(("tilt", "passes"), [(5, True), (60, False)])
def test_a_motion_is_played_where_it_passes_only(
    tilt: float, passes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = Timeline(name="nod").body(pitch=deg(tilt), over=1.0).home(over=1.0)
    plan = false_negatives.compile_motion(line, false_negatives.model())
    met: list[World] = []

    def play(_: object, world: World, seed: int) -> tuple[str, ...]:
        met.append(world)
        assert seed == FIRST_WORLD + 3
        return ("fell",)

    monkeypatch.setattr(false_negatives, "_asked", lambda number: ("nod", "easy", plan))
    monkeypatch.setattr(false_negatives, "played", play)
    row = row_of(passed_play(3))
    assert (row["passed"], row["fell"], row["done"]) == (passes, passes, False)
    assert met == ([world_of(FIRST_WORLD + 3)] if passes else [])


def test_worlds_are_within_the_stated_ranges_and_others_than_those_of_the_fit() -> None:
    worlds = [world_of(FIRST_WORLD + seed) for seed in range(200)]
    assert all(0.3 <= world.friction <= 1.0 for world in worlds)
    assert all(PAYLOAD[0] <= world.payload <= PAYLOAD[1] for world in worlds)
    assert not {world_of(seed) for seed in range(200)} & set(worlds)


def test_every_fourth_motion_is_of_the_library() -> None:
    names = [false_negatives._asked(number)[1] for number in (EVERY - 1, 2 * EVERY - 1)]
    assert names == [LIBRARY, LIBRARY]
    others = [false_negatives._asked(number)[1] for number in range(EVERY - 1)]
    assert LIBRARY not in others


@pytest.mark.parametrize("name", ["false_negatives", "envelopes", "probability --motions 1"])
def test_a_folder_that_cannot_be_made_is_told(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    words = [*name.split(), "--rows", str(tmp_path / "file" / "in" / "rows.sqlite")]
    assert main(words) == ExitCode.USAGE
    assert "cannot make the folder" in capsys.readouterr().err
