"""Compiled kernels are kept, shared, and made anew when what was kept is of no use."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from go2_wbc.kernels import compilation
from go2_wbc.kernels.compilation import kernel, kernel_folder, subroutine

SCRIPT = """
from go2_wbc.kernels.compilation import kernel

@kernel("f8(f8)")
def cube(x):
    return x * x * x

assert cube(2.0) == 8.0
print(sum(cube.stats.cache_hits.values()))
"""


LOADING = """
import sys
import numpy as np
from go2_wbc.kernels.compilation import kernel, subroutine

@subroutine("f8(f8[::1])")
def smallest(x):
    least = x[0]
    for value in x:
        least = min(least, value)
    return least

@kernel("f8(f8[::1], i8)")
def spread(x, n):
    copy = np.zeros(n)
    copy[:] = x
    return np.max(copy) - smallest(x)

assert spread(np.array([1.0, 5.0, 2.0]), 3) == 4.0
try:
    spread(np.zeros(3), 2)
except ValueError as error:
    print(error)
print(sum(spread.stats.cache_hits.values()), sum(smallest.stats.cache_hits.values()))
print([name for name in ("scipy.linalg", "numba.np.linalg") if name in sys.modules])
"""


def square(x):  # noqa: ANN001, ANN201 - numba reads the signature given to the decorator
    return x * x


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache; the process's own one is used again afterwards."""
    monkeypatch.setenv(compilation.CACHE_VARIABLE, str(tmp_path))
    kernel_folder.cache_clear()
    yield tmp_path
    kernel_folder.cache_clear()


def compile_square() -> int:
    """Compile; returns how many kernels came from the cache."""
    compiled = kernel("f8(f8)")(square)
    assert compiled(3.0) == 9.0
    return sum(compiled.stats.cache_hits.values())  # pyright: ignore[reportFunctionMemberAccess]


def test_a_kernel_is_compiled_once_and_says_so(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert compile_square() == 0
    assert "compiling the control kernels for this machine, once" in caplog.text
    caplog.clear()
    kernel_folder.cache_clear()  # as another process would
    assert compile_square() == 1
    assert not caplog.text


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", ["emptied", "truncated", "overwritten"])
def test_a_damaged_file_is_made_anew(
    folder: Path, caplog: pytest.LogCaptureFixture, suffix: str, damage: str
) -> None:
    compile_square()
    (file,) = folder.rglob(f"*{suffix}")
    content = file.read_bytes()
    rubbish = {"emptied": b"", "truncated": content[: len(content) // 2], "overwritten": b"x" * 99}
    file.write_bytes(rubbish[damage])
    caplog.clear()
    assert compile_square() == 0
    assert "are of no use" in caplog.text
    assert compile_square() == 1


def test_a_place_that_cannot_be_written_costs_time_only(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    file = folder / "a file"
    file.touch()
    monkeypatch.setenv(compilation.CACHE_VARIABLE, str(file / "below"))
    assert compile_square() == 0
    assert compilation.CACHE_VARIABLE in caplog.text
    assert kernel_folder() is None


def test_another_processor_version_or_source_gets_a_folder_of_its_own(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = kernel_folder()
    for owner, name, value in (
        (compilation.llvmlite.binding, "get_host_cpu_name", lambda: "another"),
        (compilation.platform, "python_version", lambda: "3.99.0"),
        (compilation.numba, "__version__", "99.0"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, value)
            kernel_folder.cache_clear()
            assert kernel_folder() != first
    kernel_folder.cache_clear()
    assert kernel_folder() == first


def test_four_processes_share_a_cold_cache(tmp_path: Path) -> None:
    root = str(Path(__file__).resolve().parents[3])
    environment = {
        **os.environ,
        "PYTHONPATH": root,
        compilation.CACHE_VARIABLE: str(tmp_path / "kept"),
    }
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script)]
    running = [
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    for process in running:
        process.communicate()
        assert process.returncode == 0
    late = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    assert late.stdout.strip() == "1"


def test_the_users_own_numba_cache_is_left_alone(folder: Path) -> None:
    before = compilation.numba.config.CACHE_DIR
    compile_square()
    assert before == compilation.numba.config.CACHE_DIR


def test_what_is_kept_lies_in_the_named_folder(folder: Path) -> None:
    logging.getLogger("numba").setLevel(logging.WARNING)
    compile_square()
    assert any(folder.rglob("*.nbc"))


def run_script(folder: Path, script: str) -> list[str]:
    """Lines that a process prints whose kernels are kept below ``folder``."""
    path = folder / "script.py"
    path.write_text(script)
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(__file__).resolve().parents[3]),
        compilation.CACHE_VARIABLE: str(folder / "kept"),
    }
    command = [sys.executable, str(path)]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.splitlines()


def test_loading_takes_the_kernels_alone_and_nothing_of_the_compiler(tmp_path: Path) -> None:
    compiled, loaded = run_script(tmp_path, LOADING), run_script(tmp_path, LOADING)
    assert compiled[1:] == ["0 0", "['scipy.linalg', 'numba.np.linalg']"]
    assert loaded[1:] == ["1 0", "[]"]
    assert "cannot assign slice" in loaded[0]  # numba's own errors, too
    assert loaded[0] == compiled[0]
    assert len(list((tmp_path / "kept").rglob("*.nbc"))) == 1


def test_a_kernel_that_was_loaded_can_be_called_by_one_that_is_compiled(folder: Path) -> None:
    assert compile_square() == 0
    loaded = kernel("f8(f8)")(square)
    assert sum(loaded.stats.cache_hits.values()) == 1  # pyright: ignore[reportFunctionMemberAccess]

    @kernel("f8(f8)")
    def next_square(x):  # noqa: ANN001, ANN202
        return loaded(x) + 1.0

    assert next_square(3.0) == 10.0
    assert loaded(2.0) == 4.0


def test_a_subroutine_is_compiled_for_its_signature_whoever_calls_it() -> None:
    @subroutine("f8(f8)")
    def half(x):  # noqa: ANN001, ANN202
        return x / 2

    @kernel("f8(i8)")
    def half_of_whole(n):  # noqa: ANN001, ANN202
        return half(n)

    assert half_of_whole(3) == 1.5
    assert [str(s) for s in half.signatures] == ["(float64,)"]  # pyright: ignore[reportFunctionMemberAccess]
