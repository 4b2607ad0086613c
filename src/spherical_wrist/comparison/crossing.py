"""The first value of a growing parameter at which something no longer holds: an expanding grid, then bisection."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from spherical_wrist.errors import ParameterError


class Found(StrEnum):
    """What a search came to."""

    CROSSING = "crossing"
    NEVER = "never within the limit"
    NOMINAL = "misses already at the nominal"


class Crossing(NamedTuple):
    """Where something stops to hold.

    Attributes:
        found: what the search came to.
        holds: the largest deviation that was tested below the first miss; None where the nominal misses.
        misses: the smallest deviation that was seen to miss; 0 for the nominal, None where none was.
        tested: every deviation that was tested, in that order.
    """

    found: Found
    holds: float | None
    misses: float | None
    tested: tuple[float, ...]


def first_crossing(
    holds: Callable[[float], bool], first: float, limit: float, tolerance: float = 0.02, growth: float = 3.0
) -> Crossing:
    """Looks for the first deviation from the nominal at which ``holds`` is false.

    The deviations 0, ``first``, ``first · growth``, ``first · growth²``, … up to and with ``limit`` are tested in this
    order until one misses; between that one and the one before, bisection goes on until the two sides are within
    ``tolerance`` of each other, relative to the larger one, or to ``first`` where that is larger.

    Nothing is assumed to be monotonic. What is guaranteed: ``misses`` did miss, ``holds`` did hold, no tested value
    below ``holds`` missed, and the two are as near as said. A miss between two neighbours that both held goes unseen:
    at a ``growth`` nearer to 1 less can.

    Args:
        holds: whether all is well at a deviation ≥ 0.
        first: first deviation of the grid, more than 0.
        limit: largest deviation, at least ``first``.
        tolerance: of the bisection, between 0 and 1.
        growth: from one deviation of the grid to the next, more than 1.

    Raises:
        ParameterError: these bounds do not hold.
    """
    if not (0.0 < first <= limit and 0.0 < tolerance < 1.0 and growth > 1.0):
        raise ParameterError(
            f"search from {first:g} to {limit:g} in factors of {growth:g} to a tolerance of {tolerance:g}: "
            "0 < first ≤ limit, growth > 1 and 0 < tolerance < 1 are needed"
        )
    tested: list[float] = []

    def good(deviation: float) -> bool:
        tested.append(deviation)
        return holds(deviation)

    if not good(0.0):
        return Crossing(Found.NOMINAL, None, 0.0, tuple(tested))
    low, high = 0.0, first
    while good(high):
        if high >= limit:
            return Crossing(Found.NEVER, high, None, tuple(tested))
        low, high = high, min(high * growth, limit)
    while high - low > tolerance * max(high, first):
        middle = 0.5 * (low + high)
        if good(middle):
            low = middle
        else:
            high = middle
    return Crossing(Found.CROSSING, low, high, tuple(tested))
