"""Search for the smallest deviation at which a condition fails: an expanding grid, then bisection."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from spherical_wrist.errors import ParameterError


class CrossingStatus(StrEnum):
    """Result of a search for a crossing."""

    CROSSING = "crossing"
    NEVER = "never within the limit"
    NOMINAL = "misses already at the nominal"


class Crossing(NamedTuple):
    """First crossing from deviations that hold the condition to one that misses it.

    Attributes:
        status: result of the search.
        holds: largest tested deviation below the first miss; None if the nominal misses.
        misses: smallest deviation that missed; 0 for the nominal, None if none missed.
        tested: all tested deviations, in order of the tests.
    """

    status: CrossingStatus
    holds: float | None
    misses: float | None
    tested: tuple[float, ...]


def first_crossing(
    holds: Callable[[float], bool], first: float, limit: float, tolerance: float = 0.02, growth: float = 3.0
) -> Crossing:
    """Search for the first deviation from the nominal at which ``holds`` is false.

    The deviations 0, ``first``, ``first · growth``, ``first · growth²``, …, ``limit`` are tested in this order, until
    one misses. Bisection between it and the one before follows, until the two differ by at most ``tolerance``, relative
    to the larger one, or to ``first`` if that is larger.

    The condition need not be monotonic. Guaranteed are: ``misses`` missed, ``holds`` held, no tested value below
    ``holds`` missed, and the two differ by at most the tolerance. A miss between two neighbours of the grid that both
    hold is not found; a ``growth`` closer to 1 makes this less likely.

    Args:
        holds: condition at a deviation ≥ 0.
        first: first deviation of the grid, greater than 0.
        limit: largest deviation, at least ``first``.
        tolerance: relative tolerance of the bisection, between 0 and 1.
        growth: ratio of neighbouring deviations of the grid, greater than 1.

    Raises:
        ParameterError: an argument is out of these ranges.
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
        return Crossing(CrossingStatus.NOMINAL, None, 0.0, tuple(tested))
    low, high = 0.0, first
    while good(high):
        if high >= limit:
            return Crossing(CrossingStatus.NEVER, high, None, tuple(tested))
        low, high = high, min(high * growth, limit)
    while high - low > tolerance * max(high, first):
        middle = 0.5 * (low + high)
        if good(middle):
            low = middle
        else:
            high = middle
    return Crossing(CrossingStatus.CROSSING, low, high, tuple(tested))
