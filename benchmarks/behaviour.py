"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds."""

from __future__ import annotations

from benchmarks import goals, high_fives, library, model, postures, sequence, slaps, trotting
from benchmarks.command import Benchmark
from benchmarks.study import Study

STUDIES: tuple[Study, ...] = (
    model.AGREEMENT,
    model.SOLUTIONS,
    postures.STAND,
    postures.PUSHES,
    trotting.TROT,
    trotting.PUSHES,
    goals.STUDY,
    high_fives.STUDY,
    slaps.STUDY,
    library.STUDY,
    sequence.STUDY,
)
"""In the order of the report."""
EXAMPLES = """
python -m benchmarks behaviour            everything; 11 minutes, two cores
python -m benchmarks behaviour --quick    three seeds
python -m benchmarks behaviour --resume   go on after an interruption
python -m benchmarks behaviour --list     the metrics and their thresholds
python -m benchmarks behaviour --rows stand trot --jobs 4
python -m benchmarks behaviour --json --out behaviour.json
python -m benchmarks behaviour --sensors imu --seeds 4
"""


BENCHMARK = Benchmark(
    "behaviour",
    "Stand, trot, pushes, goals, high five, slaps, the motions and the whole demo\n"
    "in MuJoCo, with friction, mass, heading and joint angles drawn by each seed.",
    EXAMPLES,
    STUDIES,
    more_seeds="; the demo takes 5 times N",
    sensors=True,
)
register, run = BENCHMARK.register, BENCHMARK.run
