"""The notebooks run from a clean kernel, say what their committed outputs say, and are small."""

import ast
import importlib.util
import json
import os
import re
from pathlib import Path
from typing import Any

import pytest

from tests.pages import USERS_BIN, as_user, difference
from tests.script_server import ROOT, python

FOLDER = ROOT / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
NAMES = ("designing_a_motion", "first_steps", "how_the_wbc_works", "reading_a_recording")
LARGEST = 300_000  #: Bytes of a notebook with its outputs
NEAR = 0.1
"""Relative difference from the committed numbers: a run repeats to the bit on one machine only."""
QUANTITY = re.compile(r"(\d+(?:\.\d+)?) (mm|cm|m/s|m|rad|deg|s|ms|N m|N s|N|kg|MB|%)(?![\w^])")
"""A number with its unit, and how many of the base unit that is."""
SCALES = {"mm": 1e-3, "cm": 1e-2, "ms": 1e-3, "%": 1e-2}
ROUNDING = re.compile(r"\d(\.\d+)?e-\d\d")  #: Errors of rounding, which differ between machines
MACHINE = re.compile(r"/(home|root|work|tmp|Users|usr|opt|var)/|[A-Z]:\\")
NEEDED = ("nbclient", "nbformat", "ipykernel", "matplotlib", "pandas")
MISSING = [name for name in NEEDED if importlib.util.find_spec(name) is None]
IS_REQUIRED = os.environ.get("GO2_WBC_REQUIRE_NOTEBOOKS") == "1"
"""Set where nothing may be missing: a notebook that cannot run is then a failure."""


def name_of(path: Path) -> str:
    return path.stem


def cells(path: Path, kind: str = "code") -> list[dict[str, Any]]:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [cell for cell in notebook["cells"] if cell["cell_type"] == kind]


def printed(cell: dict[str, Any]) -> str:
    """The text among a cell's outputs."""
    texts = [
        output.get("text") or output.get("data", {}).get("text/plain", "")
        for output in cell["outputs"]
    ]
    return "".join("".join(text) for text in texts)


def pictures(cell: dict[str, Any]) -> int:
    return sum("image/png" in output.get("data", {}) for output in cell["outputs"])


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_a_notebook_runs_from_a_clean_kernel_as_it_is_committed(
    notebook: Path, tmp_path: Path
) -> None:
    if MISSING and not USERS_BIN:
        reason = f"not installed: {', '.join(MISSING)}"
        assert not IS_REQUIRED, reason
        pytest.skip(reason)
    command = [str(FOLDER / "execute.py"), notebook.stem, "--out", str(tmp_path)]
    if USERS_BIN:
        done = as_user([f"{USERS_BIN}/python", *command], tmp_path)
    else:
        done = python(*command, PYTHONPATH=str(ROOT))
    assert done.returncode == 0, done.stderr
    fresh = tmp_path / notebook.name
    for old, new in zip(cells(notebook), cells(fresh), strict=True):
        shown, real = (ROUNDING.sub("tiny", printed(cell)) for cell in (old, new))
        assert difference(shown, real, NEAR) == "", real
        assert pictures(old) == pictures(new)
    check_outputs(fresh)


def check_outputs(notebook: Path) -> None:
    """Every cell has run once, in order, and nothing complains or tells of the machine."""
    code = cells(notebook)
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    for cell in code:
        for output in cell["outputs"]:
            assert output.get("name") != "stderr", output
            assert output["output_type"] != "error"
            assert set(output.get("data", {})) <= {"text/plain", "image/png"}
        text = printed(cell)
        assert "Warning" not in text
        assert not MACHINE.search(text), text
    assert notebook.stat().st_size <= LARGEST


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_a_committed_notebook_has_run_and_is_clean(notebook: Path) -> None:
    check_outputs(notebook)
    content = json.loads(notebook.read_text(encoding="utf-8"))
    assert set(content["metadata"]) == {"kernelspec", "language_info"}
    assert content["metadata"]["language_info"] == {"name": "python"}
    assert [cell["metadata"] for cell in content["cells"]] == [{}] * len(content["cells"])
    assert len({cell["id"] for cell in content["cells"]}) == len(content["cells"])
    assert sum(pictures(cell) for cell in cells(notebook)) >= 2


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_a_notebook_explains_itself_and_links_to_what_exists(notebook: Path) -> None:
    prose = ["".join(cell["source"]) for cell in cells(notebook, "markdown")]
    assert prose[0].startswith("# ")
    assert len(prose) >= len(cells(notebook)) - 1
    for text in prose:
        for target in re.findall(r"\]\(([^)#]+)", text):
            assert (FOLDER / target).exists(), target
        for target in re.findall(r"`((?:docs|examples|go2_wbc)/[a-z0-9_/.]*)`", text):
            assert (ROOT / target).exists(), target


def numbers(text: str) -> list[float]:
    return [abs(float(word)) for word in re.findall(r"\d+(?:\.\d+)?(?:e-?\d+)?", text)]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_a_quantity_that_the_prose_states_is_computed_or_given_in_a_cell(notebook: Path) -> None:
    """A text told of calves beyond their limit where its own table showed that they were not."""
    code = cells(notebook)
    known = numbers("\n".join(f"{''.join(cell['source'])}\n{printed(cell)}" for cell in code))
    for text in ("".join(cell["source"]) for cell in cells(notebook, "markdown")):
        for word, unit in QUANTITY.findall(text):
            scale, digits = SCALES.get(unit, 1.0), len(word.partition(".")[2])
            rounding = (0.5 * 10.0**-digits + 1e-9) * scale
            stated = float(word) * scale
            assert any(abs(number - stated) <= rounding for number in known), f"{word} {unit}"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_a_notebook_uses_public_names(notebook: Path) -> None:
    tree = ast.parse("\n".join("".join(cell["source"]) for cell in cells(notebook)))
    names = [node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    assert [name for name in names if name.startswith("_")] == []


def test_there_are_the_four_notebooks() -> None:
    assert tuple(path.stem for path in NOTEBOOKS) == NAMES
