"""The optional extras: what each is for, and the line that installs it from anywhere."""

from __future__ import annotations

from collections.abc import Mapping

EXTRAS: Mapping[str, str] = {
    "dynamics": "jumps, hops, rears: trajectory optimisation",
    "music": "the beats of a song: dance",
    "sweep": "sweeps as Parquet files",
    "cluster": "sweeps on many machines",
    "gamepad": "a gamepad for teleop",
    "mcap": "recordings as MCAP files, for Foxglove",
    "rerun": "recordings as rrd files, for Rerun (490 MB)",
    "examples": "what some examples show their point with",
    "notebooks": "the notebooks: jupyter lab",
    "unitree": "Unitree's protocol: unitree-sim, unitree-drive",
}
"""What a user may want beside ROS 2, by the name of the extra."""


def install_line(extra: str, python: str = "python") -> str:
    """The command that adds an extra to the installed project, wherever it came from."""
    return f'{python} -m pip install "go2-wbc[{extra}]"'
