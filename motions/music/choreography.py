"""Dances: moves in an order drawn by a seed, on the beats of a song.

The robot follows with a small delay, its trunk with a larger one than its feet. So a dance is
written ahead of the song by this delay, and the visible motion is on the beat.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, MotionInfeasible, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.plant.mujoco.ground_truth import TOUCH, TruthRecording
from go2_wbc.robot.rotations import yaw_rotation
from motions.feasibility.check import CheckedMotion, FeasibilityChecker
from motions.language.keys import BODY_CHANNELS
from motions.language.timeline import Timeline
from motions.music.beat_tracking import Beats
from motions.music.dance_moves import MOVES, WALTZ, Accent, Move

LEAD = 0.006
"""How far [s] a dance is written ahead of the song. On the tuning seeds 0 to 9 the trunk turned
back 7 ms late in the mean (241 accents), and a foot was on the ground 6 ms early (64)."""
LONGEST = 180.0
"""Length [s] of the longest dance: it ends before a longer song. A run is kept for 4 minutes."""
SHORTEST_PULSE = 0.55  #: Least length [s] of a pulse: a move takes one. Own choice
LEAST_PULSES = 4  #: Fewer are no dance
GET_READY = 0.3  #: Time [s] from the start of the song before which no move starts
MOVES_PER_SECOND = 20 / 30
"""Moves that a dance has at least, where the pulses allow it: 20 in half a minute."""
SLACK = 2.0  #: How many moves a dance may be behind that until its end; as many more are aimed for
RECENT = 4  #: Moves that are not chosen again to fill a gap, where there are others
TRIPLE = 3  #: Metre of a waltz
UNEVEN = 0.6  #: A pulse that comes sooner than this share of the usual after another is none
ATTEMPTS = 12  #: How often infeasible moves are replaced before the dance is given up


@dataclass(frozen=True, slots=True)
class PlacedMove:
    """A move at its place: the first pulse of it, counted through the dance."""

    move: Move
    pulse: int


@dataclass(frozen=True, slots=True)
class Dance:
    """A dance, written.

    Attributes:
        timeline, moves: the motion, which starts with the song, and what is done, in order.
        accents: what shall happen on the beats, by pulses of the dance.
        pulses: instants [s] of the pulses in the song; the first one is counted in, without an
            accent.
        bar, downbeat: pulses of a bar, and number of the first pulse that begins one.
    """

    timeline: Timeline
    moves: tuple[PlacedMove, ...]
    accents: tuple[Accent, ...]
    pulses: Float[np.ndarray, " n"]
    bar: int = 1
    downbeat: int = 0

    def time(self, accent: Accent) -> float:
        """When [s] in the song ``accent`` shall happen."""
        return float(self.pulses[accent.pulse])

    def named(self, times: Float[np.ndarray, " m"]) -> list[str]:
        """The move under way at each instant [s] of the song; before the first, the dance."""
        starts = [self.timeline.clock.at(item.pulse - 0.5) for item in self.moves]
        names = [self.timeline.name, *(item.move.name for item in self.moves)]
        return [names[row] for row in np.searchsorted(starts, times, side="right")]


@dataclass(frozen=True, slots=True)
class Pulses:
    """The instants of a song on which a dance has its accents."""

    times: Float[np.ndarray, " n"]  #: instants [s]
    bar: int  #: pulses of a bar
    downbeat: int  #: number of the first pulse that begins one

    @property
    def usual(self) -> float:
        """The median distance [s] of two."""
        return float(np.median(np.diff(self.times)))

    def admits(self, pulse: int, length: int) -> bool:
        """Whether a move of ``length`` pulses may begin on ``pulse``.

        One of a bar or more begins with a bar; a shorter one stays within its bar, and one of two
        pulses begins on the first or third.
        """
        place = (pulse - self.downbeat) % self.bar
        is_inside = place % length == 0 and place + length <= self.bar
        return is_inside if length < self.bar else place == 0


def pulses_of(found: Beats) -> Pulses:
    """The instants of a song on which a dance has its accents.

    Every beat, or every second, fourth ... of a fast song, of a waltz every third; those on which
    bars begin, and of these the ones with the strongest notes. So a song that was counted twice as
    fast as it is played is danced on its beats.
    """
    usual, every = float(np.median(np.diff(found.times))), 1
    while every * usual < SHORTEST_PULSE:
        every *= found.metre if every == 1 and found.metre == TRIPLE else 2
    shared = math.gcd(every, found.metre)
    firsts = [k for k in range(every) if (k - found.downbeat) % shared == 0]
    strength = [float(np.mean(found.strengths[first::every])) for first in firsts]
    first = firsts[int(np.argmax(strength))]
    kept: list[float] = []
    for time in found.times[first::every]:
        if not kept or time - kept[-1] > UNEVEN * every * usual:
            kept.append(float(time))
    bar = found.metre // shared
    begins = [k for k in range(bar) if (first + k * every - found.downbeat) % found.metre == 0]
    return Pulses(np.array(kept), bar, begins[0])


def compose(found: Beats, seed: int, names: Sequence[str] = ()) -> Dance:
    """A dance on the beats of a song; its moves begin with the bars, where these are known.

    Args:
        found: the beats.
        seed: what chooses the moves.
        names: moves to choose from, by default all; see ``MOVES``.

    Raises:
        CommandError: for an unknown move, or a song too short for a dance.
    """
    pulses = _playable(pulses_of(found))
    moves = _moves(names, pulses)
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
    pulses, rng = Pulses(dance.pulses, dance.bar, dance.downbeat), np.random.default_rng([seed, 1])
    checked = checker.evaluate(dance.timeline)
    for _ in range(ATTEMPTS):
        if checked.report.ok:
            return dance, checked
        times = [finding.time for finding in checked.report.failures]
        moves = _replaced(dance, times, _moves(names, pulses), rng)
        if moves == list(dance.moves):
            break
        dance = _written(pulses, moves, seed)
        checked = checker.evaluate(dance.timeline)
    raise MotionInfeasible(dance.timeline.name, checked.report.failures)


def _moves(names: Sequence[str], pulses: Pulses) -> list[Move]:
    """Those named, else all that suit the bars."""
    for name in names:
        if name not in MOVES:
            raise CommandError(unknown_name("move", name, MOVES))
    suited = (name for name in MOVES if pulses.bar == TRIPLE or name not in WALTZ)
    return [MOVES[name] for name in names or suited]


def _playable(pulses: Pulses) -> Pulses:
    """The pulses from the first on halfway after which a move may start; that is the count-in."""
    times = pulses.times[pulses.times < LONGEST]
    middles = 0.5 * (times[1:] + times[:-1])
    late = (times[:-1] >= LEAD) & (middles - LEAD >= GET_READY)
    first = int(np.argmax(late)) if late.any() else len(times)
    kept = times[first:]
    if len(kept) < LEAST_PULSES:
        raise CommandError(
            f"the song is too short for a dance: it has room for {max(len(kept) - 1, 0)} accents, "
            f"{LEAST_PULSES - 1} are needed"
        )
    return Pulses(kept, pulses.bar, (pulses.downbeat - first) % pulses.bar)


def _chosen(
    pulses: Pulses, moves: Sequence[Move], wanted: float, rng: np.random.Generator
) -> list[PlacedMove]:
    """Moves until the song ends, about as many as ``wanted``.

    Each comes once before one comes again, none twice in a row; long ones when there is time. A
    pulse on which none may begin is a rest.
    """
    pulse, count = pulses.usual, len(pulses.times)
    per_pulse = wanted / count
    placed: list[PlacedMove] = []
    bag: list[Move] = []
    now = 1
    while now < count:
        if not bag:
            bag = [moves[i] for i in rng.permutation(len(moves))]
        last = placed[-1].move if placed else None
        until = min((len(placed) + 1 + SLACK) / per_pulse, count)
        admitted = [m for m in moves if pulses.admits(now, m.pulses(pulse))]
        fits = (m for m in bag if m in admitted and m is not last)
        move = next((m for m in fits if now + m.pulses(pulse) <= until), None)
        if move is not None:
            bag.remove(move)
        elif admitted:
            move = _shortest(admitted, placed, pulse, rng)
        if move is None:
            now += 1
            continue
        if now + move.pulses(pulse) > count:
            break
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


def _written(pulses: Pulses, placed: Sequence[PlacedMove], seed: int) -> Dance:
    pulse = pulses.usual
    line = Timeline(name=f"dance {seed}").on_beats(pulses.times - LEAD)
    accents: list[Accent] = []
    for item in placed:
        line = item.move.written(line.at(item.pulse - 0.5), pulse)
        accents += [Accent(item.pulse + a.pulse, a.part, a.sign) for a in item.move.accents(pulse)]
    moves = tuple(placed)
    return Dance(line, moves, tuple(accents), pulses.times, pulses.bar, pulses.downbeat)


ON_THE_BEAT = 0.04
"""Distance [s] from a beat within which an accent is on it: one picture of a film (25 a second)."""
NEAR = 0.45  #: Share of a pulse, before and after it, in which its accent is looked for


@dataclass(frozen=True, slots=True)
class DancedAccents:
    """When the accents of a dance happened."""

    wanted: Float[np.ndarray, " n"]  #: instants [s] in the song on which they should
    happened: Float[np.ndarray, " n"]  #: at which they did; nan for one that did not

    def errors(self, beats: Float[np.ndarray, " k"]) -> Float[np.ndarray, " n"]:
        """How late [s] each accent was after the nearest of ``beats``; nan if it did not happen."""
        nearest = np.abs(self.happened[:, None] - beats).argmin(axis=1)
        return self.happened - beats[nearest]

    def share_on(self, beats: Float[np.ndarray, " k"]) -> float:
        """Share of the accents within 40 ms of one of ``beats``."""
        return float((np.abs(self.errors(beats)) <= ON_THE_BEAT).mean())


def danced(recorded: TruthRecording, dance: Dance) -> DancedAccents:
    """When the accents of ``dance`` happened.

    A channel of the trunk counts where it is greatest, or least, within half a pulse; a foot where
    the ground first bears it after it was in the air.

    Args:
        recorded: the run, from the instant on at which the song began.
    """
    time = recorded.time - recorded.time[0]
    tracks = _tracks(recorded)
    reach = NEAR * float(np.median(np.diff(dance.pulses)))
    wanted = np.array([dance.time(accent) for accent in dance.accents])
    happened = []
    for accent, instant in zip(dance.accents, wanted, strict=True):
        rows = slice(*np.searchsorted(time, [instant - reach, instant + reach]).tolist())
        happened.append(_happened(accent, time[rows], tracks[rows], recorded.foot_forces[rows]))
    return DancedAccents(wanted, np.array(happened))


def _tracks(recorded: TruthRecording) -> Float[np.ndarray, "n 6"]:
    """The trunk's channels, seen from where it was at the start."""
    turn = yaw_rotation(float(recorded.rpy[0, 2])).T
    return np.hstack([(recorded.q[:, :3] - recorded.q[0, :3]) @ turn.T, recorded.rpy])


def _happened(
    accent: Accent,
    time: Float[np.ndarray, " m"],
    tracks: Float[np.ndarray, "m 6"],
    forces: Float[np.ndarray, "m 4"],
) -> float:
    if len(time) == 0:
        return np.nan
    if accent.part not in BODY_CHANNELS:
        bears = forces[:, Leg[accent.part]] > TOUCH
        landings = 1 + np.flatnonzero(bears[1:] & ~bears[:-1])
        return float(time[landings[0]]) if len(landings) else np.nan
    row = int((accent.sign * tracks[:, BODY_CHANNELS.index(accent.part)]).argmax())
    is_inside = 0 < row < len(time) - 1
    return float(time[row]) if is_inside else np.nan
