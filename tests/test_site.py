"""The documentation needs no network, its links lead somewhere, and what it is made of."""

import os
import sys
from collections.abc import Mapping
from html.parser import HTMLParser
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import Mock
from urllib.parse import unquote, urlsplit

import pytest

import controller
import go2_wbc
import motions
import viz
from tests.pages import BRIDGES, DOCS, ROOT
from tests.viz.replay.browsing import chromium

NEEDED = ("sphinx", "furo", "math_core", "myst_nb", "sphinx_copybutton")
MISSING = [name for name in NEEDED if find_spec(name) is None]
BUILT = os.environ.get("GO2_WBC_SITE")  #: Where a build has just put the site
IS_REQUIRED = os.environ.get("GO2_WBC_REQUIRE_DOCS") == "1"
GRAPH = {
    "cli": {"loop", "robot", "errors"},
    "loop": {"robot", "errors"},
    "robot": {"errors"},
    "errors": set(),
}
CIRCLE = {"a": {"b", "low"}, "b": {"a", "low"}, "low": set()}


@pytest.fixture(autouse=True)
def tools() -> None:
    """Skip without Sphinx, or fail where it is required."""
    if MISSING and IS_REQUIRED:
        pytest.fail(f"GO2_WBC_REQUIRE_DOCS=1, but these are not installed: {MISSING}")
    if MISSING:
        pytest.skip(f"needs the packages of the extra [docs]: {', '.join(MISSING)}")


def extension(name: str) -> ModuleType:
    folder = str(ROOT / "docs/_ext")
    if folder not in sys.path:
        sys.path.append(folder)
    return import_module(name)


@pytest.mark.skipif(BUILT is None, reason="`make docs` builds the site, and runs this test on it")
def test_the_links_of_the_site_lead_somewhere_and_its_pages_are_whole() -> None:
    target = Path(BUILT or "").resolve()
    assert problems(target) == []
    pages = [file.relative_to(target) for file in target.rglob("*.html")]
    made = {file.with_suffix(".md").as_posix() for file in pages}
    assert {name.removeprefix("docs/") for name in (*DOCS, *BRIDGES)} <= made
    api = (target / "reference/api/controller.html").read_text(encoding="utf-8")
    assert 'id="controller.go2_controller.GO2Controller.high_five"' in api
    assert (target / "reference/api/internals/controller.html").is_file()
    assert 'loading="lazy"' in (target / "gallery.html").read_text(encoding="utf-8")
    works = (target / "explanation/how-it-works.html").read_text(encoding="utf-8")
    assert works.count("<math") > 20
    shown = (target / "examples.html").read_text(encoding="utf-8")
    scripts = [file.name for file in ROOT.glob("examples/[0-9]*.py")]
    assert len(scripts) >= 24
    assert all(f"<h2>{name}<" in shown for name in scripts)
    drawn = (target / "explanation/architecture.html").read_text(encoding="utf-8")
    assert drawn.count('<svg class="import-graph"') == 5


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<a href="b.html#there">x</a><img src="p.png"><a id="here" href="#here">x</a>', []),
        ('<a href="https://example.org/">x</a>', []),
        ('<a href="c.html">x</a>', ["a.html: no c.html"]),
        ('<a href="b.html#nowhere">x</a>', ["a.html: no b.html#nowhere"]),
        ('<a href="#nowhere">x</a>', ["a.html: no #nowhere"]),
        ('<img src="q.png">', ["a.html: no q.png"]),
        (
            '<script src="https://cdn.example.org/m.js">',
            ["a.html: loads https://cdn.example.org/m.js"],
        ),
        ('<link rel="stylesheet" href="//f.org/x.css">', ["a.html: loads //f.org/x.css"]),
    ],
)
def test_a_link_that_leads_nowhere_and_a_page_that_needs_a_network_are_seen(
    tmp_path: Path, body: str, expected: list[str]
) -> None:
    (tmp_path / "a.html").write_text(f"<html>{body}</html>", encoding="utf-8")
    (tmp_path / "b.html").write_text('<p id="there">', encoding="utf-8")
    (tmp_path / "p.png").write_bytes(b"")
    assert problems(tmp_path) == expected


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


def test_a_box_lies_above_what_it_imports_and_arrows_that_follow_are_left_out() -> None:
    graph = extension("import_graph")
    assert graph.rows_of(GRAPH) == [["cli"], ["loop"], ["robot"], ["errors"]]
    assert graph.rows_of(CIRCLE) == [["a", "b"], ["low"]]
    assert graph.reduced(GRAPH) == {
        "cli": {"loop"},
        "loop": {"robot"},
        "robot": {"errors"},
        "errors": set(),
    }
    assert graph.reduced(CIRCLE) == CIRCLE


def test_the_picture_of_the_packages_is_that_of_their_imports() -> None:
    graph = extension("import_graph")
    modules = graph.read_modules()
    packages = graph.graph_of(modules, "packages")
    assert packages["go2_wbc"] == set()
    assert packages["motions"] == packages["viz"] == {"go2_wbc"}
    assert "errors" in graph.graph_of(modules, "go2_wbc")["robot"]
    drawn = graph.svg(packages, graph.sizes(modules, "packages"), "packages")
    assert all(f">{name}</text>" in drawn for name in packages)


def test_the_picture_of_a_tick_is_that_of_what_is_called() -> None:
    graph = extension("call_graph")
    flow = graph.traced_apart("tick")
    calls = (
        "controller/loop.py",
        "controller/behaviours/walking.py",
        "go2_wbc/planning/locomotion.py",
    )
    assert [flow.callers.get(file) for file in calls] == [None, *calls[:2]]
    assert "foothold" in flow.functions["go2_wbc/planning/footholds.py"], "compiled code is seen"
    drawn = graph.picture(flow, "tick")
    assert all(f">{file.removesuffix('.py')}</text>" in drawn for file in flow.functions)


