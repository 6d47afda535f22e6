"""What README and pages of ``docs/`` show works: their blocks run, and they leave out nothing.

How a block is taken is said in ``tests/pages.py``.
"""

import dataclasses
import inspect
import re
from pathlib import Path

import pytest

import motions
from controller import GO2Controller
from controller.cli.main import COMMANDS
from go2_wbc.config import Config, load_config
from go2_wbc.curves import Ease
from go2_wbc.errors import Go2WbcError
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.description import find_profile
from go2_wbc.wbc.config import Gains
from go2_wbc.world import World
from motions import FeasibilityChecker, Timeline, check, compile_timeline, load_motion
from motions.feasibility import FeasibilityLimits
from motions.feasibility.kinematic import END_BOUNDS, JUMPS
from motions.language.body_and_feet import POSES
from motions.language.keys import BODY_CHANNELS, Frame
from tests.motions.doctored import DoctoredPlan
from tests.pages import (
    DOCS,
    NOT_RUN,
    USERS_BIN,
    Block,
    blocks,
    difference,
    name_of,
    page,
    run_command,
    run_python,
    table_rows,
    words_of,
)

KNEE_SHARE = find_profile().knee_share

TUTORIAL, LANGUAGE, FEASIBILITY = (
    f"docs/{name}.md" for name in ("tutorial", "motions", "feasibility")
)
EASE_SIGNS = 5  #: Columns of the table of easing, besides the name
CONTROLLER, COMMAND_LINE, CONFIGURATION = (
    f"docs/reference/{name}.md" for name in ("controller", "command-line", "configuration")
)
PYTHON: dict[str, Block] = {
    f"{Path(name).stem} {name_of(block)}": block
    for name in ("README.md", *DOCS)
    if name != TUTORIAL
    for block in blocks(name, "python")
    if name == "README.md" or block.text != blocks("README.md", "python")[0].text
}
RUNNING = {name: block for name, block in PYTHON.items() if not block.text.startswith(NOT_RUN)}


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


def test_the_pages_have_blocks_to_test() -> None:
    assert len(RUNNING) >= 14
    left_out = [name.split()[0] for name in PYTHON if name not in RUNNING]
    unmeant = ["feasibility", "learning", "learning", "real-time", "sweeps"]
    assert left_out == [*unmeant, "worlds", "worlds", "worlds"]


@pytest.mark.parametrize("name", [name for name in PYTHON if name not in RUNNING])
def test_a_python_block_that_is_not_run_compiles(name: str) -> None:
    compile(PYTHON[name].text, "<block>", "exec")


@pytest.mark.slow
@pytest.mark.parametrize("block", RUNNING.values(), ids=RUNNING)
def test_a_python_block_runs_alone_and_says_nothing_bad(block: Block, tmp_path: Path) -> None:
    done = run_python(block.text, tmp_path)
    if USERS_BIN and "No module named 'gymnasium'" in done.stderr:
        pytest.skip("gymnasium is not installed")
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


def test_the_reference_names_every_method_of_the_language_with_its_arguments() -> None:
    text = page(LANGUAGE)
    described = dict(re.findall(r"^\| `(\w+)\(([^`]*)\)` \|", text, re.MULTILINE))
    written = {field.name for field in dataclasses.fields(Timeline)}
    for name in (name for name in dir(Timeline) if not name.startswith("_")):
        member = inspect.getattr_static(Timeline, name)
        if name in described and callable(member):
            shown = re.findall(r"\w+", described[name])
            real = [p for p in inspect.signature(member).parameters if p != "self"]
            assert [word for word in shown if word in real] == real, name
        elif name not in written:  # a property may share its name with a call of another module
            assert re.search(rf"`{name}[`(]", text), f"{name} is not in {LANGUAGE}"
    assert len(described) >= 15


def test_the_reference_names_all_that_is_exported_frames_postures_and_errors() -> None:
    text = page(LANGUAGE)
    missing = [name for name in motions.__all__ if not re.search(rf"`@?{name}\b", text)]
    assert missing == []
    for frame in (Frame.GROUND, Frame.BODY):
        assert f'frame="{frame.value}"' in text
    for posture in Posture:
        assert f'"{posture.value}"' in text
    assert len(ERRORS) >= 15


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


_ERROR = re.compile(r"^\| `(\S.*?)` \| (.+) \|$", re.MULTILINE)
ERRORS = _ERROR.findall(page(LANGUAGE).split("## Errors")[1])


