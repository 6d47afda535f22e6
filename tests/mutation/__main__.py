"""``python -m tests.mutation``: draws mutants, tests each, and keeps a list that can be resumed."""

import argparse
import json
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.mutation.operators import Mutant, draw, mutants_of
from tests.mutation.runner import Outcome, Sandbox, nearest_tests, own_tests

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGES: tuple[str, ...] = ("go2_wbc", "motions", "viz", "controller")
# Not mutated: their tests need ROS 2 or DDS.
LEFT_OUT = ("controller/bridges", "controller/cli/bridges")
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
# Fast tests that take long or need a browser; they run with the whole suite only.
LATE = ("test_seeded_faults.py", "test_pytest_plugin.py", "test_*browser.py")
STAGES = NEAR, PACKAGE, SUITE = "module", "package", "suite"
ALIVE, TIMEOUT = "alive", "timeout"
PLAIN = "plain"
# CPU time [s] after which a mutant hangs: some times what the good code takes, and compiling. Plain
# Python may take longer, so nothing is judged by its time.
LIMITS = {PLAIN: 40.0, NEAR: 90.0, PACKAGE: 600.0, SUITE: 3600.0}


def main(arguments: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Run what the command line asks for; returns 1 if a mutant lives that is not equivalent."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--n", type=int, default=120, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--package", action="append", help="may be repeated")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutation" / "results.jsonl")
    parser.add_argument("--resume", action="store_true", help="skip what the file already lists")
    parser.add_argument("--again", action="store_true", help="try the survivors of the file again")
    parser.add_argument("--until", choices=STAGES, default=PACKAGE, help="last tests to try")
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
        judge = Judge(Sandbox(root, Path(folder, "tree")), last=options.until)
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
    """Tests a mutant: by its module's own tests, its package's fast ones, then the whole suite.

    Most are noticed by the module's own tests, which run first, and plain: compiling takes long.
    """

    def __init__(self, sandbox: Sandbox, *, last: str) -> None:
        self._sandbox, self._last = sandbox, last
        self._passing: dict[tuple[str, bool], bool] = {}  # without any mutant; and plain
        tests = sandbox.home / "tests"
        late = (file for pattern in LATE for file in tests.rglob(pattern))
        self._late = {str(file.relative_to(sandbox.home)) for file in late}

    def judge(self, mutant: Mutant) -> tuple[str, Outcome]:
        """Which tests noticed it, and what they said."""
        near = [n for n in nearest_tests(self._sandbox.home, mutant.path) if n not in self._late]
        stages = [
            (NEAR, near, self._late, "not slow"),
            (PACKAGE, [f"tests/{mutant.path.split('/')[0]}"], self._late | {*near}, "not slow"),
            *((SUITE, ["tests"], set[str](), marker) for marker in ("not slow", "slow")),
        ]
        if own := [name for name in near if name in own_tests(self._sandbox.home, mutant.path)]:
            outcome = self._test(mutant, own, self._late, "not slow", LIMITS[PLAIN], plain=True)
            if not outcome.passed and not outcome.is_late:
                return NEAR, outcome
        outcome = Outcome(True, "", 0.0)
        for stage, targets, excluded, marker in stages:
            if targets and STAGES.index(stage) <= STAGES.index(self._last):
                outcome = self._test(mutant, targets, excluded, marker, LIMITS[stage])
                if not outcome.passed:
                    return TIMEOUT if outcome.is_late else stage, outcome
        return ALIVE, outcome

    def _test(
        self,
        mutant: Mutant,
        targets: list[str],
        excluded: set[str],
        marker: str,
        limit: float,
        *,
        plain: bool = False,
    ) -> Outcome:
        sandbox = self._sandbox
        failing = {name for (name, how), ok in self._passing.items() if how == plain and not ok}
        source = (sandbox.home / mutant.path).read_bytes()
        sandbox.write(mutant.path, mutant.applied(source))
        outcome = sandbox.test(targets, marker, sorted(excluded | failing), limit, plain=plain)
        sandbox.write(mutant.path, source)
        if outcome.passed or outcome.is_late:
            return outcome
        is_told = outcome.failed.startswith("tests/")  # else something has ended the process
        asked = [outcome.failed] if is_told else targets
        key = (" ".join(asked), plain)
        if key not in self._passing:
            good = sandbox.test(asked, marker, excluded, limit, plain=plain)
            self._passing[key] = good.passed or not (is_told or good.failed.startswith("exit"))
            if not self._passing[key] and not is_told:
                raise RuntimeError(f"without a mutant the tests do not run either: {good.failed}")
            if not self._passing[key]:  # it fails anyway: try again without it
                return self._test(mutant, targets, excluded, marker, limit, plain=plain)
        return outcome


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
        told = {"failed": outcome.failed, "seconds": round(outcome.seconds, 1)}
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
        columns = (NEAR, PACKAGE, SUITE, TIMEOUT, "equivalent", ALIVE)
        rows = [" | ".join(("package", "mutants", *columns))]
        for package, count in counts.items():
            numbers = (count.total(), *(count[column] for column in columns))
            rows.append(" | ".join((package, *map(str, numbers))))
        return "\n".join([*rows, *sorted(self.alive())]) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
