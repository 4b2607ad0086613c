"""Ranking: errors, ratios to the best law, medians with intervals, ranks and Pareto fronts of plain numbers.

A run is judged by its attitude error and its tip error together, since each alone can hide a bad law: a tip on the spin
axis stays where it is while the wrist spins. The combined error of a run is the geometric mean of the two, of which
only ratios matter; the unit drops out. A run that was lost has an infinite error, so that it is never better than one
that was not, and never left out.
"""

from collections.abc import Iterable, Mapping, Sequence
from math import exp, inf, log, sqrt
from typing import NamedTuple

import numpy as np

from spherical_wrist.arrays import Array

SMALLEST = 1e-12
"""Error [rad] below which laws are equally good: about the rounding error of an attitude."""
SMALLEST_TIP = 1e-9
"""Tip error [mm] below which laws are equally good: that of ``SMALLEST`` at a lever of a metre."""
CLOSE = 1.05
"""Ratio to the best law up to which a law counts as within 5 % of it."""
RESAMPLES = 1000
"""Number of resamples of a bootstrap."""


class RatioInterval(NamedTuple):
    """Interval of a figure; infinite where runs were lost."""

    low: float
    high: float


def combined_error(attitude: float | None, tip: float | None) -> float:
    """Compute √(|e| · d) of an attitude error e [rad] and a tip error d [mm]; infinity where one is missing."""
    if attitude is None or tip is None:
        return inf
    return sqrt(max(attitude, SMALLEST) * max(tip, SMALLEST_TIP))


def ratios(errors: Mapping[str, float]) -> dict[str, float]:
    """Divide each error by the smallest one; the ratio of an infinite error is infinite."""
    smallest = min(errors.values())
    return {name: error if error == inf else error / smallest for name, error in errors.items()}


def ranks(errors: Mapping[str, float]) -> dict[str, int]:
    """Rank laws by error, 1 for the smallest. Equal errors share a rank; so do all infinite ones, the last."""
    ordered = sorted(errors.values())
    return {name: ordered.index(error) + 1 for name, error in errors.items()}


def over_seeds(errors: Array) -> Array:
    """Return the error of a case from those of its seeds, along the last axis: the median; infinity if one was lost."""
    medians: Array = np.median(errors, axis=-1)
    return np.where(np.isinf(errors).any(axis=-1), inf, medians)


def median_intervals(cases: Sequence[Array], share: float = 0.95) -> list[RatioInterval]:
    """Compute an interval of every law's median ratio to the best law, by a percentile bootstrap in two stages.

    The cases are drawn with replacement, and then the seeds of each drawn case, the same for all laws: the interval
    says how far the median depends on the choice of the cases and on chance. It says nothing about cases of another
    kind than those of the suite. With three seeds, the second stage is coarse. The draws are the same every time.

    Args:
        cases: errors of each case, (laws, seeds); infinite for a lost run.
        share: probability that the interval covers.

    Returns:
        Interval of each law.
    """
    random = np.random.default_rng(0)
    relative = np.empty((RESAMPLES, len(cases), len(cases[0])))  # of a case, with its seeds drawn anew
    for number, errors in enumerate(cases):
        drawn = random.integers(errors.shape[1], size=(RESAMPLES, errors.shape[1]))
        of_case = over_seeds(errors[:, drawn]).T
        smallest = of_case.min(axis=1, keepdims=True)
        relative[:, number] = np.where(np.isinf(of_case), inf, of_case / np.where(np.isinf(smallest), 1.0, smallest))
    chosen = random.integers(len(cases), size=(RESAMPLES, len(cases)))
    medians = np.median(relative[np.arange(RESAMPLES)[:, None], chosen], axis=1)
    tail = 50.0 * (1.0 - share)
    low, high = np.percentile(medians, [tail, 100.0 - tail], axis=0, method="nearest")  # no arithmetic with infinity
    return [RatioInterval(float(a), float(b)) for a, b in zip(low, high, strict=True)]


def geometric_mean(values: Iterable[float]) -> float | None:
    """Compute (∏ x_i)^(1/n) of positive numbers; None for no numbers."""
    logarithms = [log(value) for value in values]
    return exp(sum(logarithms) / len(logarithms)) if logarithms else None


def pareto_front(points: Mapping[str, tuple[float, float]]) -> list[str]:
    """Return the names of the points on the Pareto front, sorted by the first coordinate.

    A point is dominated by one that is no larger in both coordinates and smaller in one of them; equal points do not
    dominate each other.
    """
    front: list[str] = []
    lowest = float("inf")
    for name, (x, y) in sorted(points.items(), key=lambda item: item[1]):
        if y < lowest or (front and (x, y) == points[front[-1]]):
            front.append(name)
            lowest = y
    return front
