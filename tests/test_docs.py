"""What the pages of ``docs/`` show is so: their blocks run, and they leave out nothing.

How a block is taken is said in ``tests/pages.py``.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from pathlib import Path

import pytest

import motions
from go2_wbc.curves import Ease
from go2_wbc.errors import Go2WbcError
from go2_wbc.reference import Posture
from motions import FeasibilityChecker, Timeline, check, compile_timeline, load_motion
from motions.feasibility import FeasibilityLimits
from motions.keys import BODY_CHANNELS, Frame
from motions.poses import POSES
from tests.motions.doctored import DoctoredPlan
from tests.pages import Block, blocks, difference, name_of, page, run_command, run_python, words_of

TUTORIAL, LANGUAGE, FEASIBILITY = (
    f"docs/{name}.md" for name in ("tutorial", "motions", "feasibility")
)
EASE_SIGNS = 5
"""Columns of the table of easing, besides the name."""
OWN = [
    pytest.param(block, id=f"{Path(name).stem} {name_of(block)}")
    for name in (LANGUAGE, FEASIBILITY)
    for block in blocks(name, "python")
]


# --- blocks -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_block_of_the_tutorial_does_and_prints_what_it_says(tmp_path: Path) -> None:
    """One after the other in one folder, as a reader would."""
    printed = ""
    for block in blocks(TUTORIAL):
        where = f"{TUTORIAL}, {name_of(block)}"
        if block.file:
            (tmp_path / block.file).write_text(block.text, encoding="utf-8")
        elif block.language == "sh":
            printed = _output(block, tmp_path, where)
        elif block.language == "text":
            wrong = difference(block.text, printed, block.tolerance)
            assert not wrong, f"{where}: {wrong}\nprinted:\n{printed}"
        else:
            pytest.fail(f"{where}: nothing runs this block")


def _output(block: Block, folder: Path, where: str) -> str:
    lines = words_of(block)
    printed = ""
    for words in lines:
        done = run_command(words, folder)
        expected = block.exit_code if words is lines[-1] else 0
        assert done.returncode == expected, f"{where}: {words}\n{done.stdout}{done.stderr}"
        printed += done.stdout + done.stderr
    return printed


@pytest.mark.slow
@pytest.mark.parametrize("block", OWN)
def test_a_python_block_of_the_reference_runs_alone(block: Block, tmp_path: Path) -> None:
    done = run_python(block.text, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "False" not in done.stdout
    assert "cannot" not in done.stdout


def test_a_difference_between_what_is_shown_and_printed_is_seen() -> None:
    printed = "head\na  1.000 m\nb  -2e-9 ok\nend 3 of 4\n"
    assert difference(printed, printed) == ""
    assert difference("...\nb  0 ok\nend ...\n", printed) == ""
    assert difference("head\na 1.02 m\n...\n", printed) == ""
    for wrong in (
        "head\n",
        "...\na 1.1 m\n...\n",
        "head\na 1 mm\n...\n",
        "head\n...\nhead\n...",
        "...\nend 3 of 4 or more\n",
        f"{printed}more\n",
    ):
        assert difference(wrong, printed) != ""


# --- the language -----------------------------------------------------------------------------


def test_the_reference_names_every_method_of_the_language_with_its_arguments() -> None:
    text = page(LANGUAGE)
    described = dict(re.findall(r"^\| `(\w+)\(([^`]*)\)` \|", text, re.MULTILINE))
    written = {field.name for field in dataclasses.fields(Timeline)}
    for name in (name for name in dir(Timeline) if not name.startswith("_")):
        member = inspect.getattr_static(Timeline, name)
        if name in described:
            shown = re.findall(r"\w+", described[name])
            real = [p for p in inspect.signature(member).parameters if p != "self"]
            assert [word for word in shown if word in real] == real, name
        elif name not in written:
            assert re.search(rf"`{name}[`(]", text), f"{name} is not in {LANGUAGE}"
    assert len(described) >= 15


def test_the_reference_names_everything_that_the_package_exports() -> None:
    text = page(LANGUAGE)
    missing = [name for name in motions.__all__ if not re.search(rf"`@?{name}\b", text)]
    assert missing == []


def test_the_reference_shows_every_pose_with_its_values() -> None:
    row = re.compile(r"^\| `(\w+)` \| (all offsets 0|\w+ -?[\d.]+.*) \|$", re.MULTILINE)
    rows = dict(row.findall(page(LANGUAGE)))
    assert set(rows) >= set(POSES)
    for name, values in POSES.items():
        shown = {channel: 0.0 for channel in BODY_CHANNELS} if name == "home" else {}
        for channel, value, unit in re.findall(r"(\w+) (-?[\d.]+)( deg)?", rows[name]):
            if channel in BODY_CHANNELS:
                shown[channel] = motions.deg(float(value)) if unit else float(value)
        assert shown == pytest.approx(dict(values)), name


def test_the_reference_knows_every_ease_and_how_it_starts_and_ends() -> None:
    for ease in Ease:
        found = re.search(rf"^\| `{ease.value}`[^|]*\|(.*)\|$", page(LANGUAGE), re.MULTILINE)
        assert found, ease
        cells = [cell.strip() for cell in found[1].split("|")]
        assert len(cells) == EASE_SIGNS
        formula = cells[0].split(",")[0].replace("^", "**")
        formula = re.sub(r"(\d) ([s(])", r"\1 * \2", formula)
        for s in (0.0, 0.3, 0.9):
            assert eval(formula, {"s": s}) == pytest.approx(ease.progress(s)[0]), ease
        for column, order in ((1, 1), (2, 2)):
            ends = [ease.progress(s)[order] for s in (0.0, 1.0)]
            assert [float(x) for x in cells[column].split(",")] == pytest.approx(ends), ease
        if ease is not Ease.HOLD:
            fine = [ease.progress(k / 1000) for k in range(1001)]
            peaks = [max(abs(point[order]) for point in fine) for order in (1, 2)]
            shown = [float(cells[3]), float(cells[4].split()[0])]
            assert shown == pytest.approx(peaks, rel=1e-3), ease


def test_the_reference_names_every_frame_and_posture() -> None:
    text = page(LANGUAGE)
    for frame in (Frame.GROUND, Frame.BODY):
        assert f'frame="{frame.value}"' in text
    for stance in Posture:
        assert f'"{stance.value}"' in text


_ERROR = re.compile(r"^\| `(\S.*?)` \| (.+) \|$", re.MULTILINE)
ERRORS = _ERROR.findall(page(LANGUAGE).split("## Errors")[1])


@pytest.mark.parametrize(("code", "message"), ERRORS, ids=[code for code, _ in ERRORS])
def test_an_error_of_the_reference_reads_as_it_says(code: str, message: str) -> None:
    names = {"Timeline": Timeline, "Posture": Posture, "check": check, "load_motion": load_motion}
    with pytest.raises(Go2WbcError) as caught:
        eval(code, names)
    assert str(caught.value) == message


def test_the_reference_has_errors() -> None:
    assert len(ERRORS) >= 15


# --- feasibility ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def checker() -> FeasibilityChecker:
    return FeasibilityChecker()


def test_every_check_that_the_report_can_name_is_explained(checker: FeasibilityChecker) -> None:
    plan = compile_timeline(load_motion("bow"), checker.model)
    far = Timeline().foot("FR", x=0.7, z=0.1, over=1.0).home(over=1.0)
    two = Timeline().foot("FL", z=0.1, over=1.0).foot("RR", z=0.1, over=1.0).home(over=1.0)
    reports = [
        checker.check(plan),
        checker.check(far),
        checker.check(two),
        checker.check(DoctoredPlan(plan, aside=float("nan"))),
    ]
    names = {series.check for report in reports for series in report.series}
    assert names >= {"way of a foot", "balance", "numbers", "torque", "friction"}
    table = page(FEASIBILITY).split("## The checks")[1].split("\n## ")[0]
    explained = set(re.findall(r"^\| \*\*(.+?)\*\* \|", table, re.MULTILINE))
    assert explained == names


def test_the_limits_in_the_table_are_those_of_the_checker() -> None:
    limits = FeasibilityLimits()
    shown = {
        "reach": f"<= {1000 * limits.reach:g} mm",
        "torque": f"{limits.torque_share:g} tau_max",
        "torque at speed": f"min(1, {1 / (1 - limits.knee_speed_share):g} (1",
        "support": f">= {1000 * limits.support:g} mm",
        "support of ZMP": f">= {1000 * limits.zero_moment:g} mm",
        "contact wrench": f"<= {limits.wrench:g} N, <= {0.2 * limits.wrench:g} N m",
        "foot load": f">= {limits.foot_load:g} N",
        "friction": f"<= {limits.friction:g}",
        "self-collision": f">= {1000 * limits.self_distance:g} mm",
        "clearance": f">= {1000 * limits.clearance:g} mm; feet >= -{1000 * limits.swing_depth:g}",
        "landing place": f"<= {1000 * limits.landing:g} mm",
        "landing speed": f"<= {limits.landing_speed:g} m/s",
        "continuity": f"<= {limits.body_jump:g}, {limits.body_jump:g}, {limits.joint_jump:.1f}",
        "entry and exit": f"<= {limits.stance_position:g} m, {limits.stance_angle:g} rad, "
        f"{limits.end_speed:g}",
    }
    for check_name, limit in shown.items():
        row = re.search(rf"^\| \*\*{check_name}\*\* .*$", page(FEASIBILITY), re.MULTILINE)
        assert row, check_name
        assert limit in row[0], check_name


def test_the_page_has_a_place_for_the_table_of_the_bench() -> None:
    text = page(FEASIBILITY)
    assert 0 < text.index("<!-- feasibility:begin") < text.index("<!-- feasibility:end -->")
