"""``go2-wbc completion``: the script by which a shell completes commands, options and motions."""

from __future__ import annotations

import argparse
from typing import Annotated

from controller.cli.common import PROGRAM, ExitCode

SHELLS = ("bash", "zsh", "fish", "tcsh")
_MOTIONS = "_go2_wbc_motions"


def run(shell: Annotated[str, SHELLS, "which one"]) -> int:
    """Print the script with which a shell completes `go2-wbc` on TAB.

    Examples:
        go2-wbc completion bash > ~/.local/share/bash-completion/completions/go2-wbc
        eval "$(go2-wbc completion bash)"    in this shell only
        go2-wbc completion zsh > ~/.zfunc/_go2-wbc
        go2-wbc completion fish > ~/.config/fish/completions/go2-wbc.fish
    """
    import shtab

    from controller.cli.main import COMMANDS, Program, build_parser
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
