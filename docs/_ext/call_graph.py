"""Draws which file calls which while something is done: a directive that runs it and traces it.

    ```{call-graph} tick
    ```

What can be traced stands in ``ACTIONS``. Compiled functions run as the Python that they are written
in, so that they are seen. ``python docs/_ext/call_graph.py tick`` prints the files, in the order in
which they are entered, with their functions.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from html import escape
from pathlib import Path
from types import FrameType

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("controller", "viz", "motions", "go2_wbc")
LAYER = frozenset(
    f"go2_wbc/{name}.py"
    for name in (
        "arguments",
        "compilation",
        "lazy",
        "machine_code",
        "numba_extensions",
        "records",
        "validation",
        "written",
    )
)
"""How functions are compiled and what they are handed: files below every call, not drawn."""
WIDTH, ROW, INDENT, NOTES_AT = 760, 21, 14, 350
"""Of the picture, its rows, its steps to the right, and where functions stand [px]."""
NOTE_LENGTH = 66
"""Characters that a line has room for."""


@dataclass(slots=True)
class Flow:
    """What was traced.

    Attributes:
        functions: those entered, by file, in the order in which they were.
        callers: the file that calls each file first.
    """

    functions: dict[str, list[str]] = field(default_factory=dict)
    callers: dict[str, str] = field(default_factory=dict)


def traced(action: Callable[[], object]) -> Flow:
    """Which functions of the project run while ``action`` does."""
    flow = Flow()
    files: dict[str, str | None] = {}

    def file_of(frame: FrameType) -> str | None:
        name = frame.f_code.co_filename
        if name not in files:
            path = Path(name)
            is_ours = path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in PACKAGES
            files[name] = str(path.relative_to(ROOT)) if is_ours else None
        return files[name]

    def notice(frame: FrameType, event: str, _argument: object) -> None:
        file = file_of(frame) if event == "call" else None
        if file is None or file in LAYER or frame.f_code.co_name.startswith("<"):
            return
        is_new = file not in flow.functions
        names = flow.functions.setdefault(file, [])
        if (name := frame.f_code.co_qualname) not in names:
            names.append(name)
        caller = frame.f_back
        while caller is not None and (file_of(caller) or "") in (LAYER | {""}):
            caller = caller.f_back
        if is_new and caller is not None and (above := file_of(caller)) in flow.functions:
            flow.callers[file] = str(above)

    sys.setprofile(notice)
    try:
        action()
    finally:
        sys.setprofile(None)
    return flow


def tick() -> Flow:
    """One control tick of a trot."""
    from controller import GO2Controller

    with GO2Controller() as go2:
        go2.stand()
        go2.walk()
        go2.move(0.5)
        go2.wait(2.0)
        _run_plain()
        return traced(go2._runner.loop.tick)


def motion() -> Flow:
    """An authored motion with a step becomes a plan."""
    import motions

    model = motions.FeasibilityChecker().model
    before, timeline = (motions.find_motion(name)() for name in ("wave", "cross_step"))
    motions.compile_timeline(before, model)  # what is imported at the first one is no call
    _run_plain()
    return traced(lambda: motions.compile_timeline(timeline, model))


def check() -> Flow:
    """An authored motion with a step is checked."""
    import motions

    before, timeline = (motions.find_motion(name)() for name in ("wave", "cross_step"))
    motions.check(before)
    _run_plain()
    return traced(lambda: motions.check(timeline))


def remote() -> Flow:
    """A caller of ROS 2's service has the robot walk; what the middleware does is left out."""
    from controller import GO2Controller
    from controller.bridges.ros2.behaviors import order
    from controller.jobs import JobServer

    with GO2Controller() as go2:
        go2.stand()
        jobs = JobServer(go2)

        def call() -> None:
            order(jobs, "walk", lambda _answer: None)
            jobs.work()

        return traced(call)


ACTIONS: dict[str, Callable[[], Flow]] = {
    "tick": tick,
    "motion": motion,
    "check": check,
    "remote-call": remote,
}


def _run_plain() -> None:
    """From now on compiled functions run as the Python that they are written in."""
    from go2_wbc.compilation import all_kernels, call_plain

    for kernel in all_kernels():
        type(kernel).__call__ = call_plain


def picture(flow: Flow, title: str) -> str:
    """The calls as a tree in an SVG: each file once, below the one that calls it first."""
    lines: list[str] = []
    rows: dict[str, int] = {}
    for row, (file, depth) in enumerate(_in_tree(flow)):
        x, y = INDENT * depth + 4, ROW * row + 16
        rows[file] = y
        if (caller := flow.callers.get(file)) is not None:
            lines.append(f'<path d="M{x - 10} {rows[caller] + 5}V{y - 4}H{x - 3}"/>')
        name, functions = Path(file).with_suffix("").as_posix(), _listed(flow.functions[file])
        lines.append(f'<text class="name" x="{x}" y="{y}">{escape(name)}</text>')
        lines.append(f'<text class="note" x="{NOTES_AT}" y="{y}">{escape(functions)}</text>')
    height = ROW * len(rows) + 6
    shape = f'viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}"'
    head = f'<svg class="call-graph" role="img" aria-label="{escape(title)}" {shape} '
    return "\n".join([head + 'xmlns="http://www.w3.org/2000/svg">', *lines, "</svg>"])


def _in_tree(flow: Flow, caller: str | None = None, depth: int = 0) -> Iterator[tuple[str, int]]:
    """Every file and how deep it lies, callers before what they call, in the order of entry."""
    for file in flow.functions:
        if flow.callers.get(file) == caller:
            yield file, depth
            yield from _in_tree(flow, file, depth + 1)


def _listed(functions: list[str]) -> str:
    """As many names as a line has room for."""
    names = [name.rsplit(".", 1)[-1] for name in functions]
    for count in range(len(names), 0, -1):
        text = ", ".join(names[:count])
        if len(text) <= NOTE_LENGTH:
            return text if count == len(names) else f"{text}, ..."
    return names[0]


def traced_apart(name: str) -> Flow:
    """What a process of its own has traced of an action."""
    command = [sys.executable, __file__, name, "--json"]
    told = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT)
    return Flow(**json.loads(told.stdout))


class CallGraph(SphinxDirective):
    """The directive ``call-graph``: what a process of its own has traced."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Trace the action that is named."""
        (name,) = self.arguments
        flow = traced_apart(name)
        for file in flow.functions:
            self.env.note_dependency(str(ROOT / file))
        drawn = picture(flow, f"which file calls which: {name}")
        return [nodes.raw("", f'<div class="wide">{drawn}</div>', format="html")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("call-graph", CallGraph)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    found = ACTIONS[sys.argv[1]]()
    if "--json" in sys.argv:
        print(json.dumps(asdict(found)))
    else:
        for entered, functions in found.functions.items():
            print(f"{entered}: {', '.join(functions)}")
        print(f"{len(found.functions)} files, {sum(map(len, found.functions.values()))} functions")
