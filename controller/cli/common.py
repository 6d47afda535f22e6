"""What every subcommand of ``go2-wbc`` shares: exit codes, parsers and JSON output."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import textwrap
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]
else:  # argparse's class takes no subscript at run time
    Subparsers = argparse._SubParsersAction
"""What a subcommand's ``register`` adds its parser to."""


PROGRAM = "go2-wbc"
"""The name of the command line, and of the package."""


class ExitCode(IntEnum):
    """What the process tells its caller, whatever the command.

    Attributes:
        OK: it was done, or can be done.
        FAILED: it was not done, or cannot be done.
        USAGE: what was given cannot be used, an option, a name, a number or a file.
        RUNTIME: something broke, or is missing on this machine.
        INTERRUPTED: Ctrl-C, of what does not wait for it.
        BROKEN_PIPE: who read the output has gone.
    """

    OK = 0
    FAILED = 1
    USAGE = 2
    RUNTIME = 3
    INTERRUPTED = 130
    BROKEN_PIPE = 141


def add_parser(
    subparsers: Subparsers, name: str, description: str, *, examples: str
) -> argparse.ArgumentParser:
    """Add the parser of the subcommand ``name``; its examples are one line each."""
    return subparsers.add_parser(
        name,
        help=description.partition("\n")[0].replace("%", "%%"),
        description=description,
        epilog=examples_epilog(examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def examples_epilog(examples: str) -> str:
    """The ``examples:`` block at the end of a help text."""
    return "examples:\n" + textwrap.indent(examples.strip(), "  ")


def print_json(value: object) -> None:
    """Print ``value`` for a program to read."""
    print(json.dumps(value, indent=2))


def print_json_line(value: object) -> None:
    """Print ``value`` as one line, at once, for a program that follows."""
    print(json.dumps(value), flush=True)


def shown_path(path: Path) -> Path:
    """``path`` as a person reads it: relative where it lies below the working directory."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def installed_version(distribution: str) -> str | None:
    """Version of an installed package; ``None`` if it is not installed."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None
