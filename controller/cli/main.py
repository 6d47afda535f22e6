"""``go2-wbc``: finds the subcommand, runs it, and turns errors into messages and exit codes.

A subcommand is a function whose parameters are its options (see ``options``), and a line in
``COMMANDS``. Only the module of the chosen command is imported: so help is quick, and a broken
library cannot keep ``doctor`` from starting. ``run_program`` does the same for a program with other
subcommands.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import logging
import os
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from controller.cli.common import (
    PROGRAM,
    TRIES,
    ExitCode,
    Subparsers,
    add_command,
    examples_epilog,
    installed_version,
)
from controller.pacing import REASON
from go2_wbc import errors


@dataclass(frozen=True, slots=True)
class Command:
    """A subcommand."""

    name: str  #: what is typed
    place: str  #: ``MODULE:FUNCTION`` of what it runs; the function is ``run`` if none is named
    summary: str  #: its line in the list

    def add_to(self, subparsers: Subparsers) -> None:
        """Import it, and add its parser."""
        place, _, name = self.place.partition(":")
        function = getattr(importlib.import_module(place), name or "run")
        add_command(subparsers, self.name, function)


COMMANDS = tuple(
    Command(name, f"controller.cli.{place}", summary)
    for name, place, summary in (
        ("certify", "sweep:certify_command", "how often a motion is done in random worlds"),
        ("check", "motions:check", "can the robot do this motion?"),
        ("completion", "main:completion", "what a shell needs to complete this on TAB"),
        ("dance", "dance", "a dance on the beats of a song"),
        ("dataset", "dataset", "what the controller does, recorded for learners"),
        ("demo", "demo", "stand, sit, walk, turn, high five; measured, in 3D"),
        ("doctor", "doctor", "check this installation, say what is missing"),
        ("export", "motions:export", "a motion's trajectory as NumPy or CSV"),
        ("identify-friction", "bridges:friction", "measure the joints' friction"),
        ("list", "motions:list_motions", "the motions, and what can be set"),
        ("new", "motions:new", "write a small motion to start from"),
        ("preview", "motion_preview", "watch a motion, live in the browser"),
        ("replay", "sweep:replay_command", "a row of a motion's sweep, run again and shown"),
        ("ros2", "bridges:ros2", "the simulated robot as a ROS 2 node"),
        ("run", "motion_run", "check a motion, then play it in MuJoCo"),
        ("studio", "studio", "design a motion with the hand, in the browser"),
        ("sweep", "sweep:sweep_command", "a motion, a gait or a function over many seeds"),
        ("teleop", "teleop", "drive the robot with the keyboard"),
        ("unitree-drive", "bridges:unitree_drive", "drive a Go2 through its low level"),
        ("unitree-sim", "bridges:unitree_sim", "simulate a Go2 for Unitree's SDK"),
    )
)

EXAMPLES = """
go2-wbc demo             run the demo headless: table, replay page, pictures
go2-wbc check wave       can the robot do this motion?
go2-wbc preview wave     watch it in the browser, again after every save
go2-wbc run wave         play it in MuJoCo
go2-wbc doctor           what is installed, what is missing, how to get it
go2-wbc doctor --json    the same for a program to read
go2-wbc COMMAND --help   the options of a command, with examples
"""

EXIT_CODES: tuple[tuple[tuple[type[errors.Go2WbcError], ...], ExitCode], ...] = (
    (
        (errors.CommandError, errors.ConfigError, errors.SolverUnavailable, errors.ModelMismatch),
        ExitCode.USAGE,
    ),
    ((errors.TimelineError, errors.MotionFileError), ExitCode.USAGE),
    ((errors.MotionError, errors.QpInfeasible, errors.IkError), ExitCode.FAILED),
    ((errors.Go2WbcError,), ExitCode.RUNTIME),
)
"""The exit code of an error, of every command; the first row that fits counts."""

_OURS = frozenset({"go2_wbc", "controller", "motions", "viz", "benchmarks"})


@dataclass(frozen=True, slots=True)
class Program:
    """A command line: how it is called, what it does, its subcommands and examples."""

    name: str
    description: str
    commands: Sequence[Command]
    examples: str


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``go2-wbc``; see ``run_program``."""
    description = "Whole-body control of the Unitree Go2."
    return run_program(Program(PROGRAM, description, COMMANDS, EXAMPLES), argv)


def run_program(program: Program, argv: Sequence[str] | None = None) -> int:
    """Run a command line.

    Args:
        program: which.
        argv: arguments without the program's name; by default those of the process.

    Returns:
        See ``ExitCode``.
    """
    try:
        try:
            code = _run(program, list(sys.argv[1:] if argv is None else argv))
            _flush()
        except BrokenPipeError:
            raise
        except (KeyboardInterrupt, Exception) as error:
            message, code = _explained(error)
            print(f"{program.name}: {message}", file=sys.stderr)
            _flush()
    except OSError as error:
        _print_no_more()
        return ExitCode.BROKEN_PIPE if isinstance(error, BrokenPipeError) else ExitCode.RUNTIME
    return code


def _flush() -> None:
    if sys.stdout is not None:  # a process may be started without it
        sys.stdout.flush()


