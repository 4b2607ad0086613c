"""Zero-order Sugeno inference over the tracking error and its rate, eq. (47): 7 × 3 = 21 rules.

The error has the linguistic values NB, NM, NS, Z, PS, PM, PB and its rate N, Z, P, each a triangular fuzzy set with its
peak evenly spaced over [−1, 1] and its feet on the neighbouring peaks; beyond ±1 the outermost set holds fully. The AND
of a rule is the product. Neighbouring triangles add up to one, so the firing strengths of all 21 rules do as well: they
are the normalised ζ of eq. (47) as they stand, and at most four of them are not zero.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

ERROR_VALUES = ("NB", "NM", "NS", "Z", "PS", "PM", "PB")
RATE_VALUES = ("N", "Z", "P")


class Membership(NamedTuple):
    """Where a number lies among triangular sets: between ``lower`` and the next.

    Its degree is ``upper`` in the latter, 1 − ``upper`` in the former, and 0 in every other set.
    """

    lower: int
    upper: float


def fuzzify(x: float, sets: int) -> Membership:
    """Degrees of membership of x in ``sets`` evenly spaced triangular sets over [−1, 1]."""
    position = 0.5 * (min(1.0, max(-1.0, x)) + 1.0) * (sets - 1)
    lower = min(int(position), sets - 2)
    return Membership(lower, position - lower)


def sugeno(error: float, rate: float, weights: npt.NDArray[np.float64]) -> float:
    """α = Σ θ ζ(e, ė), eq. (47): the mean of the rule weights, weighted by the firing strengths of the rules.

    Args:
        error: e divided by its scale.
        rate: ė divided by its scale.
        weights: θ, 7 × 3, by the linguistic values of error and rate. α lies between their smallest and largest.
    """
    i, e = fuzzify(error, 7)
    j, r = fuzzify(rate, 3)
    low = (1.0 - r) * weights[i, j] + r * weights[i, j + 1]
    high = (1.0 - r) * weights[i + 1, j] + r * weights[i + 1, j + 1]
    alpha: float = (1.0 - e) * low + e * high
    return alpha
