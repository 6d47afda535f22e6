"""A recorded run: what was measured and asked at each sample, as arrays.

The loop's telemetry fills it, the viewers replay it, the benchmarks measure it.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, fields
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import cut, inline_html
from go2_wbc.errors import ConfigError, MissingDependency
from go2_wbc.extras import install_line
from go2_wbc.files import checked_output, write_atomically

if TYPE_CHECKING:
    import pandas


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

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        """How long, and what was done."""
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
        arrays = (getattr(self, field.name)[rows] for field in fields(self)[:-1])
        return Recording(*arrays, labels=tuple(labels))

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
        """What ``save`` has written.

        Raises:
            ConfigError: if the file is missing, damaged, or no recording.
        """
        try:
            with np.load(io.BytesIO(Path(path).read_bytes()), allow_pickle=False) as file:
                *arrays, labels = (file[field.name] for field in fields(Recording))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise ConfigError(f"{path} is missing, damaged, or no recording of save()") from error
        return Recording(*arrays, labels=tuple(labels.tolist()))

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
        for field in fields(self)[1:-1]:
            values = getattr(self, field.name)
            if values.ndim == 1:
                columns[field.name] = values
            else:
                columns |= {f"{field.name}{i}": column for i, column in enumerate(values.T)}
        return pandas.DataFrame(columns)

    def spans(self) -> tuple[Span, ...]:
        """Stretches of equal labels, in order; each ends where the next begins."""
        labels, time = self.labels, self.time - self.time[0]
        starts = [next(rows) for _, rows in groupby(range(len(labels)), labels.__getitem__)]
        return tuple(
            Span(float(time[start]), float(time[end]), labels[start])
            for start, end in pairwise([*starts, len(labels) - 1])
        )
