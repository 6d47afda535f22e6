"""Dances: moves in an order that a seed chooses, on the beats of a song.

The robot answers a little late, and later with its trunk than with a foot. So a dance is written
ahead of the song by that much, and what is on the beat is what is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, MotionInfeasible, unknown_name
from motions.feasibility.check import CheckedMotion, FeasibilityChecker
from motions.language.timeline import Timeline
from motions.music.beat_tracking import Beats
from motions.music.dance_moves import MOVES, Accent, Move

LEAD = 0.006
"""How far [s] a dance is written ahead of the song. On the tuning seeds 0 to 9 the trunk turned
back 7 ms late in the mean (241 accents), and a foot was on the ground 6 ms early (64)."""
LONGEST = 180.0
"""Length [s] of the longest dance: it ends before a longer song. A run is kept for 4 minutes."""
SHORTEST_PULSE = 0.55
"""Least length [s] of a pulse: a move takes one. Own choice."""
LEAST_PULSES = 4
"""Fewer are no dance."""
GET_READY = 0.3
"""Time [s] from the start of the song before which no move starts."""
MOVES_PER_SECOND = 20 / 30
"""Moves that a dance has at least, where the pulses allow it: 20 in half a minute."""
SLACK = 2.0
"""How many moves a dance may be behind that until its end; as many more are aimed for."""
RECENT = 4
"""Moves that are not chosen again to fill a gap, where there are others."""
UNEVEN = 0.6
"""A pulse that comes sooner than this share of the usual after another is none."""
ATTEMPTS = 12
"""How often infeasible moves are replaced before the dance is given up."""


@dataclass(frozen=True, slots=True)
class PlacedMove:
    """A move at its place: the first pulse of it, counted through the dance."""

    move: Move
    pulse: int


@dataclass(frozen=True, slots=True)
class Dance:
    """A dance, written.

    Attributes:
        timeline: the motion; it starts with the song.
        moves: what is done, in order.
        accents: what shall happen on the beats, by pulses of the dance.
        pulses: instants [s] of the pulses in the song; the first one is counted in, without an
            accent.
    """

    timeline: Timeline
    moves: tuple[PlacedMove, ...]
    accents: tuple[Accent, ...]
    pulses: Float[np.ndarray, " n"]

    def time(self, accent: Accent) -> float:
        """When [s] in the song ``accent`` shall happen."""
        return float(self.pulses[accent.pulse])


def pulses_of(found: Beats) -> Float[np.ndarray, " n"]:
    """The instants [s] of a song on which a dance has its accents.

    Every beat, or every second, fourth ... of a fast song; of these the ones with the strongest
    notes. So a song that was counted twice as fast as it is played is danced on its beats.
    """
    usual = float(np.median(np.diff(found.times)))
    every = 1
    while every * usual < SHORTEST_PULSE:
        every *= 2
    strength = [float(np.mean(found.strengths[first::every])) for first in range(every)]
    chosen = found.times[int(np.argmax(strength)) :: every]
    kept = [float(time) for time in chosen[:1]]
    for time in chosen[1:]:
        if time - kept[-1] > UNEVEN * every * usual:
            kept.append(float(time))
    return np.array(kept)


def compose(found: Beats, seed: int, names: Sequence[str] = ()) -> Dance:
    """A dance on the beats of a song.

    Args:
        found: the beats.
        seed: what chooses the moves.
        names: moves to choose from, by default all; see ``MOVES``.

    Raises:
        CommandError: for an unknown move, or a song too short for a dance.
    """
    moves = _named(names)
    pulses = _playable(pulses_of(found))
    wanted = MOVES_PER_SECOND * min(found.duration, LONGEST) + SLACK
    return _written(pulses, _chosen(pulses, moves, wanted, np.random.default_rng(seed)), seed)


def feasible_dance(
    found: Beats, seed: int, checker: FeasibilityChecker, names: Sequence[str] = ()
) -> tuple[Dance, CheckedMotion]:
    """A dance that the check accepts: moves that it refuses are replaced by others.

    Raises:
        CommandError: as ``compose``.
        MotionInfeasible: if no order of these moves is feasible.
    """
    dance = compose(found, seed, names)
    pulses, rng = dance.pulses, np.random.default_rng([seed, 1])
    checked = checker.evaluate(dance.timeline)
    for _ in range(ATTEMPTS):
        if checked.report.ok:
            return dance, checked
        times = [finding.time for finding in checked.report.failures]
        moves = _replaced(dance, times, _named(names), rng)
        if moves == list(dance.moves):
            break
        dance = _written(pulses, moves, seed)
        checked = checker.evaluate(dance.timeline)
    raise MotionInfeasible(dance.timeline.name, checked.report.failures)


def _named(names: Sequence[str]) -> list[Move]:
    for name in names:
        if name not in MOVES:
            raise CommandError(unknown_name("move", name, MOVES))
    return [MOVES[name] for name in names or MOVES]


def _playable(pulses: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
    """The pulses from the first on halfway after which a move may start; that is the count-in."""
    pulses = pulses[pulses < LONGEST]
    middles = 0.5 * (pulses[1:] + pulses[:-1])
    late = (pulses[:-1] >= LEAD) & (middles - LEAD >= GET_READY)
    kept = pulses[int(np.argmax(late)) :] if late.any() else pulses[:0]
    if len(kept) < LEAST_PULSES:
        raise CommandError(
            f"the song is too short for a dance: it has room for {max(len(kept) - 1, 0)} accents, "
            f"{LEAST_PULSES - 1} are needed"
        )
    return kept


def _chosen(
    pulses: Float[np.ndarray, " n"],
    moves: Sequence[Move],
    wanted: float,
    rng: np.random.Generator,
) -> list[PlacedMove]:
    """Moves until the song ends, about as many as ``wanted``.

    Each comes once before one comes again, none twice in a row; long ones when there is time.
    """
    pulse, per_pulse = float(np.median(np.diff(pulses))), wanted / len(pulses)
    placed: list[PlacedMove] = []
    bag: list[Move] = []
    now = 1
    while now < len(pulses):
        if not bag:
            bag = [moves[i] for i in rng.permutation(len(moves))]
        last = placed[-1].move if placed else None
        until = min((len(placed) + 1 + SLACK) / per_pulse, len(pulses))
        fits = [m for m in bag if m is not last and now + m.pulses(pulse) <= until]
        move = next(iter(fits), None)
        if move is None:
            move = _shortest(moves, placed, pulse, rng)
            if now + move.pulses(pulse) > len(pulses):
                break
        else:
            bag.remove(move)
        placed.append(PlacedMove(move, now))
        now += move.pulses(pulse)
    if not placed:
        raise CommandError("the song is too short for these moves")
    return placed


def _shortest(
    moves: Sequence[Move], placed: Sequence[PlacedMove], pulse: float, rng: np.random.Generator
) -> Move:
    """One of the shortest moves that was not made just now."""
    recent = [item.move for item in placed[-RECENT:]]
    others = [move for move in moves if move not in recent]
    others = others or [move for move in moves if move not in recent[-1:]] or list(moves)
    least = min(move.pulses(pulse) for move in others)
    shortest = [move for move in others if move.pulses(pulse) == least]
    return shortest[rng.integers(len(shortest))]


def _replaced(
    dance: Dance, times: Sequence[float], moves: Sequence[Move], rng: np.random.Generator
) -> list[PlacedMove]:
    """The moves of ``dance``; another of the same length for each that is at one of ``times``."""
    pulse = float(np.median(np.diff(dance.pulses)))
    placed = list(dance.moves)
    for number, item in enumerate(placed):
        start, end = _span(dance, item, pulse)
        if not any(start <= time <= end for time in times):
            continue
        length = item.move.pulses(pulse)
        others = [m for m in moves if m.pulses(pulse) == length and m is not item.move]
        beside = [other.move for other in placed[max(number - 1, 0) : number + 2]]
        others = [m for m in others if m not in beside] or others
        if others:
            placed[number] = PlacedMove(others[rng.integers(len(others))], item.pulse)
    return placed


def _span(dance: Dance, item: PlacedMove, pulse: float) -> tuple[float, float]:
    clock = dance.timeline.clock
    return clock.at(item.pulse - 0.5), clock.at(item.pulse + item.move.pulses(pulse) - 0.5)


def _written(pulses: Float[np.ndarray, " n"], placed: Sequence[PlacedMove], seed: int) -> Dance:
    pulse = float(np.median(np.diff(pulses)))
    line = Timeline(name=f"dance {seed}").on_beats(pulses - LEAD).at(0.5)
    accents: list[Accent] = []
    for item in placed:
        line = item.move.written(line, pulse)
        accents += [Accent(item.pulse + a.pulse, a.part, a.sign) for a in item.move.accents(pulse)]
    return Dance(line, tuple(placed), tuple(accents), pulses)
