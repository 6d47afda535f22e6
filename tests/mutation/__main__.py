"""``python -m tests.mutation``: draws mutants, tests each, and keeps a list that can be resumed."""

import argparse
import json
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path

from tests.mutation.operators import Mutant, apart, draw, mutants_of
from tests.mutation.runner import Outcome, Sandbox, nearest_tests, own_tests

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGES: tuple[str, ...] = ("go2_wbc", "motions", "viz", "controller")
# Not mutated: their tests need ROS 2 or DDS.
LEFT_OUT = ("controller/bridges", "controller/cli/bridges")
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
# Fast tests that take long or need a browser: they are near to no module.
LATE = ("test_seeded_faults.py", "test_pytest_plugin.py", "test_*browser.py")
STAGES = NEAR, PACKAGE, SUITE = "module", "package", "suite"
ALIVE, TIMEOUT = "alive", "timeout"
PLAIN = "plain"
# CPU time [s]: of a module's own tests, of others that use it, compiling included, and of whole
# packages some times what the good code takes. Only what never comes to an end hangs.
LIMITS = {PLAIN: 20.0, NEAR: 40.0, PACKAGE: 600.0, SUITE: 3600.0}


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
        judge = Judge(Sandbox(root, Path(folder, "tree")))
        for mutant in mutants:
            if options.again or mutant.name not in results.latest:
                results.add(mutant, NEAR, *judge.judge(mutant))
        for stage in STAGES[1 : STAGES.index(options.until) + 1]:
            left = [mutant for mutant in mutants if results.is_left(mutant, stage)]
            for _, together in groupby(sorted(left, key=results.company), results.company):
                for group in apart(together):
                    for mutant, told, outcome in judge.judge_together(group, stage):
                        results.add(mutant, stage, told, outcome)
    sys.stdout.write(results.table())
    return 1 if results.alive() else 0


def package_mutants(root: Path, package: str) -> list[Mutant]:
    """What can be mutated in a package; ``__init__`` files only export."""
    files = {str(file.relative_to(root)): file for file in sorted((root / package).rglob("*.py"))}
    kept = (p for p in files if not p.endswith("__init__.py") and not p.startswith(LEFT_OUT))
    return [mutant for path in kept for mutant in mutants_of(files[path].read_bytes(), path)]


