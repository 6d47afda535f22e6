"""The README's first screen, and what all pages have in common: commands, links, width."""

import re
from pathlib import Path
from types import ModuleType

import pytest
from PIL import Image

from benchmarks import __main__ as benchmarks
from controller.cli import main as cli
from tests.pages import MADE, NOT_RUN, PAGES, ROOT, blocks, command_lines, page, table_rows

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
ANCHOR = re.compile(r"\]\(([^)#\s]*\.md)?#([^)]+)\)")
NAMED = re.compile(
    r"`((?:go2_wbc|controller|motions|viz|tests|benchmarks|docs|examples)/[a-z0-9_/.]+)`"
)
MOST_LINES = 100
MOST_LINES_OF_THE_FIRST = 12
FIRST_SCREEN = 40
"""Lines of Markdown that a person sees before scrolling, the picture counted as one."""
EVIDENCE = "docs/evidence.md"
PICTURE = "docs/images/demo.webp"

PYTHON = blocks("README.md", "python")


def test_the_readme_is_short_and_begins_with_a_small_moving_picture_and_a_command() -> None:
    assert len(page("README.md").splitlines()) <= MOST_LINES
    assert any(not block.text.startswith(NOT_RUN) for block in PYTHON)
    first = "\n".join(page("README.md").splitlines()[:FIRST_SCREEN])
    assert f"]({PICTURE})" in first
    assert "make demo" in first
    assert PYTHON[0].line < FIRST_SCREEN
    assert len(PYTHON[0].text.splitlines()) <= MOST_LINES_OF_THE_FIRST
    assert (ROOT / PICTURE).stat().st_size < 1_500_000
    with Image.open(ROOT / PICTURE) as image:
        assert getattr(image, "n_frames", 1) > 50


def test_the_first_page_of_the_site_shows_what_the_readme_shows() -> None:
    assert blocks("docs/index.md", "python")[0].text == PYTHON[0].text
    assert PICTURE.removeprefix("docs/") in page("docs/index.md")


def test_every_measured_number_of_the_readme_is_one_of_the_evidence() -> None:
    """Row by row: what, n, mean, worst and the peer's figure."""
    evidence = table_rows(page(EVIDENCE), "what")
    shown = table_rows(page("README.md"), "measured")
    assert len(shown) >= 5
    assert [row for row in shown if row not in evidence] == []


def test_the_citation_names_this_version_and_licence() -> None:
    project = page("pyproject.toml")
    citation = dict(re.findall(r"^([a-z-]+): (.+)$", page("CITATION.cff"), re.MULTILINE))
    for key in ("version", "license"):
        assert f'\n{key} = "{citation[key]}"\n' in project
    assert citation["title"] == "go2-wbc"
    assert "authors:\n  - name: The go2_wbc authors\n" in page("CITATION.cff")


@pytest.mark.parametrize("name", PAGES)
def test_every_command_is_one_of_the_command_line_with_options_that_exist(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parsed by the program's own parser and stopped before the run."""
    monkeypatch.chdir(tmp_path)
    for program, words in _calls(name):
        assert words[0] in {command.name for command in program.COMMANDS}, words
        own = cli.Program("", "", program.COMMANDS, "")
        assert cli.build_parser(own, words[0]).parse_args(words).run, words


def _calls(name: str) -> list[tuple[ModuleType, list[str]]]:
    """The program of every line that calls one of ours, and its arguments."""
    found = []
    for words in command_lines(name):
        if words[0].endswith("go2-wbc"):
            found.append((cli, words[1:]))
        elif words[:3] == ["python", "-m", "benchmarks"]:
            found.append((benchmarks, words[3:]))
    return found


@pytest.mark.parametrize("name", PAGES)
def test_every_make_target_exists(name: str) -> None:
    targets = set(re.findall(r"^([a-z0-9-]+):", page("Makefile"), re.MULTILINE))
    named = {words[1] for words in command_lines(name) if words[0] == "make"}
    named |= set(re.findall(r"`make ([a-z0-9-]+)", page(name)))
    assert named or name not in ("README.md", "CONTRIBUTING.md")
    assert named <= targets


@pytest.mark.parametrize("name", PAGES)
def test_every_file_that_is_linked_or_named_exists(name: str) -> None:
    text = page(name)
    folder = (ROOT / name).parent
    linked = {target for target in LINK.findall(text) if "://" not in target}
    named = {path for path in NAMED.findall(text) if not path.startswith(MADE)}
    missing = [path for path in sorted(linked) if not _exists(folder / path)]
    missing += [path for path in sorted(named) if not (ROOT / path).exists()]
    assert missing == []


def _exists(file: Path) -> bool:
    """Whether it is there, or a page that the build makes from a package of ours."""
    name = file.resolve().relative_to(ROOT).as_posix()
    if name.startswith(MADE):
        return (ROOT / Path(name).stem.replace(".", "/")).is_dir()
    return file.exists()


@pytest.mark.parametrize("name", PAGES)
def test_every_section_that_is_linked_exists(name: str) -> None:
    folder = (ROOT / name).parent
    for target, anchor in ANCHOR.findall(page(name)):
        text = (folder / target).read_text(encoding="utf-8") if target else page(name)
        titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
        known = {re.sub(r"[^\w\- ]", "", title).lower().replace(" ", "-") for title in titles}
        assert anchor in known, f"{target}#{anchor}"


@pytest.mark.parametrize("name", PAGES)
def test_no_line_is_wider_than_a_page_outside_tables(name: str) -> None:
    wide = [
        line
        for line in page(name).splitlines()
        if len(line) > 115 and not line.startswith(("|", "<!--")) and "](" not in line
    ]
    assert wide == []


METAPHORS = (
    "door",
    "the eyes",
    "witness",
    "nobody means",
    "line that gets it",
    "specimen",
    "errand",
)


@pytest.mark.parametrize("name", PAGES)
def test_no_page_uses_a_metaphor_of_earlier_versions(name: str) -> None:
    text = " ".join(page(name).split()).lower()
    assert [word for word in METAPHORS if re.search(rf"\b{word}s?\b", text)] == []
