"""``python -m benchmarks dance``: dances to songs whose true beats are known.

Every trial is another song at another tempo, another dance, floor and mass. The songs are written
to a file and found again: what is judged is the whole way from the file to the feet. The beat
finder and the lead of the choreography were tuned on songs with seeds below 100.
"""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.robots import checker
from benchmarks.study import Study, TrialResult
from controller.motion_measurement import during_motion
from controller.sweeps.trials import Trial, TrialRobot
from motions.music import Beats, Song, beats, click_track, danced, feasible_dance, made_song
from motions.music.choreography import ON_THE_BEAT

SECONDS = 30.0  # Length [s] of a song
TEMPI = (62.0, 178.0)  # Tempi [beats/min] that are drawn
METRES = {"clicks": 4, "song": 4, "waltz": 3}  # Beats of a bar, by kind
FIRST_SONG = 5000  # Seed of the first song that is judged


def song_of(kind: str, seed: int) -> Song:
    """The song of a trial: clicks, or a made song, perhaps a waltz."""
    bpm = float(np.random.default_rng([FIRST_SONG, seed]).uniform(*TEMPI))
    if kind == "clicks":
        return click_track(bpm, SECONDS)
    return made_song(bpm, SECONDS, FIRST_SONG + seed, METRES[kind])


def heard(song: Song) -> Beats:
    """What the beat finder says of a song, from its file."""
    with TemporaryDirectory() as folder:
        return beats(song.save(Path(folder) / "song.wav"))


ROWS = (
    ("moves", "moves", ">= 20"),
    ("on_beat", "accents within 40 ms", ">= 0.95"),
    ("late", "accent off its beat, mean", "ms"),
    ("heard", "heard beat off, mean", "ms"),
    ("bars", "bars begun where heard", "share"),
)


def measure(trial: Trial, found: TrialResult, kind: str) -> None:
    """Find the beats, compose, dance, and compare with the beats that the song was made with.

    An accent that did not happen is on no beat, and not counted by its mean. Heard are the pulses
    on which the dance is composed; a bar is begun where it is within 40 ms of a true one.
    """
    song = song_of(kind, trial.seed)
    dance, checked = feasible_dance(heard(song), trial.seed, checker())
    with TrialRobot(trial) as robot:
        robot.require(robot.go2.stand())
        robot.truth.clear()
        robot.require(robot.go2.play(checked))
        recorded = during_motion(robot.go2, robot.truth, checked.plan.name)
    result = danced(recorded, dance)
    off = np.abs(dance.pulses[1:, None] - song.beats).min(axis=1)
    first = np.abs(dance.pulses[dance.downbeat :: dance.bar, None] - song.beats[:: METRES[kind]])
    found.values = {
        "moves": float(len(dance.moves)),
        "on_beat": result.share_on(song.beats),
        "late": 1000.0 * float(np.nanmean(np.abs(result.errors(song.beats)))),
        "heard": 1000.0 * float(off.mean()),
        "bars": float((first.min(axis=1) <= ON_THE_BEAT).mean()),
    }


SONGS = {"clicks": "click track", "song": "made song", "waltz": "made waltz"}
STUDIES = tuple(
    Study(kind, {f"dance to a {song}, 30 s": ROWS}, partial(measure, kind=kind))
    for kind, song in SONGS.items()
)
run = Benchmark(
    "dance",
    "Dances to songs whose true beats are known: how many accents of the measured\n"
    "robot are on a beat. Needs the extra [music].",
    STUDIES,
    takes="minutes on two cores",
    examples=("--rows clicks --json",),
).run
