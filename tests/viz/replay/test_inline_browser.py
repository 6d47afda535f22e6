"""A motion draws itself in a notebook."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from controller.inline import html_of
from motions import load_motion

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def test_a_motion_in_a_notebook_draws_the_robot(chromium_browser: Browser, tmp_path: Path) -> None:
    notebook, errors = tmp_path / "notebook.html", list[str]()
    notebook.write_text(f"<html><body>{html_of(load_motion('nod'))}</body></html>")
    page = chromium_browser.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(notebook.as_uri())
    inside = page.frames[1]
    inside.wait_for_selector("canvas")
    inside.get_by_text("On four feet").first.wait_for()
    assert inside.evaluate("document.querySelector('canvas').width") > 200
    assert not errors
    page.close()
