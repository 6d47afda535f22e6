"""Compiled kernels are kept, shared, and made anew when what was kept is of no use."""

import json
import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float

from go2_wbc import compilation, machine_code
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.machine_code import CACHE_VARIABLE, KEPT, kernel_folder

ROOT = str(Path(__file__).resolve().parents[2])
SCRIPT = """
import sys
import numpy as np
from jaxtyping import Float
from go2_wbc.compilation import kernel, subroutine

FACTOR = {factor}

@subroutine
def smallest(x: Float[np.ndarray, " n"]) -> float:
    "{doc}"
    least = x[0]
    for value in x:
        least = min(least, value)
    return least * FACTOR

@kernel
def spread(x: Float[np.ndarray, " n"], n: int) -> float:
    copy = np.zeros(n)
    copy[:] = x
    return np.max(copy) - smallest(x)

@kernel
def cube(x: float) -> float:
    return x * x * x

assert spread(np.array([1.0, 5.0, 2.0]), 3) == 5.0 - FACTOR
assert cube(2.0) == 8.0
try:
    spread(np.zeros(3), 2)
except ValueError as error:
    print(error)
print([name for name in ("scipy.linalg", "numba.np.linalg") if name in sys.modules])
"""


def run_script(folder: Path, factor: float = 1.0, doc: str = "") -> list[str]:
    """Lines that a process prints whose kernels are kept in ``folder``."""
    path = folder.parent / "script.py"
    path.write_text(SCRIPT.format(factor=factor, doc=doc))
    environment = {**os.environ, "PYTHONPATH": ROOT, CACHE_VARIABLE: str(folder)}
    environment.pop(compilation.PLAIN_VARIABLE, None)
    command = [sys.executable, str(path)]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.splitlines()


def kept(folder: Path) -> dict[str, int]:
    """Each file of machine code, and which it is: one that was made anew is another."""
    return {file.name: file.stat().st_ino for file in folder.rglob("*.code")}


def square(x: float) -> float:
    return x * x


def compile_square() -> None:
    assert kernel(square)(3.0) == 9.0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache; the process's own one is used again afterwards."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    forget()
    yield tmp_path / "kept"
    forget()


def forget() -> None:
    kernel_folder.cache_clear()
    machine_code.say_that_it_takes_time.cache_clear()