def test_a_docstring_keeps_its_bars_and_its_indented_blocks() -> None:
    plain = extension("plain_docstrings")
    lines = ["Norm |x| and ``a | b``.", "", "    minimise |x|", "", "Args:", "    x: any.", ""]
    assert plain.as_markup(lines) == [
        r"Norm \|x\| and ``a | b``.",
        "",
        "::",
        "",
        "    minimise |x|",
        "",
        "Args:",
        "    x: any.",
        "",
    ]


def test_a_colon_of_a_field_splits_no_type_off() -> None:
    from sphinx.application import Sphinx
    from sphinx.ext.napoleon.docstring import GoogleDocstring

    extension("plain_docstrings").setup(Mock(spec=Sphinx))
    told = "Force [N] that counts: five deviations."
    assert str(GoogleDocstring(told, what="attribute", name="force")) == told


def test_a_name_is_found_as_sphinx_finds_it() -> None:
    from sphinx.domains.python import ObjectEntry, PythonDomain

    kinds = {"a.Leg": "class", "a.b.Leg": "class", "a.Leg.hip": "method", "b.hip": "function"}
    objects = {name: ObjectEntry("page", name, kind, False) for name, kind in kinds.items()}
    theirs = domain_of(PythonDomain, objects)
    ours = domain_of(extension("quick_references").QuickPythonDomain, objects)
    found = 0
    for name in ("Leg", "a.Leg", "Leg.hip", "hip()", "eg", "float", ""):
        for where in (("", ""), ("a", ""), ("a", "Leg"), ("a.b", "")):
            for role, mode in (("class", 0), ("class", 1), ("meth", 1), ("func", 1), (None, 0)):
                usual = theirs.find_obj(None, *where, name, role, mode)
                assert ours.find_obj(None, *where, name, role, mode) == usual
                found += len(usual)
    assert found > 10
    ours.data["objects"]["c.Foot"] = ObjectEntry("page", "c.Foot", "class", False)
    assert ours.find_obj(None, "", "", "Foot", "class", 1)[0][0] == "c.Foot"


def domain_of(kind: type, objects: Mapping[str, object]) -> Any:  # noqa: ANN401
    """A domain outside of a build, which knows ``objects``."""
    domain: Any = object.__new__(kind)
    domain.data = {"objects": dict(objects)}
    roles = {"class": ["class"], "meth": ["method"], "func": ["function"]}
    domain.objtypes_for_role = roles.get
    return domain


def test_every_public_module_has_its_place_in_the_reference() -> None:
    rooms = extension("reference_pages").rooms()
    listed = [module for modules in rooms.values() for module in modules]
    assert len(listed) == len(set(listed)) > 80
    assert rooms["controller"][:2] == ["controller", "controller.go2_controller"]
    assert not any("bridges" in name or ".cli" in name for name in listed)


def test_what_programs_use_is_told_apart_from_internals_and_once() -> None:
    """Every public name has its place on a page of its package, and on no other page."""
    pages = extension("reference_pages")
    offered = pages.offered()
    places = [(home, name) for names in offered.values() for name, home in names.items()]
    assert len(places) == len(set(places))
    for package in (go2_wbc, motions, viz, controller):
        told = {name for names in offered.values() for name in names}
        assert {name for name in package.__all__ if name != "__version__"} <= told
    home = "controller.go2_controller"
    internals = pages.api_page("controller", [home])
    assert f"{home}\n   :members:\n   :exclude-members: GO2Controller\n" in internals
    used = pages.user_page("controller", offered["controller"])
    assert f".. autoclass:: {home}.GO2Controller\n   :members:" in used
    assert ".. autofunction:: controller.sweeps.run.sweep\n" in used


def test_the_search_puts_guides_before_the_reference_and_internals_last() -> None:
    script = (ROOT / "docs/_ext/search_scorer.js").read_text(encoding="utf-8")
    names = ["reference/api/internals/viz", "reference/api/controller", "how-to/gait"]
    with chromium() as browser:
        page = browser.new_page()
        page.add_script_tag(content=script)
        scores = page.evaluate(
            "(names) => names.map((n) => Scorer.score([n, '', '', '', 26]))", names
        )
    assert scores == sorted(scores)
    assert scores[1] == 26
    assert 5 + scores[2] - 26 > scores[1]  # a word in a guide, before the very name of an object


def test_every_key_of_the_configuration_has_a_meaning_and_a_default() -> None:
    from go2_wbc.wbc.config import WbcConfig

    rows = {key: (default, meaning) for key, default, meaning in _rows(WbcConfig)}
    assert rows["friction"] == ("0.6", "Mu of the friction pyramid.")
    assert rows["swing_foot"][0] == "{ kp = [500, 500, 500], kd = [40, 40, 40] }"
    assert rows["posture_weight"][1].startswith("Task weights, 1e-3 to 1e3; ")


def test_every_gait_that_has_a_name_is_in_the_table_of_envelopes() -> None:
    from go2_wbc.contacts import GAITS
    from go2_wbc.planning.envelopes import measured_envelopes

    rows = extension("reference_pages").envelope_rows()[2:]
    assert [row.split("`")[1] for row in rows] == list(GAITS)
    assert f" {measured_envelopes()['pace'].forward:.2f} m/s " in rows[list(GAITS).index("pace")]


def _rows(kind: type) -> list[tuple[str, str, str]]:
    return list(extension("reference_pages").config_rows(kind))
