"""``go2-wbc preview`` as a user sees it: save the file, and the open page follows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.live_preview import BROKEN, GOOD, TOO_HIGH, LivePreview
from tests.viz.replay.browsing import Tab

if TYPE_CHECKING:
    from playwright.sync_api import Browser

_BADGE = "document.getElementById('badge').textContent"
_ERROR = "document.getElementById('error')"


@pytest.mark.slow
def test_the_page_follows_every_save(tmp_path: Path, chromium_browser: Browser) -> None:
    file = tmp_path / "rise.py"
    file.write_text(GOOD, encoding="utf-8")
    with LivePreview(str(file)) as preview, Tab(chromium_browser) as browser:
        browser.open(preview.url)
        browser.wait_for("replay.version")
        browser.evaluate("replay.scrub(1.0); replay.scene.setView('side')")
        assert browser.evaluate(_BADGE) == "feasible"
        before, camera = browser.stage(), _camera(browser)

        file.write_text(TOO_HIGH, encoding="utf-8")
        browser.wait_for(f"{_BADGE}.includes('broken')")
        assert browser.evaluate("replay.time") == 1.0
        after = browser.stage()
        assert _camera(browser) == pytest.approx(camera, abs=1e-5)
        assert np.abs(after - before).mean() > 2.0
        assert browser.evaluate("document.querySelectorAll('.annotation.broken').length") > 0

        file.write_text(BROKEN, encoding="utf-8")
        browser.wait_for(f"!{_ERROR}.hidden")
        told = browser.evaluate(f"{_ERROR}.textContent")
        assert "rise.py, line 9: SyntaxError" in told
        assert "is the last version that compiled, which the robot cannot do." in told
        assert "broken" in browser.evaluate(_BADGE)

        file.write_text(GOOD, encoding="utf-8")
        browser.wait_for(f"{_ERROR}.hidden && {_BADGE} === 'feasible'")
        assert np.abs(browser.stage() - before).mean() < 0.5
        assert browser.complaints == []
        assert all(url.startswith(preview.url) for url in browser.requested)

        assert preview.interrupt() == 0
        browser.wait_for(f"{_ERROR}.textContent.includes('The preview has ended')")


@pytest.mark.slow
def test_a_slider_makes_the_motion_anew(chromium_browser: Browser) -> None:
    with LivePreview("wave") as preview, Tab(chromium_browser) as browser:
        browser.open(preview.url)
        browser.wait_for("replay.version")
        shown = "[...document.querySelectorAll('#sliders label span')].map(one => one.textContent)"
        assert browser.evaluate(shown) == ["Side", "Times"]
        before = browser.evaluate("replay.data.duration")
        browser.evaluate(
            "(() => {const times = document.querySelector('#sliders input');"
            "times.value = 5; times.dispatchEvent(new Event('input'))})()"
        )
        browser.wait_for(f"replay.data.duration > {before} + 1")
        assert browser.evaluate("document.querySelector('#sliders input').value") == "5"
        assert browser.evaluate("document.querySelector('#sliders select').value") == "right"
        assert browser.complaints == []
        assert preview.heard()["ok"]
        assert preview.heard()["duration"] > before + 1


def _camera(browser: Tab) -> list[float]:
    return browser.evaluate("replay.scene.viewer.camera.position.toArray()")
