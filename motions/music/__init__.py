"""Music: the beats of a song, songs whose beats are known, and dances on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from motions.music.beat_tracking import Beats, beats
    from motions.music.choreography import Dance, DancedAccents, compose, danced, feasible_dance
    from motions.music.dance_moves import MOVES, Accent, Move
    from motions.music.songs import Song, click_track, made_song

__all__ = [
    "MOVES",
    "Accent",
    "Beats",
    "Dance",
    "DancedAccents",
    "Move",
    "Song",
    "beats",
    "click_track",
    "compose",
    "danced",
    "feasible_dance",
    "made_song",
]

__getattr__ = lazy_exports(__name__)
