"""Fits the model of ``motions.feasibility.report`` to outcomes, and judges its calibration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import minimize
from scipy.special import expit, log_expit

from motions.feasibility.report import ProbabilityModel, Rise

LEAST_SAMPLES = 20
"""Runs in which a check must have looked at something for its curve to be fitted."""
CENTRE_SPREAD = 2.0
"""Standard deviation of a centre about 0 before anything is seen, as of all that follow."""
USUAL_WIDTH = 0.3  # Width before anything is seen
WIDTH_SPREAD = 1.5  #: Standard deviation of the logarithm of a width before anything is seen
FARTHEST, WIDTHS = (-10.0, 10.0), (1e-3, 3.0)
"""Centres and the rest, and widths, that are looked at."""
LEAST_SPREAD = 1e-2
"""Of a margin, as a share of its size, below which it counts as the same in all runs."""
MOST = 20.0  #: Value of asinh beyond which more of it, or an infinite margin, tells nothing
REST_SPREAD = 5.0  # Standard deviation of the log odds of the rest
USUAL_LEAK, LEAK_SPREAD = -3.0, 1.5
"""Log odds of the leak before anything is seen, and their standard deviation."""
BINS = 10
RESAMPLES = 1000
_LEAST = 1e-9


class Sample(NamedTuple):
    """A motion in a world, its least margins, and its end; runs of one are not independent."""

    motion: str
    margins: Mapping[str, float]
    is_done: bool


def fit_model(samples: Sequence[Sample]) -> ProbabilityModel:
    """The model of greatest posterior density (MAP), by L-BFGS.

    Log likelihood of outcomes y in {0, 1} with P of the model, plus normal priors on each centre,
    on the logarithm of each width, on the rest and on the log odds of the leak; over
    asinh(margin / unit), of no unit.
    """
    names, units = _fitted(samples)
    x = np.clip(np.arcsinh(_table(samples, names) / units), -MOST, MOST)
    done = np.array([sample.is_done for sample in samples])
    start = np.concatenate(
        [np.zeros(len(names)), np.full(len(names), np.log(USUAL_WIDTH)), [3.0], [USUAL_LEAK]]
    )
    bounds = [FARTHEST] * len(names) + [np.log(WIDTHS)] * len(names) + [FARTHEST] * 2
    found = minimize(_loss, start, args=(x, done), jac=True, method="L-BFGS-B", bounds=bounds)
    centres, widths, rest, leak = _split(found.x, len(names))
    rises = {
        name: Rise(float(unit), float(centre), float(width))
        for name, centre, width, unit in zip(names, centres, widths, units, strict=True)
    }
    return ProbabilityModel(rises, rest, float(expit(leak)))


def _fitted(samples: Sequence[Sample]) -> tuple[list[str], Float[np.ndarray, " k"]]:
    """The checks whose curves can be fitted, and the units of their margins: the 25th percentile.

    A margin that is much the same in nearly all runs tells nothing of where chances change.
    """
    every = sorted({name for sample in samples for name in sample.margins})
    margins = _table(samples, every)
    names, units = [], []
    for name, column in zip(every, margins.T, strict=True):
        known = column[np.isfinite(column)]
        if len(known) < LEAST_SAMPLES:
            continue
        low, high = np.percentile(known, [10.0, 90.0])
        if high - low > LEAST_SPREAD * max(abs(low), abs(high)):
            names.append(name)
            sizes = np.abs(known[known != 0.0])
            units.append(float(np.percentile(sizes, 25.0)))
    return names, np.array(units)


def _table(samples: Sequence[Sample], names: Sequence[str]) -> Float[np.ndarray, "n k"]:
    return np.array([[s.margins.get(name, np.nan) for name in names] for s in samples])


def _split(
    parameters: Float[np.ndarray, " p"], k: int
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"], float, float]:
    """Centres, widths, log odds of the rest and of the leak."""
    rest, leak = parameters[2 * k :].tolist()
    return parameters[:k], np.exp(parameters[k : 2 * k]), rest, leak


def _loss(
    parameters: Float[np.ndarray, " p"], x: Float[np.ndarray, "n k"], done: Bool[np.ndarray, " n"]
) -> tuple[float, Float[np.ndarray, " p"]]:
    """The negative log posterior and its gradient.

    With z = (x - c) / w, Q = prod s(z), R = e + (1 - e) Q and L = log P = log s(b) + log R:
    d log s(z) / dz = s(-z), d log R / d log Q = (1 - e) Q / R, and for a run that failed
    d log(1 - P) / dL = -P / (1 - P).
    """
    k = x.shape[1]
    centres, widths, rest, leak = _split(parameters, k)
    is_seen = np.isfinite(x)
    z = np.where(is_seen, (np.nan_to_num(x) - centres) / widths, 0.0)
    log_q = np.where(is_seen, log_expit(z), 0.0).sum(axis=1) + log_expit(-leak)
    log_r = np.logaddexp(log_expit(leak), log_q)
    log_p = np.minimum(log_expit(rest) + log_r, -_LEAST)
    p = np.exp(log_p)
    likelihood = np.where(done, log_p, np.log1p(-p)).sum()
    pull = np.where(done, 1.0, -p / (1.0 - p))  # d likelihood / d log p
    share = np.exp(log_q - log_r)  # of the product in R; the leak has the rest
    slope = (pull * share)[:, None] * np.where(is_seen, expit(-z), 0.0)
    d_centre = -(slope / widths).sum(axis=0)
    d_width = -(slope * z).sum(axis=0)  # of the logarithm of the width
    d_rest = float((pull * expit(-rest)).sum())
    d_leak = float((pull * ((1.0 - share) * expit(-leak) - share * expit(leak))).sum())
    gradient = -np.concatenate([d_centre, d_width, [d_rest, d_leak]])
    # How far each is from its prior, over the spread of that.
    spreads = np.repeat([CENTRE_SPREAD, WIDTH_SPREAD, REST_SPREAD, LEAK_SPREAD], [k, k, 1, 1])
    usual = np.repeat([0.0, np.log(USUAL_WIDTH), 0.0, USUAL_LEAK], [k, k, 1, 1])
    away = (parameters - usual) / spreads
    return 0.5 * float(away @ away) - float(likelihood), gradient + away / spreads


Bins = tuple[tuple[float, float, int], ...]
"""Of each bin that holds any: mean chance, share done, runs."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """How well chances foretell outcomes."""

    error: float  #: expected calibration error in 10 bins of equal width (Naeini et al., AAAI 2015)
    error_interval: tuple[float, float]  #: of 95 %, by resampling motions (bootstrap)
    brier: float  #: mean squared difference of chance and outcome (Brier, 1950)
    brier_of_base_rate: float  #: the same of one who always says the share of motions done
    bins: Bins


def calibration(
    chances: Float[np.ndarray, " n"], done: Bool[np.ndarray, " n"], motions: Sequence[str]
) -> Calibration:
    """Compare chances with outcomes; runs of one motion are resampled together."""
    rng = np.random.default_rng(0)
    names, owner = np.unique(np.array(motions), return_inverse=True)
    rows = [np.flatnonzero(owner == number) for number in range(len(names))]
    errors = []
    for _ in range(RESAMPLES):
        drawn = np.concatenate([rows[i] for i in rng.integers(len(rows), size=len(rows))])
        errors.append(_error(_bins(chances[drawn], done[drawn])))
    low, high = np.percentile(errors, [2.5, 97.5]).tolist()
    rate, bins = float(done.mean()), _bins(chances, done)
    brier = float(((chances - done) ** 2).mean())
    return Calibration(_error(bins), (low, high), brier, rate * (1.0 - rate), bins)


def _bins(chances: Float[np.ndarray, " n"], done: Bool[np.ndarray, " n"]) -> Bins:
    number: Int[np.ndarray, " n"] = np.minimum((chances * BINS).astype(int), BINS - 1)
    groups = (number == index for index in np.unique(number))
    return tuple((float(chances[g].mean()), float(done[g].mean()), int(g.sum())) for g in groups)


def _error(bins: Bins) -> float:
    total = sum(count for *_, count in bins)
    return sum(count * abs(chance - share) for chance, share, count in bins) / total
