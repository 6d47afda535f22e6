"""Checks a folder of HTML pages without network: links, anchors, and what a page loads."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADS = {"img": "src", "script": "src", "link": "href", "source": "src", "iframe": "src"}
NOT_LOADED = frozenset({"canonical", "next", "prev", "index", "search", "author", "copyright"})
"""Relations of ``link`` that a browser does not fetch."""


class _Page(HTMLParser):
    """Collects the anchors of a page, what it links to, and what it loads."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {key: value or "" for key, value in attrs}
        self.anchors |= {values[key] for key in ("id", "name") if key in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if LOADS.get(tag) in values and values.get("rel") not in NOT_LOADED:
            self.loads.append(values[LOADS[tag]])


def problems(folder: Path) -> list[str]:
    """Links that lead nowhere inside ``folder``, and what a page would fetch from a network."""
    pages = {file: _read(file) for file in sorted(folder.rglob("*.html"))}
    found = []
    for file, page in pages.items():
        where = file.relative_to(folder).as_posix()
        found += [f"{where}: loads {url}" for url in page.loads if urlsplit(url).netloc]
        for url in [*page.links, *page.loads]:
            if not _leads_somewhere(url, file, pages):
                found.append(f"{where}: no {url}")
    return found


def _read(file: Path) -> _Page:
    page = _Page()
    page.feed(file.read_text(encoding="utf-8"))
    return page


def _leads_somewhere(url: str, file: Path, pages: dict[Path, _Page]) -> bool:
    parts = urlsplit(url)
    if parts.scheme or parts.netloc:
        return True
    target = (file.parent / unquote(parts.path)).resolve() if parts.path else file.resolve()
    if target.is_dir() or not target.exists():
        return False
    anchors = pages[target].anchors if target in pages else set()
    return not parts.fragment or target.suffix != ".html" or unquote(parts.fragment) in anchors
