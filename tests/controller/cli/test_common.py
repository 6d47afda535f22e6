"""A function is a subcommand: what it takes is what the command line takes, in its help as said."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest

from controller.cli.common import add_command


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Some options."""

    first_seed: Annotated[int, "K", "default %(default)s"] = 3


def take(
    motion: Annotated[str, "MOTION", "of the library"],
    files: Annotated[tuple[Path, ...], "FILE"] = (),
    *,
    set: Annotated[Sequence[str], "NAME=VALUE", "a parameter"] = (),
    out: Path,
    moves: Annotated[tuple[str, ...], "some"] = ("x",),
    part: Annotated[Part, "some more"],
) -> int:
    """Take what is given.

    All of this is in one paragraph, which is filled again to the width of a help text.

    table:
      kept as it is

    Examples:
        prog take bow
    """
    given.append((motion, files, set, out, moves, part.first_seed))
    return 0


given: list[object] = []  #: What the function was called with


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("bow --out f", ("bow", (), (), Path("f"), ("x",), 3)),
        (
            "bow f g --set a=1 --set b=2 --out o --first-seed 5 --moves y z",
            ("bow", (Path("f"), Path("g")), ("a=1", "b=2"), Path("o"), ("y", "z"), 5),
        ),
    ],
)
def test_what_is_given_is_of_the_type_that_is_annotated(words: str, expected: object) -> None:
    parser = argparse.ArgumentParser("prog")
    add_command(parser.add_subparsers(), "take", take)
    args = parser.parse_args(["take", *words.split()])
    assert args.run(args) == 0
    assert given.pop() == expected


def test_the_docstring_is_the_help(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    subparsers = argparse.ArgumentParser("prog").add_subparsers()
    add_command(subparsers, "take", take)
    told = subparsers.choices["take"].format_help()
    assert "\nTake what is given.\n\nAll of this" in told
    assert "\ntable:\n  kept as it is\n" in told
    assert told.endswith("\nexamples:\n  prog take bow\n")
    assert "\nsome more:\n  --first-seed K" in told
    assert "default 3" in told
    assert max(map(len, told.splitlines())) <= 80
