"""``python -m benchmarks bridges``: other people's protocols between processes on the loopback."""

from benchmarks.bridges import ros2, unitree
from benchmarks.command import Benchmark
from controller.bridges.unitree import require_dds

STUDIES = (ros2.STUDY, *unitree.STUDIES)
run = Benchmark(
    "bridges",
    "A server in a process of its own, on the loopback: answers, losses, latencies, and the robot\n"
    "driven through them. Needs the extras; wants an idle machine.",
    STUDIES,
    takes="two minutes each; needs the extras",
    examples=("ros2 --runs 5", "--json --out bridges.json"),
    runs=1,
    needs={"ros2": ros2.require, "unitree": require_dds},
).run
