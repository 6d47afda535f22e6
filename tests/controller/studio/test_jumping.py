"""Jumps that have no plan yet: the file opens at once, they are looked for meanwhile."""

from pathlib import Path
from typing import Any

import pytest

from controller.studio import session
from controller.studio.plain import LOOKED_FOR, NO_WAY
from controller.studio.session import Studio
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline
from motions.dynamics.phases import PhaseProblem
from motions.dynamics.plan_audit import PlanLimits
from motions.dynamics.plan_cache import _key, plan_folder
from motions.language.keys import PhaseKey
from tests.viz.page_reader import read_message, read_pack

HIGH, LOW = 0.2961, 0.0931  # m; too high for the robot, and not
SHORT = 0.3  # s of work that a jump is looked for here: what is too high takes longer
KNOWN = 0.1  # m; one whose plan is kept from an earlier time
LEAP = '''from motions import Timeline, motion


@motion
def leap() -> Timeline:
    """Leap."""
    line = Timeline().body(z=-0.02, over=0.6).home(over=0.6)
    return line.jump(height={height}).hold(0.5).jump(height=0.1).hold(0.5)
'''


@pytest.fixture(autouse=True, scope="module")
def _known() -> None:
    FeasibilityChecker().plan(Timeline().jump(height=KNOWN))


def _page(studio: Studio) -> dict[str, Any]:
    header, _ = read_pack(read_message(studio._server.changes(""))[1])
    return header


def _broken(page: dict[str, Any]) -> list[str]:
    return [bar["broken"] for bar in page["editor"]["bars"]]


def _set(studio: Studio, bar: int, name: str, value: float, *, commit: bool) -> object:
    editor = _page(studio)["editor"]
    where = {"site": editor["bars"][bar]["site"], "base": editor["base"], "commit": commit}
    return studio.edit({"op": "set", "name": name, "value": value, **where})


def _told(answer: object) -> dict[str, object]:
    assert isinstance(answer, dict)
    return answer


def test_a_jump_that_is_not_found_in_time_leaves_the_rest_to_be_edited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "LONGEST_SOLVE", SHORT)
    file = tmp_path / "leap.py"
    file.write_text(LEAP.format(height=HIGH), encoding="utf-8")
    with Studio(file, None, 0) as studio:
        assert "looked for" in studio.told
        assert _broken(_page(studio)) == ["", "", LOOKED_FOR, "", "", ""]
        assert isinstance(_set(studio, 0, "over", 0.7, commit=False), bytes), "a draft is shown"
        assert "error" not in _told(_set(studio, 0, "over", 0.7, commit=True))
        studio._search.join()
        assert NO_WAY in studio.told
        page = _page(studio)
        assert _broken(page) == ["", "", NO_WAY, "", "", ""]
        assert not page["verdict"]["ok"]
        monkeypatch.undo()  # it may take its time now
        assert "error" not in _told(_set(studio, 2, "height", LOW, commit=True))
        assert (studio.told, _broken(_page(studio))) == ("", [""] * 6)


def test_a_jump_that_is_found_meanwhile_is_shown(tmp_path: Path) -> None:
    (block,) = Timeline().jump(height=LOW).in_order(PhaseKey)
    key = _key(PhaseProblem(block.phases), RobotModel(), PlanLimits())
    plan = plan_folder() / f"{key}.npz"
    plan.unlink(missing_ok=True)
    file = tmp_path / "leap.py"
    file.write_text(LEAP.format(height=LOW), encoding="utf-8")
    with Studio(file, None, 0) as studio:
        assert _broken(_page(studio)) == ["", "", LOOKED_FOR, "", "", ""]
        studio._search.join()
        assert (studio.told, _broken(_page(studio))) == ("", [""] * 6)
    assert plan.exists(), "it is solved once"
