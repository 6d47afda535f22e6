"""A function is a subcommand: what it takes is what the command line takes."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest

from controller.cli.options import add_command, reader

even = reader(int, lambda value: value % 2 == 0, "an even number")
given: list[object] = []
"""What the function was called with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Some options."""

    first_seed: Annotated[int, "K", "default %(default)s"] = 3


def take(
    motion: Annotated[str, "MOTION", "of the library"],
    files: Annotated[tuple[Path, ...], "FILE"] = (),
    *,
    set: Annotated[Sequence[str], "NAME=VALUE", "a parameter"] = (),
    n: Annotated[int | None, "N", "how many", even] = None,
    kind: Annotated[str, ("a", "b"), "which"] = "a",
    out: Path,
    moves: Annotated[tuple[str, ...], "some"] = ("x",),
    part: Annotated[Part, "some more"],
    no_play: Annotated[bool, "only look"] = False,
) -> int:
    """Take what is given.

    All of this is in one paragraph, which is filled again to the width of a help text.

    table:
      kept as it is

    Examples:
        prog take bow
    """
    given[:] = [motion, files, set, n, kind, out, moves, part, no_play]
    return 0


def called(*words: str) -> list[object]:
    parser = argparse.ArgumentParser("prog")
    add_command(parser.add_subparsers(), "take", take)
    args = parser.parse_args(["take", *words])
    assert args.run(args) == 0
    return given


def test_what_is_not_given_is_the_default_of_the_function() -> None:
    expected = ["bow", (), (), None, "a", Path("f"), ("x",), Part(first_seed=3), False]
    assert called("bow", "--out", "f") == expected


def test_what_is_given_is_of_the_type_that_is_annotated() -> None:
    words = "bow f g --set a=1 --set b=2 --n 4 --kind b --out o --first-seed 5 --no-play --moves y"
    expected = ["bow", (Path("f"), Path("g")), ("a=1", "b=2"), 4, "b", Path("o"), ("y",)]
    assert called(*words.split()) == [*expected, Part(first_seed=5), True]


def test_the_docstring_is_the_help(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        called("--help")
    told = capsys.readouterr().out
    assert "\nTake what is given.\n\nAll of this" in told
    assert "\ntable:\n  kept as it is\n" in told
    assert told.endswith("\nexamples:\n  prog take bow\n")
    assert "\nsome more:\n  --first-seed K" in told
    assert "default 3" in told
    assert max(map(len, told.splitlines())) <= 80
