"""Fast path of eq. (47), in scalars for the compiled loop: Sugeno inference of order zero over evenly spaced sets.

Two inputs each have triangular sets with their peaks evenly spaced over [−1, 1] and their feet on the neighbouring
peaks; beyond ±1 the outermost set holds fully. The AND of a rule is the product. Neighbouring triangles add up to one,
so the firing strengths of all rules do as well: they are the normalised ζ of eq. (47) as they stand, at most four of
them are not zero, and the inference is the bilinear interpolation between the rule weights at the peaks.

The paper's 7 × 3 rules are the smallest use of it. Any other inference runs in the compiled loop as a table of its
values at many more peaks: see :mod:`spherical_wrist.fuzzy.table`.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Place(NamedTuple):
    """Position of a number among triangular sets: between ``lower`` and the next.

    Its degree is ``upper`` in the latter, 1 − ``upper`` in the former, and 0 in every other set.
    """

    lower: int
    upper: float


def fuzzify(x: float, sets: int) -> Place:
    """Find the degrees of membership of x in ``sets`` evenly spaced triangular sets over [−1, 1]."""
    position = 0.5 * (min(1.0, max(-1.0, x)) + 1.0) * (sets - 1)
    lower = min(int(position), sets - 2)
    return Place(lower, position - lower)


def sugeno(error: float, rate: float, weights: npt.NDArray[np.float64]) -> float:
    """Compute α = Σ θ ζ(e, ė), eq. (47): the mean of the rule weights, weighted by the firing strengths of the rules.

    Args:
        error: e divided by its scale.
        rate: ė divided by its scale.
        weights: θ, n × m ≥ 2 × 2, by the sets of error and rate. α lies between their smallest and largest.
    """
    i, e = fuzzify(error, weights.shape[0])
    j, r = fuzzify(rate, weights.shape[1])
    low = (1.0 - r) * weights[i, j] + r * weights[i, j + 1]
    high = (1.0 - r) * weights[i + 1, j] + r * weights[i + 1, j + 1]
    alpha: float = (1.0 - e) * low + e * high
    return alpha
