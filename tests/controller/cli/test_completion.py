"""A shell that has read what ``completion`` prints completes commands, options and motions."""

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from controller.cli.main import COMMANDS, SHELLS
from motions import motion_names
from tests.controller.cli.conftest import Run

ASK = """
source {script}
COMP_WORDS=({words})
COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
_shtab_go2_wbc
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_options_motions_and_files(tmp_path: Path, run: Run) -> None:
    script = tmp_path / "go2-wbc"
    script.write_text(run("completion", "bash").out, encoding="utf-8")
    (tmp_path / "mine.py").touch()

    def offered(*words: str) -> set[str]:
        typed = " ".join(shlex.quote(word) for word in ("go2-wbc", *words))
        asked = ASK.format(script=script, words=typed)
        command = ["bash", "--norc", "-c", asked]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
        return set(done.stdout.split())

    assert offered("") == {command.name for command in COMMANDS}
    assert offered("ch") == {"check"}
    assert {"--html", "--video", "--viewer"} <= offered("run", "--")
    assert offered("run", "wave", "--vi") == {"--video", "--viewer"}
    assert offered("run", "wav") == {"wave"}
    assert {*motion_names(), "mine.py"} <= offered("check", "")
    assert offered("run", "wave", "--config", "mi") == {"mine.py"}
    assert offered("demo", "--backend", "") == {"condensed", "full", "placo"}


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_gets_every_command(shell: str, run: Run) -> None:
    script = run("completion", shell).out
    assert not [command.name for command in COMMANDS if command.name not in script]