def _print_no_more() -> None:
    """Nobody reads, or the disk is full. Python flushes once more at exit: it goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def high_five_demo() -> int:
    """The console script of this name: ``go2-wbc demo``."""
    return main(["demo", *sys.argv[1:]])


def _run(program: Program, argv: list[str]) -> int:
    requested = next((word for word in argv if not word.startswith("-")), None)
    parser = build_parser(program, requested)
    try:
        args, unknown = parser.parse_known_args(argv)
        if unknown:
            args.refuse(f"unrecognized arguments: {' '.join(unknown)}")
    except SystemExit as stop:  # argparse has printed its help, version or complaint
        return stop.code if isinstance(stop.code, int) else ExitCode.USAGE
    shown = logging.StreamHandler()
    shown.addFilter(_is_news)
    logging.basicConfig(
        level=logging.INFO if args.verbose else logging.WARNING,
        format="%(levelname)s: %(message)s",
        handlers=[shown],
    )
    if args.run is None:
        parser.print_help(sys.stderr)
        return ExitCode.USAGE
    return args.run(args)


def _is_news(record: logging.LogRecord) -> bool:
    """Whether a log line says more than what commands print: outcomes, and what is tried."""
    if record.name.startswith(f"{TRIES}."):
        return record.levelno > logging.INFO or logging.getLogger().isEnabledFor(logging.INFO)
    is_service = logging.getLogger(record.name).isEnabledFor(logging.INFO)  # or it is verbose
    return is_service or record.msg != REASON


def build_parser(
    program: Program, requested: str | None, *, is_whole: bool = False
) -> argparse.ArgumentParser:
    """The parser of a whole command line.

    Unless it ``is_whole``, only the ``requested`` subcommand is imported and adds its options; the
    others are listed.
    """
    parser = argparse.ArgumentParser(
        prog=program.name,
        description=program.description,
        epilog=examples_epilog(program.examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    version = installed_version(PROGRAM) or "(not installed)"
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {version}")
    _add_verbose(parser)
    parser.set_defaults(run=None, refuse=parser.error)
    subparsers = parser.add_subparsers(title="commands", dest="command", metavar="COMMAND")
    for command in program.commands:
        if is_whole or command.name == requested:
            command.add_to(subparsers)
            own = subparsers.choices[command.name]
            own.set_defaults(refuse=own.error)  # with its options, not with those of the program
            _add_verbose(own, argparse.SUPPRESS)
        else:
            subparsers.add_parser(command.name, help=command.summary)
    return parser


def _add_verbose(parser: argparse.ArgumentParser, default: bool | str = False) -> None:
    """Before and behind the command; what stands before it is kept where nothing stands behind."""
    told = "log what happens (to standard error)"
    parser.add_argument("-v", "--verbose", action="store_true", default=default, help=told)


def _explained(error: BaseException) -> tuple[str, ExitCode]:
    """What to say of an error, and the exit code; a bug shows its traceback first."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", ExitCode.INTERRUPTED
    if isinstance(error, errors.Go2WbcError):
        return str(error), next(code for kinds, code in EXIT_CODES if isinstance(error, kinds))
    if isinstance(error, ImportError) and (error.name or "").split(".")[0] not in _OURS:
        hint = f"`{PROGRAM} doctor` says what is missing and how to get it"
        return f"{error}; {hint}", ExitCode.RUNTIME
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}", ExitCode.RUNTIME
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        _print_no_more()
        return f"cannot write what it prints: {error.strerror}", ExitCode.RUNTIME
    traceback.print_exception(error)
    return "this is a bug in the program; the lines above say where", ExitCode.RUNTIME


SHELLS = ("bash", "zsh", "fish", "tcsh")
_MOTIONS = "_go2_wbc_motions"


def completion(shell: Annotated[str, SHELLS, "which one"]) -> int:
    """Print the script with which a shell completes `go2-wbc` on TAB.

    Examples:
        go2-wbc completion bash > ~/.local/share/bash-completion/completions/go2-wbc
        eval "$(go2-wbc completion bash)"    in this shell only
        go2-wbc completion zsh > ~/.zfunc/_go2-wbc
        go2-wbc completion fish > ~/.config/fish/completions/go2-wbc.fish
    """
    import shtab

    from motions import motion_names

    parser = build_parser(Program(PROGRAM, "", COMMANDS, ""), None, is_whole=True)
    completed = {"FILE": shtab.FILE, "FILE.py": shtab.FILE, "DIR": shtab.DIRECTORY}
    completed["MOTION"] = {**shtab.FILE, "bash": _MOTIONS}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for option in (option for sub in action.choices.values() for option in sub._actions):
                if option.metavar in completed:
                    setattr(option, "complete", completed[option.metavar])  # noqa: B010 - shtab's
    words = " ".join(motion_names())
    preamble = f'{_MOTIONS}() {{ compgen -W "{words}" -- $1; compgen -f -- $1; }}'
    print(shtab.complete(parser, shell, preamble=preamble if shell == "bash" else ""))
    return ExitCode.OK


if __name__ == "__main__":
    sys.exit(main())
