"""``python -m tests.mutation``: draws mutants, tests each, and keeps a list that can be resumed."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.mutation.operators import Mutant, draw, mutants_of
from tests.mutation.runner import Outcome, Sandbox, nearest_tests

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGES: tuple[str, ...] = ("go2_wbc", "motions", "viz", "controller")
# Not mutated: their tests need ROS 2 or DDS.
LEFT_OUT = ("controller/bridges", "controller/cli/ros2", "controller/cli/unitree")
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
# Fast tests that take long or need a browser; they run with the whole suite only.
LATE = ("test_seeded_faults.py", "test_pytest_plugin.py", "test_*browser.py")
# A mutant hangs when it takes this many times the good code's CPU time, and the time to start [s].
PATIENCE, START_UP = 3.0, 20.0
NEAR, PACKAGE, SUITE, ALIVE = "own tests", "package's", "whole suite", "alive"


def main(arguments: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Run what the command line asks for; returns 1 if a mutant lives that is not equivalent."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--n", type=int, default=120, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--package", action="append", help="may be repeated")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutation" / "results.jsonl")
    parser.add_argument("--resume", action="store_true", help="skip what the file already lists")
    parser.add_argument("--again", action="store_true", help="try the survivors of the file again")
    parser.add_argument("--whole", action="store_true", help="survivors against the whole suite")
    options = parser.parse_args(arguments)
    packages = options.package or list(PACKAGES)
    results = Results(options.out, keep=options.resume or options.again)
    mutants = [mutant for name in packages for mutant in package_mutants(root, name)]
    if options.again:
        mutants = [mutant for mutant in mutants if mutant.name in results.alive()]
    else:
        mutants = draw(mutants, options.n, options.seed)
    mutants.sort(key=lambda mutant: packages.index(mutant.path.split("/")[0]))
    with tempfile.TemporaryDirectory(prefix="mutation_") as folder:
        judge = Judge(Sandbox(root, Path(folder, "tree")), whole=options.whole)
        for mutant in mutants:
            if options.again or mutant.name not in results.latest:
                results.add(mutant, *judge.judge(mutant))
    sys.stdout.write(results.table())
    return 1 if results.alive() else 0


def package_mutants(root: Path, package: str) -> list[Mutant]:
    """What can be mutated in a package; ``__init__`` files only export."""
    files = {str(file.relative_to(root)): file for file in sorted((root / package).rglob("*.py"))}
    kept = (p for p in files if not p.endswith("__init__.py") and not p.startswith(LEFT_OUT))
    return [mutant for path in kept for mutant in mutants_of(files[path].read_bytes(), path)]


class Judge:
    """Tests a mutant: by its module's own tests, its package's fast ones, then the whole suite."""

    def __init__(self, sandbox: Sandbox, *, whole: bool) -> None:
        self._sandbox, self._whole = sandbox, whole
        self._limits: dict[tuple[str, str], float] = {}
        self._failing: set[str] = set()
        tests = sandbox.home / "tests"
        late = (file for pattern in LATE for file in tests.rglob(pattern))
        self._late = {str(file.relative_to(sandbox.home)) for file in late}

    def judge(self, mutant: Mutant) -> tuple[str, Outcome]:
        """Which tests noticed it, and what they said."""
        sandbox, fast = self._sandbox, f"tests/{mutant.path.split('/')[0]}"
        near = [n for n in nearest_tests(sandbox.home, mutant.path) if n not in self._late]
        stages = [(NEAR, near, fast, "not slow")] if near else []
        stages += [(PACKAGE, [fast], fast, "not slow")]
        if self._whole:
            stages += [(SUITE, ["tests"], "tests", mark) for mark in ("not slow", "slow")]
        source = (sandbox.home / mutant.path).read_bytes()
        outcome = Outcome(True, (), 0.0)
        if not self._limits:
            sandbox.require_import(mutant.path)
        for stage, targets, baseline, marker in stages:
            limit = self._limit(baseline, marker)
            excluded = self._failing | (self._late if stage != SUITE else set())
            excluded |= set(near) if stage == PACKAGE else set()  # they have passed
            sandbox.write(mutant.path, mutant.applied(source))
            outcome = sandbox.test(targets, marker, sorted(excluded), limit)
            sandbox.write(mutant.path, source)
            if not outcome.passed:
                return stage, outcome
        return ALIVE, outcome

    def _limit(self, target: str, marker: str) -> float:
        """CPU time [s] for a mutant; tests that fail without any are left out from here on."""
        if (target, marker) not in self._limits:
            late = self._late if target != "tests" else set()
            good = self._sandbox.test([target], marker, sorted(self._failing | late), limit=0.0)
            self._failing |= set(good.failed)
            self._limits[target, marker] = START_UP + PATIENCE * good.seconds
            sys.stderr.write(f"{target}, {marker}: {good.seconds:.0f} s, failing: {good.failed}\n")
        return self._limits[target, marker]


class Results:
    """A file of one JSON line per tested mutant; a later line of a mutant replaces its earlier."""

    def __init__(self, file: Path, *, keep: bool) -> None:
        self._file = file
        file.parent.mkdir(parents=True, exist_ok=True)
        lines = file.read_text().splitlines() if keep and file.exists() else []
        file.write_text("".join(f"{line}\n" for line in lines))
        self.latest = {record["mutant"]: record for record in map(json.loads, lines)}
        entries = tomllib.loads(EQUIVALENT.read_text()).get("equivalent", [])
        self._equivalent = {entry["mutant"] for entry in entries}

    def add(self, mutant: Mutant, stage: str, outcome: Outcome) -> None:
        """Append a result."""
        told = {"failed": outcome.failed[:1], "seconds": round(outcome.seconds, 1)}
        self.latest[mutant.name] = {"mutant": mutant.name, "stage": stage, **told}
        with self._file.open("a") as stream:
            stream.write(json.dumps(self.latest[mutant.name]) + "\n")

    def alive(self) -> set[str]:
        """The mutants that no test noticed, although they are not equivalent."""
        alive = {name for name, record in self.latest.items() if record["stage"] == ALIVE}
        return alive - self._equivalent

    def table(self) -> str:
        """How many lived and died, by package, and the names of the living."""
        counts: dict[str, Counter[str]] = {}
        for name, record in self.latest.items():
            stage = "equivalent" if name in self._equivalent else record["stage"]
            counts.setdefault(name.split("/")[0], Counter())[stage] += 1
        columns = (NEAR, PACKAGE, SUITE, "equivalent", ALIVE)
        rows = [" | ".join(("package", "mutants", *columns))]
        for package, count in counts.items():
            numbers = (count.total(), *(count[column] for column in columns))
            rows.append(" | ".join((package, *map(str, numbers))))
        return "\n".join([*rows, *sorted(self.alive())]) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