class Judge:
    """Tests a mutant: by its module's nearest tests, its package's fast ones, the whole suite.

    Most are noticed by the module's own tests, which run first, and plain: compiling takes long.
    What the nearest tests let live meets the others together with its like: a run of all of them
    tells which tests fail, and each mutant meets those alone. One that hides another's fault from
    a test lets it live: the share killed is never told too high.
    """

    def __init__(self, sandbox: Sandbox) -> None:
        self._sandbox = sandbox
        self._passing: dict[tuple[str, bool], bool] = {}  # without any mutant; and plain
        tests = sandbox.home / "tests"
        late = (file for pattern in LATE for file in tests.rglob(pattern))
        self._late = {str(file.relative_to(sandbox.home)) for file in late}

    def judge(self, mutant: Mutant) -> tuple[str, Outcome]:
        """Whether the nearest tests notice it, and what they say."""
        home = self._sandbox.home
        near = [name for name in nearest_tests(home, mutant.path) if name not in self._late]
        own = [name for name in near if name in own_tests(home, mutant.path)]
        runs = [(own, PLAIN), (own, NEAR), ([name for name in near if name not in own], NEAR)]
        outcome, hangs = Outcome(True, (), 0.0), False
        for targets, how in runs:
            if not targets or (targets is own and how == NEAR and not outcome.is_late):
                continue  # what has passed plain has passed
            told = self._test([mutant], targets, "not slow", LIMITS[how], plain=how == PLAIN)
            outcome, hangs = told, hangs or (targets is own and how == NEAR and told.is_late)
            if not outcome.passed and not outcome.is_late:
                return NEAR, outcome
        return TIMEOUT if hangs else ALIVE, outcome

    def judge_together(
        self, mutants: list[Mutant], stage: str
    ) -> Iterator[tuple[Mutant, str, Outcome]]:
        """Of each mutant of a package what a further stage says."""
        targets = ["tests" if stage == SUITE else f"tests/{mutants[0].path.split('/')[0]}"]
        marker = "slow or not slow" if stage == SUITE else "not slow"
        whole = self._test(mutants, targets, marker, LIMITS[stage], to_the_end=True)
        if whole.passed or whole.names_tests:
            for mutant in mutants:
                outcome = whole
                if not whole.passed:
                    outcome = self._test([mutant], [*whole.failed], marker, LIMITS[stage])
                yield mutant, _told(outcome, stage), outcome
        elif len(mutants) == 1:
            yield mutants[0], _told(whole, stage), whole
        else:  # one of them ends the process, or never ends
            half = len(mutants) // 2
            for part in (mutants[:half], mutants[half:]):
                yield from self.judge_together(part, stage)

    def _test(
        self,
        mutants: list[Mutant],
        targets: list[str],
        marker: str,
        limit: float,
        *,
        plain: bool = False,
        to_the_end: bool = False,
    ) -> Outcome:
        sandbox = self._sandbox
        failing = {name for (name, how), ok in self._passing.items() if how == plain and not ok}
        sources = {mutant.path: (sandbox.home / mutant.path).read_bytes() for mutant in mutants}
        changed = dict(sources)
        for mutant in sorted(mutants, key=lambda mutant: -mutant.start):
            changed[mutant.path] = mutant.applied(changed[mutant.path])
        for path, source in changed.items():
            sandbox.write(path, source)
        ask = partial(sandbox.test, marker=marker, limit=limit, plain=plain)
        outcome = ask(targets, excluded=failing, to_the_end=to_the_end)
        for path, source in sources.items():
            sandbox.write(path, source)
        if outcome.passed or outcome.is_late:
            return outcome
        asked = [*outcome.failed] if outcome.names_tests else targets
        if unknown := [name for name in asked if (name, plain) not in self._passing]:
            good = ask(unknown, excluded=(), to_the_end=True)
            if not (good.passed or good.is_late or good.names_tests):
                raise RuntimeError(f"without a mutant the tests do not run either: {good.failed}")
            bad = {*good.failed} if outcome.names_tests else set[str]()
            self._passing |= {(name, plain): name not in bad for name in unknown}
        noticed = tuple(name for name in asked if self._passing[name, plain])
        if to_the_end and outcome.names_tests:
            return replace(outcome, passed=not noticed, failed=noticed)
        if noticed:
            return outcome
        return self._test(mutants, targets, marker, limit, plain=plain)  # without those tests


def _told(outcome: Outcome, stage: str) -> str:
    return ALIVE if outcome.passed else TIMEOUT if outcome.is_late else stage


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

    def add(self, mutant: Mutant, until: str, stage: str, outcome: Outcome) -> None:
        """Append what has noticed a mutant, or nothing, of the tests up to a stage."""
        told = {"failed": " ".join(outcome.failed[:1]), "seconds": round(outcome.seconds, 1)}
        head = {"mutant": mutant.name, "stage": stage, "until": until}
        self.latest[mutant.name] = {**head, **told}
        with self._file.open("a") as stream:
            stream.write(json.dumps(self.latest[mutant.name]) + "\n")

    def is_left(self, mutant: Mutant, stage: str) -> bool:
        """Whether a mutant has yet to meet the tests of a stage, as no nearer ones noticed it."""
        record = self.latest[mutant.name]
        if mutant.name in self._equivalent or record["stage"] not in (ALIVE, TIMEOUT):
            return False
        return STAGES.index(record["until"]) < STAGES.index(stage)

    def company(self, mutant: Mutant) -> str:
        """What those share that meet tests together: a package; what may hang is alone."""
        is_late = self.latest[mutant.name]["stage"] == TIMEOUT
        return mutant.name if is_late else mutant.path.split("/")[0]

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
