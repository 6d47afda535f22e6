"""Where there is no browser, its tests are skipped, or fail if one is required."""

import pytest

from tests.viz.replay import browsing


@pytest.mark.parametrize(
    ("is_required", "outcome"), [(False, pytest.skip.Exception), (True, pytest.fail.Exception)]
)
def test_a_missing_browser_is_reported(
    monkeypatch: pytest.MonkeyPatch, *, is_required: bool, outcome: type[BaseException]
) -> None:
    monkeypatch.delenv(browsing.BROWSER_VARIABLE, raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(browsing, "IS_REQUIRED", is_required)
    with pytest.raises(outcome, match="apt-get install chromium"), browsing.chromium():
        pass
