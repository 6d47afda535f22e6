"""What the README shows works: its Python runs, its TOML loads, its commands and files exist.

A Python block whose first line starts with ``# not run by the tests`` is compiled only.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc.config import Config, load_config

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("README.md", "CONTRIBUTING.md")
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
ANCHOR = re.compile(r"\]\(#([^)]+)\)")
NOT_RUN = "# not run by the tests"
MOST_LINES_OF_THE_FIRST = 12
FIRST_SCREEN = 40
"""Lines of Markdown that a person sees before scrolling, the picture counted as one."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, text, and the line of the page on which it starts."""

    language: str
    text: str
    line: int


def page(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(name: str, language: str) -> list[Block]:
    text = page(name)
    found = (
        Block(match[1], match[2], text.count("\n", 0, match.start()) + 1)
        for match in FENCE.finditer(text)
    )
    return [block for block in found if block.language == language]


def name_of(block: Block) -> str:
    return f"line {block.line}"


PYTHON = blocks("README.md", "python")
RUNNING = [block for block in PYTHON if not block.text.startswith(NOT_RUN)]


def command_lines(name: str) -> list[list[str]]:
    """Words of every shell line, comments dropped."""
    lines = (line for block in blocks(name, "sh") for line in block.text.splitlines())
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def test_the_readme_has_blocks_to_test() -> None:
    assert len(RUNNING) >= 8
    assert len(blocks("README.md", "toml")) == 1


@pytest.mark.parametrize("block", PYTHON, ids=name_of)
def test_a_python_block_compiles(block: Block) -> None:
    compile(block.text, f"README.md:{block.line}", "exec")


@pytest.mark.slow
@pytest.mark.parametrize("block", RUNNING, ids=name_of)
def test_a_python_block_runs_alone_and_says_nothing_bad(block: Block, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", "-c", block.text],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "False" not in done.stdout


def test_the_first_screen_has_picture_commands_and_ten_lines() -> None:
    first = "\n".join(page("README.md").splitlines()[:FIRST_SCREEN])
    assert "](docs/images/demo.png)" in first
    assert "make demo" in first
    assert "make test" in first
    assert PYTHON[0].line < FIRST_SCREEN
    assert len(PYTHON[0].text.splitlines()) <= MOST_LINES_OF_THE_FIRST


def test_the_picture_is_small_enough_for_the_repository() -> None:
    assert (ROOT / "docs/images/demo.png").stat().st_size < 500_000


def test_the_configuration_example_loads_and_changes_what_it_names(tmp_path: Path) -> None:
    (block,) = blocks("README.md", "toml")
    file = tmp_path / "mine.toml"
    file.write_text(block.text, encoding="utf-8")
    config = load_config(file)
    assert config.locomotion.height == 0.27
    assert config != Config()


@pytest.mark.parametrize("name", PAGES)
def test_every_command_is_one_of_the_command_line_with_options_that_exist(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parsed by the program's own parser and stopped before the run."""
    modules = {command.name: command.module for command in cli.COMMANDS}
    calls = [words for words in command_lines(name) if words[0].endswith("go2-wbc")]
    for words in calls:
        assert words[1] in modules, words
        module = cli.importlib.import_module(modules[words[1]])
        monkeypatch.setattr(module, "run", lambda _args: ExitCode.OK)
        assert cli.main(words[1:]) == ExitCode.OK, words


@pytest.mark.parametrize("name", PAGES)
def test_every_make_target_exists(name: str) -> None:
    targets = set(re.findall(r"^([a-z0-9-]+):", page("Makefile"), re.MULTILINE))
    named = {words[1] for words in command_lines(name) if words[0] == "make"}
    named |= set(re.findall(r"`make ([a-z0-9-]+)", page(name)))
    assert named
    assert named <= targets


@pytest.mark.parametrize("name", PAGES)
def test_every_file_that_is_linked_or_named_exists(name: str) -> None:
    text = page(name)
    linked = {target for target in LINK.findall(text) if "://" not in target}
    named = set(re.findall(r"`((?:go2_wbc|controller|motions|viz|tests)/[a-z0-9_/.]+)`", text))
    missing = [path for path in sorted(linked | named) if not (ROOT / path).exists()]
    assert missing == []


def test_every_section_that_is_linked_exists() -> None:
    text = page("README.md")
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    known = {re.sub(r"[^\w\- ]", "", title).lower().replace(" ", "-") for title in titles}
    assert set(ANCHOR.findall(text)) <= known


def test_the_names_in_the_table_of_methods_are_methods() -> None:
    from controller import GO2Controller

    table = page("README.md").split("## What it can do")[1].split("\n\n")[1]
    cells = [line.split("|")[1] for line in table.splitlines()[2:]]
    names = {name for cell in cells for name in re.findall(r"`(\w+)", cell)}
    assert names >= {"stand", "sit", "walk", "move", "stop", "high_five", "turn_left", "wait"}
    assert [name for name in sorted(names) if not hasattr(GO2Controller, name)] == []


@pytest.mark.parametrize("name", PAGES)
def test_no_line_is_wider_than_a_page_outside_tables(name: str) -> None:
    wide = [
        line
        for line in page(name).splitlines()
        if len(line) > 115 and not line.startswith("|") and "](" not in line
    ]
    assert wide == []
