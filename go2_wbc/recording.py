"""A recorded run: what was measured and asked at each sample, as arrays.

The loop's telemetry fills it, the viewers replay it, the benchmarks measure it.
"""

from __future__ import annotations

import io
import zipfile
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
from go2_wbc.errors import EXTRAS, ConfigError, MissingDependency, install_line
from go2_wbc.files import checked_output, write_atomically

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

EXPORTS = {".mcap": "mcap", ".rrd": "rerun"}
"""Files for other viewers, and the extra that each needs."""


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time with one label.

    Attributes:
        start, end: seconds after the start of the recording.
        label: what the robot was doing.
    """

    start: float
    end: float
    label: str


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
        support_margin: (n,) distance [m] of the CoM's ground projection to the edge of the
            support polygon of the planned stance feet, positive inside; nan with fewer than three.
        labels: what the robot was doing at each sample ("stand", "walk", ...), length n.
        robot: name of the robot's profile.
        model_file: its own MJCF or URDF, by which it is drawn; empty if it has none.
        ground: (k, 3) middles of the cells of ground that it has seen, each as it was found last
            [m]; none of a blind robot.
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

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        done = " ".join(label for label, _ in groupby(self.labels))
        return cut(f"Recording({len(self.time)} samples, {self.duration:.2f} s: {done})")

    @property
    def duration(self) -> float:
        """Seconds between the first and the last sample."""
        return float(self.time[-1] - self.time[0]) if len(self.time) else 0.0

    @typed(late=True)
    def part(self, rows: slice | Int[np.ndarray, " k"]) -> Recording:
        """Some of the samples, with their times unchanged.

        Args:
            rows: of the samples to keep, in increasing order.
        """
        labels = np.array(self.labels, dtype=object)[rows]
        arrays = {name: getattr(self, name)[rows] for name in _ARRAYS}
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
                values |= {"ground": file["ground"]} if "ground" in file else {}
                labels = tuple(file["labels"].tolist())
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise ConfigError(f"{path} is missing, damaged, or no recording of save()") from error
        return Recording(**values, labels=labels)

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas table, a row for each sample: ``time``, ``label``, ``q0`` to ``q18`` and so on.

        Raises:
            MissingDependency: without pandas; says how to get it.
        """
        try:
            import pandas
        except ImportError as error:
            line = install_line("examples")
            raise MissingDependency(f"a table needs pandas ({error}): {line}") from error
        columns: dict[str, object] = {"time": self.time, "label": self.labels}
        for name in _ARRAYS[1:]:
            values = getattr(self, name)
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}{i}": column for i, column in enumerate(values.T)}
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