def test_a_kernel_is_compiled_once_and_says_so(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    compile_square()
    assert "compiling the control kernels for this machine, once" in caplog.text
    before = kept(folder)
    caplog.clear()
    forget()  # as another process would
    compile_square()
    assert not caplog.text
    assert kept(folder) == before
    assert len(before) == 1


@pytest.mark.parametrize("damage", ["emptied", "truncated", "overwritten", "one bit"])
def test_a_damaged_file_is_made_anew(
    folder: Path, caplog: pytest.LogCaptureFixture, damage: str
) -> None:
    compile_square()
    (file,) = folder.rglob("*.code")
    content = file.read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 1
    rubbish = {
        "emptied": b"",
        "truncated": content[: len(content) // 2],
        "overwritten": b"x" * 99,
        "one bit": bytes(flipped),
    }
    file.write_bytes(rubbish[damage])
    caplog.clear()
    compile_square()
    assert "is damaged: it is compiled anew" in caplog.text
    caplog.clear()
    compile_square()
    assert not caplog.text


def test_a_kernel_that_is_wrong_leaves_what_is_kept_of_others_alone(folder: Path) -> None:
    """Any error while compiling one emptied the whole folder."""
    compile_square()
    before = kept(folder)

    @kernel
    def wrong(x: float) -> float:
        return x.nothing  # type: ignore[attr-defined]

    with pytest.raises(machine_code.numba.core.errors.NumbaError):
        wrong(1.0)
    assert kept(folder) == before


def test_a_place_that_cannot_be_written_costs_time_only(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    folder.parent.joinpath("a file").touch()
    monkeypatch.setenv(CACHE_VARIABLE, str(folder.parent / "a file" / "below"))
    compile_square()
    assert CACHE_VARIABLE in caplog.text
    assert kernel_folder() is None


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (machine_code.llvmlite.binding, "get_host_cpu_name", lambda: "another"),
        (machine_code.platform, "python_version", lambda: "3.99.0"),
        (machine_code.numba, "__version__", "99.0"),
        (square, "__module__", "moved_to"),  # kept code imports where its parts were
    ],
)
def test_another_processor_version_or_place_gets_files_of_its_own(
    folder: Path, monkeypatch: pytest.MonkeyPatch, owner: object, name: str, value: object
) -> None:
    routine = kernel(square)
    first = machine_code.fingerprint(routine)  # type: ignore[arg-type]
    monkeypatch.setattr(owner, name, value)
    assert machine_code.fingerprint(routine) != first  # type: ignore[arg-type]


def test_what_changes_compiles_what_depends_on_it_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    run_script(folder)
    first = kept(folder)
    run_script(folder, doc="Said in other words.")
    assert kept(folder) == first
    run_script(folder, factor=2.0)
    (new,) = kept(folder).keys() - first.keys()
    assert "spread" in new


def test_loading_takes_the_kernels_alone_and_nothing_of_the_compiler(tmp_path: Path) -> None:
    compiled, loaded = run_script(tmp_path / "kept"), run_script(tmp_path / "kept")
    assert compiled[1:] == ["['scipy.linalg', 'numba.np.linalg']"]
    assert loaded[1:] == ["[]"]
    assert "cannot assign slice" in loaded[0]  # numba's own errors, too
    assert loaded[0] == compiled[0]
    assert len(kept(tmp_path / "kept")) == 2


def test_four_processes_share_a_cold_cache(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    folder.parent.joinpath("script.py").write_text(SCRIPT.format(factor=1.0, doc=""))
    environment = {**os.environ, "PYTHONPATH": ROOT, CACHE_VARIABLE: str(folder)}
    command = [sys.executable, str(folder.parent / "script.py")]
    running = [
        subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) for _ in range(4)
    ]
    assert [process.wait() for process in running] == [0] * 4
    assert len(kept(folder)) == 2
    assert [file.suffix for file in folder.rglob("*") if file.is_file()] == [".code"] * 2


def test_older_versions_of_a_kernel_are_not_kept_for_ever(folder: Path) -> None:
    for factor in range(KEPT + 3):

        @kernel
        def scaled(x: float) -> float:
            return x * factor  # noqa: B023 - called before the next one is made

        assert scaled(2.0) == 2.0 * factor
    assert len(kept(folder)) == KEPT


def test_a_list_says_which_file_a_kernel_of_the_engine_is_in(tmp_path: Path) -> None:
    file, first = machine_code._list_file(tmp_path), ("go2_wbc.a", "a-1.code", [True])
    machine_code._list(tmp_path, "tests.b", "b.code", [False])
    assert not file.exists(), "it is none of the engine's"
    machine_code._list(tmp_path, *first)
    machine_code._list(tmp_path, "go2_wbc.c", "c.code", [])
    told = json.loads(file.read_text(encoding="utf-8"))
    assert told == {"go2_wbc.a": ["a-1.code", [True]], "go2_wbc.c": ["c.code", []]}
    file.unlink()
    machine_code._list(tmp_path, *first)
    assert not file.exists(), "nothing is new"
    machine_code._list(tmp_path, "go2_wbc.a", "a-2.code", [True])
    assert json.loads(file.read_text(encoding="utf-8"))["go2_wbc.a"] == ["a-2.code", [True]]


def test_a_constant_or_annotation_that_compiled_code_cannot_know_is_refused() -> None:
    thing = object()

    @kernel
    def unclear(x: float) -> float:
        return x if thing else 0.0

    with pytest.raises(TypeError, match=r"thing = .* which cannot tell when it changes"):
        unclear(1.0)

    @kernel
    def odd(x: dict[str, float]) -> float:
        return x["a"]

    with pytest.raises(TypeError, match=r"odd: x is declared as dict\[str, float\]"):
        odd({"a": 1.0})


def test_an_array_from_elsewhere_may_have_gaps_and_be_read_only() -> None:
    @kernel
    def total(x: Foreign[Float[np.ndarray, " n"]]) -> float:
        return x.sum()

    frozen = np.arange(4.0)
    frozen.flags.writeable = False
    assert total(frozen) == 6.0
    assert total(np.arange(8.0)[::2]) == 12.0


def test_a_subroutine_and_a_kernel_can_be_called_by_compiled_code_and_by_python() -> None:
    @subroutine
    def half(x: float) -> float:
        return x / 2

    squared = kernel(square)

    @kernel
    def both(n: int) -> float:
        return half(n) + squared(n)

    assert both(3) == 1.5 + 9.0
    assert half(3.0) == 1.5


def test_every_module_that_holds_kernels_is_loaded_ahead() -> None:
    holders = set()
    for package in ("go2_wbc", "motions", "controller"):
        for file in (Path(ROOT) / package).rglob("*.py"):
            if any(line.startswith("@kernel") for line in file.read_text().splitlines()):
                holders.add(".".join(file.relative_to(ROOT).with_suffix("").parts))
    assert holders == set(compilation.MODULES)


def test_the_users_own_numba_cache_is_left_alone(folder: Path) -> None:
    before = machine_code.numba.config.CACHE_DIR
    compile_square()
    assert before == machine_code.numba.config.CACHE_DIR
    logging.getLogger("numba").setLevel(logging.WARNING)


def test_plain_kernels_are_the_python_that_they_are_written_in() -> None:
    script = (
        "import numpy as np\n"
        "from go2_wbc.compilation import kernel\n"
        "seen = []\n"
        "@kernel\n"
        "def f(x: float) -> float:\n"
        "    seen.append(x)\n"
        "    return 1.0 / (x - x)\n"
        "print(f(2.0), seen == [2.0])\n"
    )
    environment = {**os.environ, "PYTHONPATH": ROOT, compilation.PLAIN_VARIABLE: "1"}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["inf", "True"]
