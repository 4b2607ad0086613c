"""Distribution-free confidence intervals.

They hold for independent samples. Points of a Sobol sequence or a Latin hypercube are spread more evenly than that,
which makes the estimates better and the intervals wider than need be.
"""

from math import atanh, sqrt, tanh
from typing import NamedTuple

from scipy import stats

CONFIDENCE = 0.95


class Ranks(NamedTuple):
    """Order statistics, counted from 1, of a quantile and of the ends of its interval; None for an open end."""

    value: int
    low: int | None
    high: int | None


class Estimate(NamedTuple):
    """An estimate and its interval; None where there is none."""

    value: float | None
    low: float | None
    high: float | None


NOTHING = Estimate(None, None, None)


def quantile_ranks(probability: float, count: int) -> Ranks:
    """The order statistics x_(l) and x_(u) between which the quantile ξ_p lies, with the confidence or a little more.

    The number of samples below ξ_p is binomial, so P(x_(l) ≤ ξ_p) = P(B ≥ l) and P(ξ_p ≤ x_(u)) = P(B ≤ u − 1), with B
    of ``count`` trials and probability p (David and Nagaraja, Order Statistics, 2003, section 7.1). The quantile itself
    is the smallest x_(k) with k ≥ p n.

    Args:
        probability: p in (0, 1).
        count: number of samples n ≥ 1.
    """
    below = stats.binom(count, probability)
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = int(below.ppf(tail)), int(below.ppf(1.0 - tail)) + 1
    value = min(max(int(-(-probability * count // 1)), 1), count)
    return Ranks(value, low if low >= 1 else None, high if high <= count else None)


def wilson(hits: int, count: int) -> Estimate:
    """A share and its interval after Wilson (1927); nothing of no trials."""
    if not count:
        return NOTHING
    low, high = stats.binomtest(hits, count).proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(hits / count, float(low), float(high))


def above_worst(count: int) -> float:
    """The largest share of all that can, with the confidence, be worse than the worst of ``count`` samples.

    Where a share s of all is worse, none of n samples is with probability (1 − s)^n (Wilks, 1941).
    """
    return float(1.0 - (1.0 - CONFIDENCE) ** (1.0 / count))


class Correlation(NamedTuple):
    """A rank correlation, its interval, and the probability of one as far from zero between independent variables."""

    value: float
    low: float
    high: float
    p: float


def rank_correlation(rho: float, count: int) -> Correlation | None:
    """Return Spearman's ρ of so many pairs with its interval; nothing of fewer than four.

    The interval is symmetric in atanh ρ, with the variance (1 + ρ²/2)/(n − 3) of Bonett and Wright (2000); p is that of
    Student's t with n − 2 degrees of freedom for ρ √((n − 2)/(1 − ρ²)), as in ``scipy.stats.spearmanr``.

    Args:
        rho: correlation of the ranks.
        count: number of pairs n.
    """
    if count < 4:
        return None
    if abs(rho) >= 1.0:
        return Correlation(rho, rho, rho, 0.0)
    half = float(stats.norm.ppf(0.5 * (1.0 + CONFIDENCE))) * sqrt((1.0 + 0.5 * rho * rho) / (count - 3))
    p = 2.0 * float(stats.t.sf(abs(rho) * sqrt((count - 2) / (1.0 - rho * rho)), count - 2))
    return Correlation(rho, tanh(atanh(rho) - half), tanh(atanh(rho) + half), p)
