"""Dependence of an error on parameters, from samples that exist: first-order Sobol indices and rank correlations."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from spherical_wrist.arrays import Array
from spherical_wrist.campaign.store import Column
from spherical_wrist.report.intervals import CONFIDENCE, NOTHING, Correlation, Estimate, rank_correlation
from spherical_wrist.report.table import Table, quoted

MOST_BINS, BLOCKS = 64, 20
"""Bins at most, and blocks of samples that are left out in turn."""
FEWEST, REPEATED = 32, 4
"""Episodes below which nothing is said, and how often values that can be counted must come to be bins of their own."""
EVEN = ("grid", "sobol")
"""Designs in which, in each bin of a parameter, the other ones take all of their values alike."""
SMALLEST = 1e-12
"""Error [rad] below which differences do not count: about the rounding of an attitude."""


class Sensitivity(NamedTuple):
    """Influence of a parameter on the error of a law.

    Attributes:
        parameter: its name.
        sobol: share of the variance of log₁₀ of the error that the parameter explains by itself.
        spearman: rank correlation with the error; None of text, and where the parameter or the error is constant.
        episodes: how many the index is from: those that completed.
    """

    parameter: str
    sobol: Estimate
    spearman: Correlation | None
    episodes: int


def sensitivity(table: Table, law: str, column: Column, design: str) -> Sensitivity:
    """Compute the influence of a parameter on the error of a law.

    Args:
        table: the episodes.
        law: its label.
        column: the parameter.
        design: of the campaign. Of a grid, whose points are no draws, there are no intervals.
    """
    sums, episodes = _sums(table, law, column)
    sobol = NOTHING if sums is None else first_order(sums, even=design in EVEN)
    if design == "grid":
        sobol = sobol._replace(low=None, high=None)
    return Sensitivity(column.name, sobol, _spearman(table, law, column), episodes)


def first_order(sums: Array, *, even: bool = False) -> Estimate:
    """The first-order Sobol index Var(E[y | x]) / Var(y), from sums over the samples in each bin of x and each block.

    With bins of x, Var(E[y | x]) is the variance between them (a given-data estimator; Plischke, Borgonovo and Smith,
    2013). That is Pearson's correlation ratio η². Of random samples it is too large, because the means of bins differ
    by chance; Kelley's (1935) ε² has no such bias: 1 − ε² = (1 − η²)(n − 1)/(n − m) for n samples in m bins. The
    interval is from leaving out one block of samples in turn (the jackknife), with Student's t of as many degrees of
    freedom as there are blocks, less one.

    Args:
        sums: number of samples, Σ y and Σ y², of shape blocks × bins × 3; y best with a mean near zero.
        even: the samples are spread so that means of bins do not differ by chance: η² itself.

    Returns:
        The index; nothing where y does not vary.
    """
    whole = _index(sums.sum(axis=0), even)
    if whole is None:
        return NOTHING
    total = sums.sum(axis=0)
    left_out = [_index(total - block, even) for block in sums if block[:, 0].any()]
    values = np.array([value for value in left_out if value is not None])
    count = len(values)
    if count < 2:
        return Estimate(whole, None, None)
    error = np.sqrt((count - 1) / count * np.square(values - values.mean()).sum())
    half = float(stats.t.ppf(0.5 * (1.0 + CONFIDENCE), count - 1) * error)
    return Estimate(whole, max(whole - half, 0.0), min(whole + half, 1.0))


def _index(sums: Array, even: bool) -> float | None:
    count, first, second = sums[sums[:, 0] > 0].T
    n, m = count.sum(), len(count)
    spread = second.sum() - first.sum() ** 2 / n
    if m < 2 or n <= m or spread <= 0.0:
        return None
    between = (np.square(first) / count).sum() - first.sum() ** 2 / n
    unexplained = max(1.0 - between / spread, 0.0)
    if not even:
        unexplained *= (n - 1.0) / (n - m)
    return float(min(max(1.0 - unexplained, 0.0), 1.0))


def _sums(table: Table, law: str, column: Column) -> tuple[Array | None, int]:
    """Sums of y = log₁₀(error) less its mean by block and bin, and the number of episodes."""
    name, log = quoted(column.name), f"log10(greatest(error, {SMALLEST}))"
    ((count, different, mean, first, last),) = table.rows(
        f"SELECT count(*), count(DISTINCT {name}), avg({log}), min(sample), max(sample) "
        "FROM measured WHERE law = ? AND outcome = 'completed'",
        law,
    )
    if count < FEWEST or different < 2:
        return None, count
    few = different <= MOST_BINS and different * REPEATED <= count
    # many enough to follow a curve, few enough to have many samples in each
    bins = different if few else min(MOST_BINS, int(1.2 * count**0.4))
    place = (
        f"dense_rank() OVER (ORDER BY {name}) - 1"
        if few
        else f"(rank() OVER (ORDER BY {name}) - 1) * {bins} // {count}"
    )
    rows = table.rows(
        f"WITH placed AS (SELECT {log} - ? AS y, {place} AS bin, (sample - ?) * {BLOCKS} // ? AS block "
        "FROM measured WHERE law = ? AND outcome = 'completed') "
        "SELECT block, bin, count(*), sum(y), sum(y * y) FROM placed GROUP BY block, bin",
        mean,
        first,
        last - first + 1,
        law,
    )
    return _filled(rows, bins), count


def _filled(rows: Sequence[tuple[Any, ...]], bins: int) -> Array:
    sums = np.zeros((BLOCKS, bins, 3))
    for block, place, *figures in rows:
        sums[int(block), int(place)] = figures
    return sums


def _spearman(table: Table, law: str, column: Column) -> Correlation | None:
    """From ranks that equal values share; a run that did not complete has the largest error."""
    if column.kind in ("text", "table"):
        return None
    ranks = ", ".join(
        f"rank() OVER (ORDER BY {each}) + (count(*) OVER (PARTITION BY {each}) - 1) / 2e0 AS {alias}"
        for each, alias in ((quoted(column.name), "x"), ("error", "y"))
    )
    ((rho, count),) = table.rows(
        f"WITH ranks AS (SELECT {ranks} FROM measured WHERE law = ?) SELECT corr(x, y), count(*) FROM ranks", law
    )
    return None if rho is None or np.isnan(rho) else rank_correlation(float(rho), count)
