"""A recorded run: what was measured and asked at each sample, as arrays.

The loop's telemetry fills it, the viewers replay it, the benchmarks measure it.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import partial
from importlib.metadata import entry_points
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import cut, inline_html
from go2_wbc.errors import EXTRAS, ConfigError, MissingDependency, install_line, needing
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.legs import JOINT_NAMES, LEGS

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

EXPORTS = {".mcap": "mcap", ".rrd": "rerun"}
"""Files for other viewers, and the extra that each needs."""


_FEET = ("friction +x", "friction -x", "friction +y", "friction -y", "normal force")
_JOINTS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
LIMIT_ROWS = (
    *(f"{leg.name} {what}" for leg in LEGS for what in _FEET),
    *(f"{joint} torque" for joint in _JOINTS),
    *(f"{joint} acceleration" for joint in _JOINTS),
    *(f"{leg.name} contact" for leg in LEGS),
)
"""What each column of ``Recording.multipliers`` is of (``wbc.constraints.Multipliers``)."""
CONTRADICTION = "limits contradict each other"


def _limits() -> dict[str, Callable[[Float[np.ndarray, "n 48"]], Bool[np.ndarray, " n"]]]:
    """What users call a limit, and where multipliers say that it binds."""
    found = dict[str, Callable[..., Any]]()
    for leg in LEGS:
        feet = slice(5 * leg, 5 * leg + 4)
        found[f"friction of {leg.name}"] = lambda y, k=feet: (np.abs(y[:, k]) > 0.0).any(axis=1)
        found[f"least normal force of {leg.name}"] = lambda y, k=feet: y[:, k.stop] < 0.0
        found[f"greatest normal force of {leg.name}"] = lambda y, k=feet: y[:, k.stop] > 0.0
    for n, joint in enumerate(_JOINTS):
        found[f"torque limit of {joint}"] = lambda y, k=20 + n: np.abs(y[:, k]) > 0.0
        found[f"end or speed of {joint}"] = lambda y, k=32 + n: np.abs(y[:, k]) > 0.0
    for leg in LEGS:
        found[f"contact of {leg.name}"] = lambda y, k=44 + leg: np.abs(y[:, k]) > 0.0
    return found


LIMITS = _limits()


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time with one label."""

    start: float  #: seconds after the start of the recording
    end: float  #: seconds after the start of the recording
    label: str  #: what the robot was doing


