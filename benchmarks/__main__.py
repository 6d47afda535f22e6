"""``python -m benchmarks NAME``: runs one benchmark."""

import sys
from collections.abc import Sequence

from controller.cli.common import ExitCode
from controller.cli.main import Command, Program, run_program

COMMANDS: tuple[Command, ...] = (
    Command("behaviour", "benchmarks.behaviour", "what the robot does in MuJoCo, over many seeds"),
    Command("feasibility", "benchmarks.feasibility", "the feasibility check against physics"),
    Command("bridges", "benchmarks.bridges", "ROS 2 and Unitree's protocol, by processes"),
    Command("qp_infeasibility", "benchmarks.qp_infeasibility", "the QP that contradicts itself"),
    Command("locomotion", "benchmarks.locomotion", "gaits at their speeds"),
    Command("envelopes", "benchmarks.envelopes", "the greatest speed of each gait, and store it"),
    Command("balance", "benchmarks.balance", "pushes, drops, gait changes; falls noticed"),
    Command("policies", "benchmarks.policies", "the cloned trot; hand-overs; wrong sidecars named"),
    Command("combined", "benchmarks.combined", "coming to rest; worlds hard in several ways"),
    Command("rough", "benchmarks.rough", "stairs, blocks, slopes, waves, blind; reversals"),
    Command("faults", "benchmarks.faults", "broken parts: named in time, and outlived"),
    Command("sequences", "benchmarks.sequences", "random calls: does every answer hold?"),
    Command("dance", "benchmarks.dance", "dances against the true beats of their songs"),
    Command("golden", "benchmarks.golden", "is every tick what it was, to the last bit?"),
    Command("speed", "benchmarks.speed", "processor time of the QP and of a control tick"),
    Command("studio", "benchmarks.studio", "from the pointer to the verdict on the studio's page"),
    Command("probability", "benchmarks.probability", "is the stated chance the one that it has?"),
    Command("adversary", "benchmarks.adversary", "a search for motions that pass and fail"),
    Command("border", "benchmarks.border", "verdict and chance at the border of what is done"),
    Command("solve", "benchmarks.solved_plans", "solve the library's dynamic plans, to ship them"),
    Command("gallery", "benchmarks.gallery", "play the library's motions, write their pictures"),
    Command("evidence", "benchmarks.evidence", "fill the table of docs/evidence.md"),
)
GONE = {
    "answers": "`qp_infeasibility` is its name",
    "jump_limits": "docs/explanation/dynamics.md has its results, commit 55f699b its program",
    "dynamics": "commit 55f699b has the program",
    "dynamic_motions": "`feasibility --rows dynamic` plays solved motions, and more of them",
    "false_negatives": "docs/feasibility.md has its results, commit 404d8b9 its program",
    "plain": "tests/controller/test_compiled_robot.py runs the demo so",
    "nearest": "docs/motions.md has its results, commit 404d8b9 its program",
    "steps": "docs/motions.md has its results, commit 404d8b9 its program",
    "sweeps": "commit 55f699b has the program",
}
"""What is no command any more, and where it is."""
EXAMPLES = """
python -m benchmarks --list                     these benchmarks
python -m benchmarks behaviour --list           the metrics of one, and their thresholds
python -m benchmarks behaviour --quick          three seeds
python -m benchmarks behaviour --resume         go on after an interruption
python -m benchmarks feasibility --json
python -m benchmarks bridges ros2 --runs 5
python -m benchmarks golden record out/golden
python -m benchmarks NAME --help                the options of one, with examples
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark that the arguments name; see ``run_program`` for the exit codes."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] and arguments[0] in GONE:
        print(f"{arguments[0]} is gone: {GONE[arguments[0]]}", file=sys.stderr)
        return ExitCode.USAGE
    if arguments == ["--list"]:
        for command in COMMANDS:
            print(f"{command.name:<18}{command.summary}")
        return ExitCode.OK
    description = "Measure over many seeds, against fixed thresholds. --list names the benchmarks."
    program = Program("python -m benchmarks", description, COMMANDS, EXAMPLES)
    return run_program(program, arguments)


if __name__ == "__main__":
    sys.exit(main())
