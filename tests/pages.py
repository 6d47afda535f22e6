"""Reads the project's Markdown pages and runs what they show.

A comment on the line before a block says how to take it:

    <!-- file: greet.py -->       the block is written to this file of the working folder
    <!-- exits 1 -->              its last command ends with this code
    <!-- numbers within 30 % -->  how near the numbers of this output must be

A ``text`` block right after a ``sh`` or ``python`` block is its output. Words must agree, numbers
nearly; ``...`` as a line stands for any lines, and at the end of a line for the rest of it.
"""

import os
import re
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.script_server import ROOT, python, run_script

BRIDGES = tuple(f"docs/{name}.md" for name in ("ros2", "unitree", "real_robot"))
MADE = ("docs/reference/api/", "docs/_build/")  #: What the build of the documentation writes
DOCS = tuple(
    name
    for file in sorted(ROOT.glob("docs/**/*.md"))
    if not (name := file.relative_to(ROOT).as_posix()).startswith(MADE) and name not in BRIDGES
)
PAGES = ("README.md", "CONTRIBUTING.md", *DOCS, *BRIDGES)
FENCE = re.compile(r"^(?:<!-- ([^>]*) -->\n)?```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_RUN = "# not run by the tests"
# Numbers of a feasibility table repeat to the last digit on one machine; elsewhere the QP and the
# splines round differently.
NEAR, NEAR_ZERO = 0.03, 1e-3
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
USERS_BIN = os.environ.get("GO2_WBC_USERS_BIN")
"""``bin`` of another environment, in which a user would do what the pages say."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, text, the line of the page on which it starts, and its note."""

    language: str
    text: str
    line: int
    note: str

    @property
    def file(self) -> str:
        """The file that it is, or an empty word."""
        return self.note.removeprefix("file: ") if self.note.startswith("file: ") else ""

    @property
    def exit_code(self) -> int:
        match = re.search(r"exits (\d)", self.note)
        return int(match[1]) if match else 0

    @property
    def tolerance(self) -> float:
        match = re.search(r"numbers within (\d+) %", self.note)
        return int(match[1]) / 100 if match else NEAR


def page(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(name: str, language: str | None = None) -> list[Block]:
    text = page(name)
    found = (
        Block(match[2], match[3], text.count("\n", 0, match.start(2)) + 1, match[1] or "")
        for match in FENCE.finditer(text)
    )
    return [block for block in found if language in (None, block.language)]


def table_rows(text: str, first: str) -> list[list[str]]:
    """The cells of the tables whose head's first cell starts with ``first``, without the heads."""
    cells = []
    for table in text.split(f"\n| {first}")[1:]:
        lines = table.split("\n\n")[0].splitlines()[2:]
        cells += [
            [cell.strip() for cell in line.strip("|").split("|")]
            for line in lines
            if line.startswith("|")
        ]
    return cells


def name_of(block: Block) -> str:
    return f"line {block.line}"


def words_of(block: Block) -> list[list[str]]:
    """Words of every shell line of a block, comments dropped."""
    lines = (
        shlex.split(line, comments=True) for line in block.text.replace("\\\n", "").splitlines()
    )
    return [words for words in lines if words]


def command_lines(name: str) -> list[list[str]]:
    """Words of every shell line of a page."""
    return [words for block in blocks(name, "sh") for words in words_of(block)]


def run_python(text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a Python block alone, in ``folder``."""
    if USERS_BIN:
        return as_user([f"{USERS_BIN}/python", "-c", text], folder)
    return run_script(["-c", text], folder, _environment())


def run_command(words: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run ``go2-wbc``, ``pytest`` or ``python`` of this checkout, installed or not."""
    if USERS_BIN:
        return as_user([f"{USERS_BIN}/{words[0]}", *words[1:]], folder)
    program = {
        "go2-wbc": ["-m", "controller.cli.main"],
        "pytest": ["-m", "pytest", "-p", "motions.pytest_plugin"],
        "python": [],
    }[words[0]]
    arguments = [*program, *words[1:]]
    if words[0] != "pytest":  # it takes hold of modules as they are loaded
        return run_script(arguments, folder, _environment())
    return python(*arguments, folder=folder, **_environment())


def as_user(command: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """As typed by somebody whose environment is on the path."""
    path = f"{USERS_BIN}:{os.environ['PATH']}"
    environment = {name: os.environ[name] for name in ("HOME",) if name in os.environ}
    return subprocess.run(
        command,
        cwd=folder,
        env={**environment, "PATH": path, "COLUMNS": "80"},
        capture_output=True,
        text=True,
        check=False,
    )


def _environment() -> dict[str, str]:
    return {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "COLUMNS": "80",
    }


def difference(shown: str, printed: str, tolerance: float = NEAR) -> str:
    """The first line of ``shown`` that ``printed`` does not bear out; empty if there is none."""
    real = [line.split() for line in printed.splitlines() if line.strip()]
    position, may_skip = 0, False
    for line in shown.splitlines():
        words = line.split()
        if not words:
            continue
        if words == ["..."]:
            may_skip = True
            continue
        candidates = range(position, len(real) if may_skip else min(position + 1, len(real)))
        found = next((k for k in candidates if _agree(words, real[k], tolerance)), None)
        if found is None:
            return f"shown: {line}"
        position, may_skip = found + 1, False
    left = [] if may_skip else real[position:]
    return f"not shown: {' '.join(left[0])}" if left else ""


def _agree(shown: list[str], real: list[str], tolerance: float) -> bool:
    if shown[-1] == "...":
        shown, real = shown[:-1], real[: len(shown) - 1]
    pairs = zip(shown, real, strict=False)
    return len(shown) == len(real) and all(_same(a, b, tolerance) for a, b in pairs)


def _same(shown: str, real: str, tolerance: float) -> bool:
    if _NUMBER.sub("#", shown) != _NUMBER.sub("#", real):
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(real), strict=True)
    return all(
        abs(float(a) - float(b)) <= max(tolerance * abs(float(a)), NEAR_ZERO) for a, b in pairs
    )
