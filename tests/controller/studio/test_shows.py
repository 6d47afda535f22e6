"""A show plays the motions of a file one after the other, written as its author would."""

from pathlib import Path

import pytest

from controller.studio.layout import LONGEST_LINE
from controller.studio.session import Studio
from controller.studio.shows import with_show
from controller.studio.source import Source
from go2_wbc.errors import StudioError
from motions.registry import load_text

ACTS = '''"""Acts."""

from motions import Timeline, motion


@motion
def bow() -> Timeline:
    """Bow."""
    return Timeline().body(z=-0.03, over=0.6).home(over=0.6)


@motion
def wave() -> Timeline:
    """Raise a paw."""
    return Timeline().foot("FR", z=0.08, over=0.5).down("FR", over=0.5).home(over=0.5)


TEMPO = 1.0  # behind them
'''
SHOW = '''

@motion
def show() -> Timeline:
    """The motions of this file, one after the other."""
    return bow().then(wave())
'''


def test_a_show_is_written_behind_its_motions_and_plays_them() -> None:
    source, name = with_show(Source(ACTS.encode()), ["bow", "wave"])
    head, behind = ACTS.split("\n\n\nTEMPO")
    assert source.data.decode() == head + "\n" + SHOW + "\n\nTEMPO" + behind
    own = load_text(Path("acts.py"), source.data)
    assert name == "show"
    assert own["show"]().end == pytest.approx(own["bow"]().end + own["wave"]().end)


def test_another_show_has_another_name_and_plays_no_show() -> None:
    first, _ = with_show(Source(ACTS.encode()), ["bow", "wave"])
    second, name = with_show(first, ["wave", "show", "bow"])
    assert name == "show_2"
    assert second.data.count(b"return wave().then(bow())") == 1
    with pytest.raises(StudioError, match="two motions or more"):
        with_show(first, ["bow", "show"])


def test_many_motions_make_no_long_line_and_line_ends_stay() -> None:
    names = [f"a_rather_long_name_{k}" for k in range(6)]
    parts = [
        f"@motion\ndef {name}() -> Timeline:\n    return Timeline().hold(1.0)\n" for name in names
    ]
    text = "from motions import Timeline, motion\n\n\n" + "\n\n".join(parts)
    source, _ = with_show(Source(text.rstrip("\n").replace("\n", "\r\n").encode()), names)
    assert source.data.count(b"\n") == source.data.count(b"\r\n")
    assert max(map(len, source.data.splitlines())) <= LONGEST_LINE
    assert load_text(Path("acts.py"), source.data)["show"]().end == pytest.approx(6.0)


def test_the_studio_shows_it_judges_it_and_takes_it_back(tmp_path: Path) -> None:
    file = tmp_path / "acts.py"
    file.write_text(ACTS, encoding="utf-8")
    with Studio(file, None, 0) as studio:
        show = {"op": "show", "base": studio._project.base, "commit": True}
        assert set(studio.edit(show)) == {"site"}
        assert (studio.motion, studio._motions) == ("show", ("bow", "wave", "show"))
        assert len(studio._bars) == 6, "its five moves, and that one follows the other"
        assert studio.export({"kind": "html"})["file"] == "show.html"
        assert studio.edit({"op": "undo"}) == {}
        assert file.read_text(encoding="utf-8") == ACTS
        assert studio.motion == "bow", "what has gone is shown no more"
        file.write_text(ACTS.replace(".home(over=0.6)", ""), encoding="utf-8")
        assert studio.look() or studio.look()
        refused = file.read_bytes()
        told = str(studio.edit({**show, "base": studio._project.base}))
        assert "the trunk is higher or lower" in told, "the first does not come home"
        assert file.read_bytes() == refused
        assert studio.motion == "bow"
