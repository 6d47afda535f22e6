"""A sidecar says what the numbers of a policy mean, or what of it is wrong."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.policies import TROT, Sidecar
from controller.policies.sidecar import SIZES, parse
from go2_wbc.errors import PolicyError
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand

PAGE = Path(__file__).parents[3] / "docs/reference/sidecar.md"
BLOCKS = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def content() -> dict[str, Any]:
    """The example of the page, with a clock."""
    return tomllib.loads("".join(BLOCKS))


def test_the_example_of_the_page_is_read_as_the_page_says() -> None:
    side = parse(content())
    assert side.observation_size == side.row_size == 3 + 3 + 3 + 12 + 12 + 12 + 2
    assert side.order.tolist() == [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
    assert side.kp.tolist() == [25.0] * 12
    assert side.terms[2].scale.tolist() == [2.0, 2.0, 0.25]
    assert side.terms[-1].frequency == 2.5


def test_what_the_page_calls_the_default_is_what_counts_without_the_key() -> None:
    written, short = content(), content()
    del short["robot"], short["joints"]["signs"], short["action"]["clip"]
    for key in ("history", "layout", "oldest_first", "clip"):
        del short["observation"][key]
    del short["observation"]["terms"][-1]["offsets"]
    assert repr(parse(short)) == repr(parse(written))


def test_every_term_has_its_row_in_the_page() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (\d+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert {name: int(size) for name, size in rows} == SIZES


def _set(table: str, key: str, value: object) -> dict[str, Any]:
    changed = content()
    part = changed[table] if table else changed
    if value is None:
        del part[key]
    else:
        part[key] = value
    return changed


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (_set("", "format", 2), "format must be 1, got 2"),
        (_set("", "rate", None), "rate is missing"),
        (_set("", "rate", 1e4), "rate must be a number from 10 to 500, got 10000"),
        (_set("", "ratte", 1), "unknown key 'ratte'.*did you mean 'rate'"),
        (_set("", "joints", 3), "joints must be a table, got 3"),
        (_set("joints", "order", 3), "must be a list of 12 names"),
        (_set("joints", "order", ["FL_hip"] * 12), "each of 12 joints once.*without FL_thigh"),
        (_set("joints", "order", ["FL_hipp"]), "unknown name in joints.*did you mean 'FL_hip"),
        (_set("joints", "signs", 2), "joints.signs must be 1 or -1"),
        (_set("joints", "default", [0.0] * 11), "joints.default must be a number, or a list of 12"),
        (_set("joints", "default", float("nan")), "joints.default must be a number"),
        (_set("action", "scale", 0.0), "action.scale must not be 0"),
        (_set("action", "kp", -1.0), "action.kp must be 0 or more, got -1"),
        (_set("action", "kq", 1.0), "unknown key 'action.kq'"),
        (_set("commands", "forward", [0.5, 1.0]), "must be .least, greatest. with 0 between"),
        (_set("commands", "turning", None), "commands.turning is missing"),
        (_set("observation", "layout", "rows"), "unknown observation.layout 'rows'.*frames, terms"),
        (_set("observation", "history", 0), "observation.history must be a number from 1 to 100"),
        (_set("observation", "history", 1.5), "history must be a whole number, got 1.5"),
        (_set("observation", "oldest_first", "yes"), "must be true or false, got 'yes'"),
        (_set("observation", "terms", []), "observation.terms must be tables"),
        (_set("observation", "terms", [{"name": "phase"}]), r"terms\[0\].name 'phase'.*clock"),
        (_set("observation", "terms", [{"name": "clock"}]), r"terms\[0\].frequency is missing"),
        (_set("observation", "terms", [{"name": "gravity", "frequency": 1}]), "unknown key"),
    ],
)
def test_what_is_wrong_is_named(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(PolicyError, match=said):
        parse(changed)


def test_the_least_and_the_greatest_are_allowed() -> None:
    clocks = [[{"name": "clock", "frequency": frequency}] for frequency in (0.1, 20.0)]
    for table, key, ends in (
        *(("", "rate", (10.0, 500.0)), ("action", "kp", (0.0, 1e300))),
        *((table, "clip", (0.0, 1e300)) for table in ("action", "observation")),
        *(("commands", "lateral", ([0.0, 1.0], [-1.0, 0.0])), ("observation", "terms", clocks)),
        ("observation", "history", (1, 100)),
    ):
        for end in ends:
            parse(_set(table, key, end))


def test_a_file_that_is_none_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(PolicyError, match=r"absent\.toml: No such file"):
        Sidecar.load(tmp_path / "absent.toml")
    (tmp_path / "bad.toml").write_text("rate = ", encoding="utf-8")
    with pytest.raises(PolicyError, match=r"bad\.toml is no TOML"):
        Sidecar.load(tmp_path / "bad.toml")
    (tmp_path / "latin.toml").write_bytes("# für".encode("latin-1"))
    with pytest.raises(PolicyError, match=r"latin\.toml is no TOML"):
        Sidecar.load(tmp_path / "latin.toml")
    (tmp_path / "short.toml").write_text("format = 1", encoding="utf-8")
    with pytest.raises(PolicyError, match=r"short\.toml: rate is missing|short\.toml: joints"):
        Sidecar.load(tmp_path / "short.toml")


def test_each_speed_of_a_command_is_kept_within_its_own_range() -> None:
    ranges = Sidecar.load(TROT.with_suffix(".toml")).commands
    assert ranges.clip(VelocityCommand(2.0, 0.1, -3.0)) == VelocityCommand(1.0, 0.1, -0.6)
    assert ranges.clip(ZERO_COMMAND) == ZERO_COMMAND
    assert ranges.excess(VelocityCommand(0.5)) == ""
    assert "clipped" in ranges.excess(VelocityCommand(1.1))
    assert not ranges.is_far(VelocityCommand(1.5))
    assert ranges.is_far(VelocityCommand(0.5, 0.0, 30.0))
    assert np.isclose(ranges.forward, (-0.2, 1.0)).all()
