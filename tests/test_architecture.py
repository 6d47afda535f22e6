"""The house stays as it is drawn: who imports whom, how long things are, what is documented.

Each rule is tested twice: this project keeps it, and a small tree that breaks it is caught.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests import architecture_rules as rules

ROOT = Path(__file__).resolve().parent.parent
STDLIB = frozenset(sys.stdlib_module_names)
PYPROJECT = '[project]\ndependencies = ["numpy>=2,<3", "pin", "pillow[webp]==11"]\n'


@pytest.fixture(scope="module")
def project() -> list[rules.Module]:
    return rules.read_tree(ROOT)


def synthetic(tmp_path: Path, files: dict[str, str]) -> list[rules.Module]:
    for name, text in files.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return rules.read_tree(tmp_path)


def function_of(lines: int, name: str = "f") -> str:
    body = "    x = 1\n" * lines
    return f'def {name}():\n    """Say.\n\n    More.\n    """\n{body}\n'


def test_the_checker_sees_all_packages(project: list[rules.Module]) -> None:
    assert {module.path.split("/")[0] for module in project} == set(rules.PACKAGES)
    assert "go2_wbc/errors.py" in {module.path for module in project}


def lint_imports(root: Path) -> tuple[int, str]:
    """Exit code and report of import-linter on the packages in ``root``."""
    process = subprocess.run(
        [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root), "COLUMNS": "200"},
        capture_output=True,
        text=True,
    )
    return process.returncode, process.stdout


def test_packages_and_rooms_import_only_what_the_contracts_allow() -> None:
    code, report = lint_imports(ROOT)
    assert code == 0, report


def test_every_imported_library_is_a_declared_dependency(project: list[rules.Module]) -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert rules.undeclared_libraries(project, text, STDLIB) == []


def test_every_data_file_is_packaged() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert rules.unpackaged_files(ROOT, text) == []


def test_no_file_is_too_long(project: list[rules.Module]) -> None:
    assert rules.long_files([*project, *rules.read_tree(ROOT, ["tests"])]) == []


def test_functions_stay_small(project: list[rules.Module]) -> None:
    assert rules.long_functions(project) == []


def test_every_contract_catches_an_import_that_breaks_it(tmp_path: Path) -> None:
    """Also imports inside functions and under ``TYPE_CHECKING``."""
    for file in (ROOT / package for package in rules.PACKAGES):
        shutil.copytree(file, tmp_path / file.name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / ".importlinter", tmp_path)
    broken = {
        "motions/arguments.py": "def f():\n    from controller import GO2Controller",
        "go2_wbc/contacts.py": "from go2_wbc.planning import swing",
        "go2_wbc/attic.py": "",
        "controller/loop.py": "if TYPE_CHECKING:\n    import controller.cli",
        "viz/render/camera.py": "from viz.replay import page_data",
        "go2_wbc/wbc/tasks.py": "import go2_wbc.wbc.controller",
        "go2_wbc/plant/sensors.py": "import mujoco",
        "controller/pacing.py": "import mujoco.viewer as v",
        "motions/authoring.py": "from placo import KinematicsSolver",
        "controller/cli/motion_preview.py": "def f():\n    import meshcat",
    }
    for name, statement in broken.items():
        with (tmp_path / name).open("a", encoding="utf-8") as file:
            file.write(f"\n{statement}\n")
    code, report = lint_imports(tmp_path)
    assert code == 1
    assert "0 kept" in report, report
    for clue in (
        "motions.arguments -> controller",
        "go2_wbc.contacts -> go2_wbc.planning.swing",
        "go2_wbc.attic",
        "controller.loop -> controller.cli",
        "viz.render.camera -> viz.replay.page_data",
        "go2_wbc.plant.sensors -> mujoco",
        "controller.pacing -> mujoco",
        "motions.authoring -> placo",
        "controller.cli.motion_preview -> meshcat",
    ):
        assert clue in report


def test_an_undeclared_library_is_caught(tmp_path: Path) -> None:
    files = {"viz/plots.py": "import ast\nimport numpy\nimport PIL\nimport pinocchio\nimport scipy"}
    found = rules.undeclared_libraries(synthetic(tmp_path, files), PYPROJECT, STDLIB)
    assert found == ["viz/plots.py:5: scipy is not a dependency in pyproject.toml"]


def test_a_data_file_that_no_pattern_covers_is_caught(tmp_path: Path) -> None:
    synthetic(tmp_path, {"viz/assets/page.html": "", "viz/assets/font.woff": "", "viz/a.py": ""})
    text = '[tool.setuptools.package-data]\n"*" = ["**/*.html"]\n'
    assert rules.unpackaged_files(tmp_path, text) == [
        "viz/assets/font.woff: not covered by package-data in pyproject.toml"
    ]


def test_a_file_one_line_too_long_is_caught(tmp_path: Path) -> None:
    files = {"viz/a.py": "x = 1\n" * 500, "viz/b.py": "x = 1\n" * 501}
    assert rules.long_files(synthetic(tmp_path, files)) == ["viz/b.py: 501 lines, at most 500"]


def test_a_body_one_line_too_long_is_caught_and_its_docstring_is_free(tmp_path: Path) -> None:
    small = "".join(function_of(1, f"g{index}") for index in range(30))
    files = {"viz/a.py": function_of(70) + small, "viz/b.py": function_of(71) + small}
    assert rules.long_functions(synthetic(tmp_path, files)) == [
        "viz/b.py:1: f: body of 71 lines, at most 70"
    ]


def test_many_long_bodies_are_caught_by_the_percentile(tmp_path: Path) -> None:
    nine_small = "".join(function_of(1, f"g{index}") for index in range(9))
    just_kept = synthetic(tmp_path / "kept", {"viz/a.py": nine_small + function_of(31)})
    broken = synthetic(tmp_path / "broken", {"viz/a.py": nine_small + function_of(31) * 2})
    assert rules.long_functions(just_kept) == []
    assert rules.long_functions(broken)[0].startswith("90th percentile of the bodies: 31")
