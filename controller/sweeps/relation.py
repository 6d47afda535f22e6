"""How the outcome of a sweep depends on what the seeds varied: rates and means, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from controller.sweeps.summary import mean_interval, rate_interval
from controller.sweeps.sweep_file import SEED, Columns, Row
from go2_wbc.errors import CommandError, unknown_name
from viz.render.plots import Relation

DRAWN = ("friction", "mass_scale", "joint_friction", "angle", "phase")
"""Columns of our own studies that a seed varies (``trials``, ``studies``, ``motion_study``)."""
CLOSEST = "closest_share"
"""Column of a motion's sweep: how much of its closest limit a run took; the rest is its margin."""
MOST_VALUES = 12  #: A parameter with more values than these is cut into bins
PER_BIN, MOST_BINS = 12, 8
"""Runs of a bin at least, where there are enough of them, and bins along a line at most."""
PER_CELL, MOST_CELLS = 8, 6  #: The same of a grid, along each side


def relations(rows: Sequence[Row], columns: Columns, over: Sequence[str] = ()) -> list[Relation]:
    """Every outcome over every parameter, or over two that were named, as a grid.

    Outcomes are the first truth value and the margin; where there is no margin, all numbers.

    Args:
        rows: of the sweep.
        columns: names and kinds of their values.
        over: one or two parameters; by default those of our own studies that vary.

    Raises:
        CommandError: for a name that is no column of numbers, or more than two.
    """
    numbers = [name for name in columns if columns[name] in ("int", "float") and name != SEED]
    for name in over:
        if name not in numbers:
            raise CommandError(unknown_name("column of numbers", name, numbers))
    if len(over) > 2:
        raise CommandError(f"a plot is over one or two parameters, got {len(over)}")
    given = {name: np.array([row[name] for row in rows], dtype=float) for name in numbers}
    drawn = [name for name in DRAWN if name in given and len(np.unique(given[name])) > 1]
    first = [name for name in columns if columns[name] == "bool"][:1]
    outcomes = {name: np.array([row[name] for row in rows], dtype=bool) for name in first}
    margins = {name: given[name] for name in numbers if "margin" in name}
    if CLOSEST in given:
        margins["margin, share left"] = 1.0 - given[CLOSEST]
    rest = {name: given[name] for name in numbers if name not in {*drawn, *over}}
    groups = [tuple(over)] if over else [(name,) for name in drawn]
    return [
        _relation(outcome, values, {name: given[name] for name in group})
        for outcome, values in (outcomes | (margins or rest)).items()
        for group in groups
    ]


def _relation(
    outcome: str,
    values: Bool[np.ndarray, " n"] | Float[np.ndarray, " n"],
    parameters: dict[str, Float[np.ndarray, " n"]],
) -> Relation:
    known = np.isfinite([values, *parameters.values()]).all(axis=0)
    values, axes = values[known], [given[known] for given in parameters.values()]
    line = len(axes) == 1
    along, across = len(values) // PER_BIN, math.isqrt(len(values) // PER_CELL)
    most = min(along, MOST_BINS) if line else min(across, MOST_CELLS)
    groups, labels = zip(*(_bins(axis, max(most, 2)) for axis in axes), strict=True)
    shape = tuple(len(names) for names in labels)
    cells = np.ravel_multi_index(groups, shape)
    stats = np.array([_mean(values[cells == cell]) for cell in range(math.prod(shape))])
    places = [float(np.mean(axes[0][groups[0] == k])) for k in range(shape[0])] if line else []
    is_rate = values.dtype == bool
    return Relation(
        over=tuple(parameters),
        outcome=outcome,
        is_rate=is_rate,
        labels=labels,
        stats=stats.reshape(*shape, 4),
        places=np.array(places),
        dots=np.column_stack([axes[0], values]) if line and not is_rate else np.zeros((0, 2)),
    )


def _bins(
    values: Float[np.ndarray, " n"], most: int
) -> tuple[Int[np.ndarray, " n"], tuple[str, ...]]:
    """The bin of each value, and what the bins are called: single values, or as many in each."""
    single = np.unique(values)
    if len(single) <= MOST_VALUES:
        return np.searchsorted(single, values), tuple(f"{value:.4g}" for value in single)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, most + 1)))
    rows = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    names = (f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges.tolist()))
    return rows, tuple(names)


def _mean(values: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, both ends of its 95 % interval, and how many values; nan where there is none."""
    if len(values) == 0:
        return math.nan, math.nan, math.nan, 0.0
    if values.dtype == bool:
        interval = rate_interval(int(values.sum()), len(values))
    else:
        interval = mean_interval(values)
    return float(values.mean()), *interval, float(len(values))
