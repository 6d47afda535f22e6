"""pytest plugin: a test that a motion is done as often as it should be, in random worlds.

    @pytest.mark.certify(0.95, n=200)
    def test_bow(certify_motion):
        certificate = certify_motion(bow(angle=0.3))

The test fails unless the lower end of the 95 % interval of the rate reaches the number. This module
is loaded in every run of pytest in its environment, so it imports nothing heavy until it is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from controller.sweeps.certify import Certificate

RUNS = 200
_USAGE = "certify(RATE, n=200, first_seed=0): the rate, between 0 and 1, that must be reached"


def pytest_configure(config: pytest.Config) -> None:
    """Announce the marker."""
    config.addinivalue_line("markers", f"{_USAGE} with 95 % confidence by certify_motion")


@pytest.fixture
def certify_motion(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[object], Certificate]:
    """A function that certifies a motion, fails the test if need be, and returns the certificate.

    The rows are kept in a temporary folder; nothing of an earlier run is used.
    """
    marker = request.node.get_closest_marker("certify")
    rate, n, first_seed = _settings(marker)

    def certify_motion(motion: object) -> Certificate:
        __tracebackhide__ = True
        from controller.sweeps.certify import certify

        folder = tmp_path_factory.mktemp("certificate")
        certificate = certify(motion, n, first_seed=first_seed, out=folder / "rows.sqlite")
        if not certificate.meets(rate):
            text = (
                f"{certificate.motion!r} must be done in {100.0 * rate:g} % of the runs, with 95 % "
                f"confidence\n{certificate.table()}"
            )
            pytest.fail(text, pytrace=False)
        return certificate

    return certify_motion


def _settings(marker: pytest.Mark | None) -> tuple[float, int, int]:
    """The rate that is required, how many runs, the first seed; says what is wrong with it."""
    if marker is None or len(marker.args) != 1 or not set(marker.kwargs) <= {"n", "first_seed"}:
        raise pytest.UsageError(f"certify_motion needs the marker {_USAGE}")
    (rate,) = marker.args
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not 0.0 < rate < 1.0:
        raise pytest.UsageError(f"{_USAGE}; got {rate!r}")
    return float(rate), marker.kwargs.get("n", RUNS), marker.kwargs.get("first_seed", 0)