@pytest.mark.parametrize(("code", "message"), ERRORS, ids=[code for code, _ in ERRORS])
def test_an_error_of_the_reference_reads_as_it_says(code: str, message: str) -> None:
    names = {"Timeline": Timeline, "Posture": Posture, "check": check, "load_motion": load_motion}
    with pytest.raises(Go2WbcError) as caught:
        eval(code, names)
    assert str(caught.value) == message


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
        "joint position": f"less {limits.pair_hip:g} rad",
        "torque": f"{limits.torque_share:g} tau_max",
        "torque at speed": f"min(1, (1 - abs(v) / v_max) / {1 - KNEE_SHARE:g})",
        "support": f">= {1000 * limits.support:g} mm",
        "support of ZMP": f">= {1000 * limits.zero_moment:g} mm",
        "contact wrench": f"<= {limits.wrench:g} N, <= {0.2 * limits.wrench:g} N m",
        "foot load": f">= {limits.foot_load:g} N",
        "slip": f"<= {1000 * limits.slip:g} mm",
        "lag": f"<= {1000 * limits.lag:g} mm, {limits.lag_angle:g} rad",
        "tipping": f"<= {1000 * limits.tipping:g} mm",
        "tracking": f"<= {1000 * limits.off:g} mm, {limits.off_angle:g} rad",
        "friction": f"<= {World().friction:g}",
        "self-collision": f">= {1000 * limits.self_distance:g} mm",
        "clearance": f">= {1000 * limits.clearance:g} mm; "
        f"feet >= -{1000 * limits.swing_depth:g} mm; "
        f"thighs >= {1000 * limits.thigh_clearance:g} mm; "
        f"calves >= {1000 * limits.calf_clearance:g} mm",
        "dragging": f"<= {1000 * limits.drag:g} mm",
        "landing place": f"<= {1000 * limits.landing:g} mm",
        "flat landing": f"<= {1000 * limits.flat_landing:g} mm",
        "landing speed": f"<= {limits.landing_speed:g} m/s",
        "continuity": f"<= {JUMPS[0]:g}, {JUMPS[1]:g}, {JUMPS[2]:g}",
        "entry and exit": "<= {:g} m, {:g} rad, {:g}".format(*END_BOUNDS),
    }
    for check_name, limit in shown.items():
        row = re.search(rf"^\| \*\*{check_name}\*\* .*$", page(FEASIBILITY), re.MULTILINE)
        assert row, check_name
        assert limit in row[0], check_name


def test_the_page_has_a_place_for_the_table_of_the_benchmark() -> None:
    text = page(FEASIBILITY)
    assert 0 < text.index("<!-- feasibility:begin") < text.index("<!-- feasibility:end -->")


def test_the_table_of_methods_names_every_public_member_and_no_other() -> None:
    cells = [row[0] for row in table_rows(page(CONTROLLER), "call")]
    named = {name for cell in cells for name in re.findall(r"`(\w+)", cell)}
    assert named == {name for name in dir(GO2Controller) if not name.startswith("_")}


def test_every_command_has_its_section_with_its_help() -> None:
    sections = re.findall(r"^## (.+)\n\n```{cli-help} (.+)\n```$", page(COMMAND_LINE), re.MULTILINE)
    assert all(title == name for title, name in sections)
    assert {name for _, name in sections} == {command.name for command in COMMANDS}


def test_the_configuration_example_loads_and_changes_what_it_names(tmp_path: Path) -> None:
    (block,) = blocks("docs/how-to/configuration.md", "toml")
    file = tmp_path / "mine.toml"
    file.write_text(block.text, encoding="utf-8")
    config = load_config(file)
    assert config.locomotion.height == 0.27
    assert config.wbc.swing_foot.kp == (400.0, 400.0, 400.0)
    assert config.safety.qp_patience == 5
    assert config != Config()


def test_every_table_of_the_configuration_is_shown() -> None:
    shown = set(re.findall(r"```{config-table} (\S+)", page(CONFIGURATION)))
    assert _parts(Config()) <= shown


def _parts(config: object) -> set[str]:
    """The classes below a configuration, but for the gains, which are written in one line."""
    values = [getattr(config, field.name) for field in dataclasses.fields(config)]  # type: ignore[arg-type]
    found: set[str] = set()
    for part in (v for v in values if dataclasses.is_dataclass(v) and not isinstance(v, Gains)):
        found |= {f"{type(part).__module__}.{type(part).__name__}"} | _parts(part)
    return found
