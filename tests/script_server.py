"""Runs Python programs, each in a process of its own that has the libraries loaded already.

Loading other people's libraries takes longer than most of the programs. A server loads them once
and forks for every program. The process is then as Python makes it: it has its folder,
environment, arguments, module search path and ``__main__``, loads this project's packages itself,
and ends as every interpreter does.
"""

import atexit
import contextlib
import functools
import gc
import importlib
import json
import multiprocessing.process
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LIBRARIES = (
    "numpy",
    "numba",
    "mujoco",
    "pinocchio",
    "coal",
    "jaxtyping",
    "scipy.interpolate",
    "scipy.spatial",
    "placo",
)
"""What most programs load; this project's packages are loaded by each on its own."""
HANGS = 600
"""Time [s] after which a program counts as hanging and is ended; the longest takes 20 s of CPU."""


def run_script(
    arguments: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """What ``python ARGUMENTS`` does with a file, -c or -m; what it uses must not be deprecated."""
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    with tempfile.TemporaryDirectory() as place:
        out, err = Path(place, "out"), Path(place, "err")
        request = {
            "arguments": list(arguments),
            "folder": str(folder),
            "environment": dict(environment),
            "files": [os.devnull, str(out), str(err)],
        }
        server.stdin.write(json.dumps(request) + "\n")
        server.stdin.flush()
        code = int(server.stdout.readline())
        texts = [file.read_text(encoding="utf-8") for file in (out, err)]
    return subprocess.CompletedProcess([sys.executable, *arguments], code, *texts)


def python(
    *words: str, folder: Path = ROOT, **environment: str
) -> subprocess.CompletedProcess[str]:
    """What ``python WORDS`` does that starts anew, with these variables besides."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=HANGS,
    )


def pytest_with(plugin: str, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """What ``pytest WORDS`` does in a folder, with this plugin and no other."""
    paths = os.pathsep.join([str(ROOT), str(folder)])
    alone = {"PYTHONPATH": paths, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return python("-m", "pytest", "-p", plugin, *words, folder=folder, **alone)


@functools.cache
def _server() -> subprocess.Popen[str]:
    """One for each process of tests; it ends with its input."""
    server = subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import serve; serve()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        text=True,
    )
    atexit.register(server.communicate)
    return server


def serve() -> None:
    """Read requests, run each in a fork, answer with its exit code."""
    for library in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(library)
    gc.freeze()  # a program's collector, the last one at its end too, passes over the libraries
    for line in sys.stdin:
        with warnings.catch_warnings():  # the threads of the libraries rest
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child == 0:
            _become(json.loads(line))
            return
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


def _become(request: Mapping[str, Any]) -> None:
    """Run the program in this process, which ends after it."""
    for target, file in enumerate(request["files"]):
        source = os.open(file, os.O_RDWR | os.O_CREAT, 0o600)
        os.dup2(source, target)
        os.close(source)
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    multiprocessing.process.ORIGINAL_DIR = request["folder"]  # type: ignore[attr-defined]
    signal.alarm(HANGS)
    warnings.filterwarnings("error", category=DeprecationWarning, module="__main__$")
    first, *rest = request["arguments"]
    if first == "-m":
        sys.argv, sys.path[0] = rest, request["folder"]
        runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
        return
    main = sys.modules["__main__"]
    vars(main).pop("serve")
    if first == "-c":
        sys.argv, sys.path[0] = [first, *rest[1:]], ""
        code = compile(rest[0], "<string>", "exec")
    else:
        main.__file__ = str(Path(request["folder"], first))
        sys.argv, sys.path[0] = [first, *rest], str(Path(main.__file__).parent)
        code = compile(Path(first).read_bytes(), main.__file__, "exec")
    exec(code, vars(main))
