"""What every subcommand of ``go2-wbc`` shares: exit codes, JSON, its options, a progress line.

A subcommand is made from a function: its parameters are the options, its docstring is the help. A
positional parameter is an argument, a keyword parameter an option: a flag if it is a bool, required
if it has no default. ``Annotated`` adds to the type one of: a string, which is the help; two
strings, the metavariable and the help; a tuple of choices; a function that converts a text to a
value. ``T | None`` is an optional T, ``tuple[T, ...]`` takes several values in a row,
``Sequence[T]`` repeats the option for each value. A dataclass stands for its fields, as a section
of the help if it is annotated with a title.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import inspect
import json
import logging
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import viz
from go2_wbc.files import checked_output

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]
else:  # argparse's class takes no subscript at run time
    Subparsers = argparse._SubParsersAction
"""What subcommands add their parsers to."""


PROGRAM = "go2-wbc"  #: The name of the command line, and of the package


class ExitCode(IntEnum):
    """What the process tells its caller, whatever the command."""

    OK = 0  #: it was done, or can be done
    FAILED = 1  #: it was not done, or cannot be done
    USAGE = 2  #: what was given cannot be used, an option, a name, a number or a file
    RUNTIME = 3  #: something broke, or is missing on this machine
    INTERRUPTED = 130  #: Ctrl-C, of what does not wait for it
    BROKEN_PIPE = 141  #: who read the output has gone


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


WIDTH = 78  #: Columns of a help text: those of ``argparse`` in a terminal of 80
T = TypeVar("T")


def add_command(subparsers: Subparsers, name: str, function: Callable[..., int]) -> None:
    """Add the subcommand ``name``: the ``run`` of what is parsed calls the function."""
    text, _, examples = (inspect.getdoc(function) or "").partition("\n\nExamples:\n")
    paragraphs = [
        part if "\n " in part else textwrap.fill(" ".join(part.split()), WIDTH)
        for part in text.split("\n\n")
    ]
    parser = subparsers.add_parser(
        name,
        help=paragraphs[0].partition("\n")[0].replace("%", "%%"),
        description="\n\n".join(paragraphs),
        epilog=examples_epilog(textwrap.dedent(examples)),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_options(parser, function)
    parser.set_defaults(run=lambda given: _called(function, given))


def _add_options(parser: argparse._ActionsContainer, call: Callable[..., object]) -> None:
    for parameter, kind, notes in _parameters(call):
        words = [note for note in notes if isinstance(note, str)]
        if _is_part(kind):
            _add_options(parser.add_argument_group(*words) if words else parser, kind)
            continue
        settings = {**_taken(kind, parameter), "help": words[-1] if words else None}
        if len(words) > 1:
            settings["metavar"] = words[0]
        for note in notes:
            if not isinstance(note, str):
                settings["type" if callable(note) else "choices"] = note
        is_option = parameter.kind is parameter.KEYWORD_ONLY
        name = f"--{parameter.name.replace('_', '-')}" if is_option else parameter.name
        parser.add_argument(name, **settings)


def _parameters(call: Callable[..., object]) -> Iterator[tuple[inspect.Parameter, Any, list[Any]]]:
    """The parameters of a function or dataclass, with their types and what these are given."""
    hints = get_type_hints(call, include_extras=True)
    for name, parameter in inspect.signature(call).parameters.items():
        hint = hints[name]
        kind, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        yield parameter, kind, notes


def _is_part(kind: object) -> bool:
    return dataclasses.is_dataclass(kind)


def _taken(kind: object, parameter: inspect.Parameter) -> dict[str, Any]:
    """How ``argparse`` takes a parameter of this type."""
    if kind is bool:
        return {"action": "store_true"}
    is_option, default = parameter.kind is parameter.KEYWORD_ONLY, parameter.default
    parts = [part for part in get_args(kind) if part not in (NoneType, Ellipsis)]
    taken: dict[str, Any] = {"type": parts[0] if parts else kind}
    if get_origin(kind) is Sequence:
        return {**taken, "action": "append", "default": list(default)}
    if default is parameter.empty:
        return {**taken, "required": True} if is_option else taken
    several = "+" if is_option else "*"
    one = None if is_option else "?"
    return {**taken, "default": default, "nargs": several if get_origin(kind) is tuple else one}


def _called(call: Callable[..., T], given: argparse.Namespace) -> T:
    values: dict[str, Any] = {}
    for parameter, kind, _ in _parameters(call):
        value = _called(kind, given) if _is_part(kind) else getattr(given, parameter.name)
        values[parameter.name] = tuple(value) if isinstance(value, list) else value
    return call(**values)


# --- what several commands take -------------------------------------------------------------------


def reader(
    kind: Callable[[str], T], is_valid: Callable[[T], bool], told: str
) -> Callable[[str], T]:
    """What makes a valid value of a text; ``told`` says what it must be."""

    def read(text: str) -> T:
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not is_valid(value):
            raise argparse.ArgumentTypeError(f"must be {told}, got {text!r}")
        return value

    return read


def folder(text: str) -> Path:
    """The folder of this name."""
    if not text:
        raise argparse.ArgumentTypeError("must be a folder, got ''")
    return Path(text)


def output(*suffixes: str) -> Callable[[str], Path]:
    """What makes of a text a file that can be written, or raises ConfigError."""
    return lambda text: checked_output(text, suffixes)


def drawing(kind: str) -> Callable[[str], Path]:
    """The same for what ``viz`` draws of this kind."""
    return lambda text: checked_output(text, getattr(viz, f"{kind}_SUFFIXES"))


page_file, plot_file, video_file = drawing("HTML"), drawing("PLOT"), drawing("ANIMATION")
whole = reader(int, lambda value: 0 <= value < 2**63, "a whole number of 0 or more")
dds_domain = reader(int, lambda value: 0 <= value <= 232, "a domain of DDS, 0 to 232")
Json = Annotated[bool, "print JSON"]
Html = Annotated[Path | None, "FILE", "write a 3D replay page", page_file]
Numbers = Annotated[Path | None, "FILE", "TOML with other numbers"]
Mjcf = Annotated[Path | None, "FILE", "your own Go2 model or scene"]


BAR_WIDTH = 20
TELL_EVERY = 5
"""Iterations of a solver from one look at the line to the next: some ten times a second."""
TRIES = "motions"
"""Whose log lines of the level INFO say what is tried; they are shown as progress."""
FIRST_ANSWER = "no plan yet"
"""How the line of a search begins that stays on a terminal: what binds so far."""
_LOG = logging.getLogger(TRIES)
_CLEAR = "\r\x1b[2K"


class ProgressLine:
    """Tells a person how far long work has come, on standard error: results can be piped.

    On a terminal one line is rewritten; the cursor is left at its start, so that a log message
    takes its place. Elsewhere (a file, a pipe, CI) only finished pieces are printed.
    """

    def __init__(self, *, is_quiet: bool = False) -> None:
        """With ``is_quiet`` nothing is told, as beside output for a program."""
        self._is_live = sys.stderr.isatty() and not is_quiet
        self._is_quiet = is_quiet
        self._share, self._text = 0.0, ""
        self._told = logging.Handler()
        self._told.emit = self._tell

    def update(self, share: float, text: str) -> None:
        """Show that ``share`` (0 to 1) is finished and ``text`` is going on."""
        self._share, self._text = share, text
        self._show(text)

    def solving(self, iterations: int, cost: float) -> None:
        """Show how far the solver is on which what is going on waits.

        Plans that were solved before do not call it.

        Args:
            iterations: of the solver, so far.
            cost: of its best plan.
        """
        if iterations % TELL_EVERY == 1:
            self._show(f"{self._text}: solving, iteration {iterations}, cost {cost:.3g}")

    def _tell(self, record: logging.LogRecord) -> None:
        """Show what a search tries or has found out."""
        if record.levelno == logging.INFO:
            told = f"{self._text}: {record.getMessage()}"
            self.done(told)
            if self._is_live and record.msg.startswith(FIRST_ANSWER):
                print(f"{_CLEAR}{told}", file=sys.stderr, flush=True)
            self._show(told)

    def _show(self, text: str) -> None:
        if self._is_live:
            shown = f"{progress_bar(self._share)} {text}"[: shutil.get_terminal_size().columns - 1]
            print(f"{_CLEAR}{shown}\r", end="", file=sys.stderr, flush=True)

    def done(self, text: str) -> None:
        """Say that a piece of work is finished; on a terminal the next update replaces it."""
        if not (self._is_live or self._is_quiet):
            print(text, file=sys.stderr, flush=True)

    def __enter__(self) -> ProgressLine:
        if not _LOG.isEnabledFor(logging.INFO):  # else it is shown already
            _LOG.addHandler(self._told)
            _LOG.setLevel(logging.INFO)
        return self

    def __exit__(self, *_: object) -> None:
        if self._told in _LOG.handlers:
            _LOG.removeHandler(self._told)
            _LOG.setLevel(logging.NOTSET)
        if self._is_live:
            print(_CLEAR, end="", file=sys.stderr, flush=True)


def progress_bar(share: float) -> str:
    """``[########............]`` for a share of 0 to 1."""
    filled = round(BAR_WIDTH * min(max(share, 0.0), 1.0))
    return f"[{'#' * filled}{'.' * (BAR_WIDTH - filled)}]"
