"""What the check once got wrong, and what it says of it now: as physics does.

What physics does, ``python -m benchmarks feasibility --rows causes`` plays; it was the same when
this was written.
"""

import pytest

from benchmarks.validation_set.causes import examples
from benchmarks.validation_set.questions import Question
from motions import FeasibilityChecker

GO_WRONG = {
    "head_down": {0.06, 0.10},
    "twists": {0.20, 0.25, 0.30},
    "rocks": {0.13},
}
"""Amplitudes at which physics does not do it; all others are done."""
BY = {"head_down": "clearance", "twists": "slip", "rocks": "slip"}
"""What refuses them, among others."""


@pytest.fixture(scope="module")
def checker() -> FeasibilityChecker:
    return FeasibilityChecker()


@pytest.mark.parametrize("example", examples(), ids=lambda example: example.name)
def test_a_known_cause_of_wrong_verdicts_stays_mended(
    example: Question, checker: FeasibilityChecker
) -> None:
    name = example.family.name.removeprefix("cause: ")
    report = checker.check(example.plan(checker.model))
    assert report.ok is (example.amplitude not in GO_WRONG.get(name, set()))
    if not report.ok:
        assert BY[name] in {finding.check for finding in report.failures}
