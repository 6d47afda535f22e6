"""What the README shows works: its Python runs, its TOML loads; the commands of all pages exist.

A Python block whose first line starts with ``# not run by the tests`` is compiled only.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc.config import Config, load_config
from tests.pages import (
    NOT_RUN,
    PAGES,
    ROOT,
    Block,
    blocks,
    command_lines,
    name_of,
    page,
    run_python,
)

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
ANCHOR = re.compile(r"\]\(#([^)]+)\)")
MOST_LINES_OF_THE_FIRST = 12
FIRST_SCREEN = 40
"""Lines of Markdown that a person sees before scrolling, the picture counted as one."""

PYTHON = blocks("README.md", "python")
RUNNING = [block for block in PYTHON if not block.text.startswith(NOT_RUN)]


def test_the_readme_has_blocks_to_test() -> None:
    assert len(RUNNING) >= 8
    assert len(blocks("README.md", "toml")) == 1


@pytest.mark.parametrize("block", PYTHON, ids=name_of)
def test_a_python_block_compiles(block: Block) -> None:
    compile(block.text, f"README.md:{block.line}", "exec")


@pytest.mark.slow
@pytest.mark.parametrize("block", RUNNING, ids=name_of)
def test_a_python_block_runs_alone_and_says_nothing_bad(block: Block, tmp_path: Path) -> None:
    done = run_python(block.text, tmp_path)
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


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md"])
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
    folder = (ROOT / name).parent
    missing = [path for path in sorted(linked) if not (folder / path).exists()]
    missing += [path for path in sorted(named) if not (ROOT / path).exists()]
    assert missing == []


@pytest.mark.parametrize("name", PAGES)
def test_every_section_that_is_linked_exists(name: str) -> None:
    text = page(name)
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
