"""Several calls, or several arguments, are edited in one step."""

import ast
from collections.abc import Sequence

import pytest

from controller.studio.edits import edited
from controller.studio.layout import LONGEST_LINE
from controller.studio.source import Source
from controller.studio.together import copied, edited_together, pasted
from go2_wbc.errors import StudioError

LINE = '''from motions import Timeline, deg, motion


@motion
def one() -> Timeline:
    """One."""
    line = Timeline().body(z=-0.03, over=0.6).hold(0.4)  # low
    line = line.foot("FR", z=0.1, over=0.5).down("FR", over=0.5)
    return line.home(over=0.6)


@motion
def two() -> Timeline:
    """Two."""
    return (
        Timeline()
        .pose("bow", over=0.8)
        .home(over=0.8)
    )
'''
SOURCE = Source(LINE.encode())


def _sites(*names: str) -> list[list[int]]:
    """Where the calls of these methods end first."""
    ends = {
        node.func.attr: [node.end_lineno or 0, node.end_col_offset or 0]
        for node in reversed(list(ast.walk(ast.parse(LINE))))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
    }
    return [ends[name] for name in names]


def _done(op: str, names: Sequence[str], **more: object) -> str:
    orders = [{"op": op, "site": site, **more} for site in _sites(*names)]
    return edited_together(SOURCE, {"op": "many", "orders": orders}, edited).data.decode()


def test_calls_are_deleted_together_whatever_their_order() -> None:
    expected = LINE.replace(".hold(0.4)  # low", "").replace('.foot("FR", z=0.1, over=0.5)', "")
    expected = expected.replace('.down("FR", over=0.5)', "").replace("    line = line\n", "")
    for names in (["hold", "foot", "down"], ["down", "hold", "foot"]):
        assert ast.dump(ast.parse(_done("delete", names))) == ast.dump(ast.parse(expected))


def _move(names: Sequence[str], target: str, **more: object) -> Source:
    sites, (site,) = _sites(*names), _sites(target)
    order = {"op": "move", "sites": sites, "site": site, **more}
    return edited_together(SOURCE, order, edited)


def _name_at(source: Source, end: tuple[int, int] | None) -> str:
    return source.text(end or (0, 0)).partition("(")[0]


@pytest.mark.parametrize("step", [0, 1])
def test_a_call_goes_behind_another(step: int) -> None:
    after = _move(["body"], "hold", step=step)
    assert "Timeline().hold(0.4)" in after.data.decode()
    assert _name_at(after, after.site) == ".body"


def test_calls_go_over_several_lines_and_back() -> None:
    later = _move(["body", "hold"], "down")
    assert 'down("FR", over=0.5).body(z=-0.03, over=0.6).hold(0.4)' in later.data.decode()
    assert _name_at(later, later.site) == ".hold"
    ahead = _move(["foot", "down"], "body")
    moved = '.body(z=-0.03, over=0.6).foot("FR", z=0.1, over=0.5).down("FR", over=0.5).hold(0.4)'
    assert moved in "".join(line.strip() for line in ahead.data.decode().splitlines())
    assert max(map(len, ahead.data.splitlines())) <= LONGEST_LINE
    assert _name_at(ahead, ahead.site) == ".down"


def test_one_call_goes_before_the_first_of_all() -> None:
    after = _move(["hold"], "body", is_ahead=True)
    text = after.data.decode()
    assert text.index(".hold(0.4)") < text.index(".body(")
    with pytest.raises(StudioError, match="one at a time"):
        _move(["foot", "hold"], "body", is_ahead=True)


@pytest.mark.parametrize(
    ("names", "target", "line"),
    [
        (
            ["hold"],
            "foot",
            '    line = line.foot("FR", z=0.1, over=0.5).hold(0.4).down("FR", over=0.5)  # low',
        ),
        (["hold"], "pose", "        .hold(0.4)  # low"),
        (["hold"], "home", "    return line.home(over=0.6).hold(0.4)  # low"),
    ],
)
def test_a_call_takes_its_comment_along(names: Sequence[str], target: str, line: str) -> None:
    after = _move(names, target)
    assert line in after.data.decode().splitlines(), after.data.decode()
    assert _name_at(after, after.site) == f".{names[-1]}"


def test_a_comment_is_left_out_where_none_may_stand() -> None:
    text = LINE.replace("z=0.1, over=0.5)", "z=0.1, over=0.5)\\\n        ")
    source, (site,) = Source(text.encode()), _sites("hold")
    target = list(source.syntax.site(text.index("over=0.5)") + 9))
    after = edited_together(source, {"op": "move", "sites": [site], "site": target}, edited)
    assert ".hold(0.4)\\\n" in after.data.decode()
    assert "# low" not in after.data.decode()


def test_several_arguments_are_set_at_once() -> None:
    (site,) = _sites("foot")
    order = {"op": "set_many", "site": site, "values": {"z": 0.12, "x": 0.05}}
    after = edited_together(SOURCE, order, edited)
    assert after.data.decode() == LINE.replace("z=0.1, over=0.5", "z=0.12, over=0.5, x=0.05")
    assert after.slots(after.site or (0, 0))[0].value == "FR", "the place is that of the call"


def test_copies_go_behind_the_last_in_their_order() -> None:
    order = {"op": "copies", "sites": _sites("down", "foot"), "site": _sites("down")[0]}
    foot, down = '.foot("FR", z=0.1, over=0.5)', '.down("FR", over=0.5)'
    expected = LINE.replace(down, f"{down}{foot}\n    line = line{down}")  # not too long a line
    assert edited_together(SOURCE, order, edited).data.decode() == expected


def test_what_is_copied_is_laid_out_as_where_it_is_pasted() -> None:
    texts = copied(SOURCE, {"sites": _sites("hold", "body")})
    assert texts == (".body(z=-0.03, over=0.6)", ".hold(0.4)")
    after = pasted(SOURCE, {"site": _sites("pose")[0]}, texts).data.decode()
    assert '"bow", over=0.8)\n        .body(z=-0.03, over=0.6)\n        .hold(0.4)\n' in after


@pytest.mark.parametrize(
    "order",
    [
        {"op": "many", "orders": []},
        {"op": "many", "orders": "delete"},
        {"op": "many", "orders": [{"op": "delete"}]},
        {"op": "many", "orders": [{"op": "delete", "site": [True, 1]}]},
        {"op": "set_many", "site": [7, 41], "values": {}},
        {"op": "set_many", "site": [7, 41], "values": {"z": [0.1]}},
        {"op": "copies", "sites": [[1, 1]], "site": [1, 1]},
    ],
)
def test_what_is_no_edit_is_refused(order: dict[str, object]) -> None:
    with pytest.raises(StudioError):
        edited_together(SOURCE, order, edited)


def test_nothing_is_pasted_before_something_is_copied() -> None:
    with pytest.raises(StudioError, match="nothing was copied"):
        pasted(SOURCE, {"site": _sites("pose")[0]}, ())