@typed()
@dataclass(frozen=True, slots=True)
class Recording:
    """Samples of one run, all of the same length n.

    Attributes:
        time: (n,) plant time [s], increasing.
        q: (n, 19) measured configuration (base position, quaternion x y z w, joints).
        v: (n, 18) measured velocity (base frame).
        tau: (n, 12) applied joint torques [N m].
        foot_forces: (n, 4) measured normal foot forces [N].
        stance: (n, 4) feet that the controller planned to be in contact.
        p_world_com: (n, 3) centre of mass [m].
        support_margin: (n,) distance [m] of the CoM's ground projection to the edge of the support
            polygon of the planned stance feet, positive inside; nan with fewer than three.
        labels: activity at each sample ("stand", "walk", ...), length n.
        robot: name of the robot's profile.
        model_file: its own MJCF or URDF, by which it is drawn; empty if it has none.
        ground: (k, 3) middles of the seen cells of ground [m], with the last height of each; empty
            for a blind robot.
        multipliers: (n, 48) of the limits of the whole-body QP (``LIMIT_ROWS`` names them), the
            largest of each between this sample and the next; nan where no QP was solved. None
            unless the robot recorded them (``go2.telemetry.explains``).
        gave_way: (n,) whether limits contradicted each other, so that some were relaxed; None as
            above.
    """

    time: Float[np.ndarray, " n"]
    q: Float[np.ndarray, "n 19"]
    v: Float[np.ndarray, "n 18"]
    tau: Float[np.ndarray, "n 12"]
    foot_forces: Float[np.ndarray, "n 4"]
    stance: Bool[np.ndarray, "n 4"]
    p_world_com: Float[np.ndarray, "n 3"]
    support_margin: Float[np.ndarray, " n"]
    labels: tuple[str, ...]
    robot: str = "go2"
    model_file: str = ""
    ground: Float[np.ndarray, "k 3"] = field(default_factory=partial(np.empty, (0, 3)))
    multipliers: Float[np.ndarray, "m 48"] = field(default_factory=partial(np.empty, (0, 48)))
    gave_way: Bool[np.ndarray, " m"] = field(default_factory=partial(np.empty, 0, bool))

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        done = " ".join(label for label, _ in groupby(self.labels))
        return cut(f"Recording({len(self.time)} samples, {self.duration:.2f} s: {done})")

    @property
    def duration(self) -> float:
        """Seconds between the first and the last sample."""
        return float(self.time[-1] - self.time[0]) if len(self.time) else 0.0

    @property
    def is_explained(self) -> bool:
        """Whether it holds multipliers."""
        return len(self.multipliers) > 0

    def binding(self) -> tuple[Span, ...]:
        """When which limit of the whole-body QP was in the way, and when limits gave way."""
        if not self.is_explained:
            return ()
        time, last = self.time - self.time[0], len(self.time) - 1
        flags = {name: test(self.multipliers) for name, test in LIMITS.items()}
        spans = [
            Span(float(time[run.start]), float(time[min(run.stop, last)]), name)
            for name, rows in {**flags, CONTRADICTION: self.gave_way}.items()
            for run in true_runs(rows)
        ]
        return tuple(sorted(spans, key=lambda span: span.start))

    @typed(late=True)
    def part(self, rows: slice | Int[np.ndarray, " k"]) -> Recording:
        """Some of the samples, with their times unchanged.

        Args:
            rows: of the samples to keep, in increasing order.
        """
        labels = np.array(self.labels, dtype=object)[rows]
        names = (*_ARRAYS, *_NOTED) if self.is_explained else _ARRAYS
        arrays = {name: getattr(self, name)[rows] for name in names}
        return replace(self, **arrays, labels=tuple(labels))

    @typed()
    def save(self, path: Path | str) -> Path:
        """Write it to a ``.npz`` file, which ``load`` and ``numpy.load`` read; gives its path.

        Raises:
            ConfigError: for another ending, or a place that cannot be written to.
        """
        target, stream = checked_output(path, [".npz"]), io.BytesIO()
        arrays = {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}
        np.savez_compressed(stream, allow_pickle=False, **arrays)
        return write_atomically(target, stream.getvalue())

    @staticmethod
    @typed()
    def load(path: Path | str) -> Recording:
        """What ``save`` has written, also before a recording said which robot it holds: a Go2.

        Raises:
            ConfigError: if the file is missing, damaged, or no recording.
        """
        try:
            with np.load(io.BytesIO(Path(path).read_bytes()), allow_pickle=False) as file:
                values: dict[str, Any] = {name: file[name] for name in _ARRAYS}
                values |= {
                    name: str(file[name]) for name in ("robot", "model_file") if name in file
                }
                values |= {name: file[name] for name in ("ground", *_NOTED) if name in file}
                labels = tuple(file["labels"].tolist())
        except (OSError, TypeError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise ConfigError(f"{path} is missing, damaged, or no recording of save()") from error
        return Recording(**values, labels=labels)

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas table, a row for each sample: ``time``, ``label``, ``q0`` to ``q18`` and so on.

        Raises:
            MissingDependency: without pandas; says how to get it.
        """
        with needing("examples", "a table needs pandas"):
            import pandas
        columns: dict[str, object] = {"time": self.time, "label": self.labels}
        for name in _ARRAYS[1:]:
            values = getattr(self, name)
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}{i}": column for i, column in enumerate(values.T)}
        if self.is_explained:
            named = zip(LIMIT_ROWS, self.multipliers.T, strict=True)
            columns |= {f"multiplier: {name}": column for name, column in named}
            columns["gave_way"] = self.gave_way
        return pandas.DataFrame(columns)

    @typed()
    def export(self, path: Path | str) -> Path:
        """Write it for other viewers: ``.mcap`` for Foxglove, ``.rrd`` for Rerun; gives its path.

        Raises:
            ConfigError: for another ending, a place that cannot be written to, or no sample.
            MissingDependency: without the extra; says how to get it.
        """
        target = checked_output(path, list(EXPORTS))
        return write_atomically(target, viewer(EXPORTS[target.suffix])(self._with_samples()))

    def plot(self) -> Figure:
        """Trunk, feet, and torques against a Go2's limits over time; needs no display.

        Raises:
            ConfigError: for a recording without a sample.
        """
        return viewer("plot")(self._with_samples())

    def _with_samples(self) -> Recording:
        if not len(self.time):
            raise ConfigError("the recording has no sample")
        return self

    def spans(self) -> tuple[Span, ...]:
        """Stretches of equal labels, in order; each ends where the next begins."""
        labels, time = self.labels, self.time - self.time[0]
        starts = [next(rows) for _, rows in groupby(range(len(labels)), labels.__getitem__)]
        return tuple(
            Span(float(time[start]), float(time[end]), labels[start])
            for start, end in pairwise([*starts, len(labels) - 1])
        )


def true_runs(flags: Bool[np.ndarray, " n"]) -> list[slice]:
    """Where ``flags`` is true without a gap, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def viewer(name: str) -> Any:  # noqa: ANN401 - each makes something else of a recording
    """What makes a plot, or the content of a file, of a recording: an entry point, as of ``viz``.

    Raises:
        MissingDependency: without the extra of this name; says how to get it.
    """
    entries = [*entry_points(group="go2_wbc.recording", name=name)]
    try:
        return entries[0].load()
    except (ImportError, IndexError) as error:
        line = install_line(name) if name in EXTRAS else "python -m pip install go2-wbc"
        raise MissingDependency(f"{name} is not installed ({error}): {line}") from error


_ARRAYS = tuple(field.name for field in fields(Recording))[:8]
"""The fields that have a row for each sample."""
_NOTED = ("multipliers", "gave_way")  #: Those that may have one
