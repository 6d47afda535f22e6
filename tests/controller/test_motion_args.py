"""Which motions a command line means."""

from __future__ import annotations

from controller.cli.motion_args import meant
from motions import motion_names


def test_without_a_word_the_whole_library_is_meant_and_with_one_that_motion() -> None:
    assert [line.name for line in meant([], [])] == list(motion_names())
    assert [line.name for line in meant(["bow"], [])] == ["bow"]
