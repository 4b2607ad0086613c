"""Ranking: ranks, ratios, geometric means and Pareto fronts of plain numbers."""

from collections.abc import Iterable, Mapping
from math import exp, log

SMALLEST = 1e-12
"""Error [rad] below which laws are equally good: about the rounding error of an attitude."""


def ranks(errors: Mapping[str, float | None]) -> dict[str, int]:
    """Rank laws by error, 1 for the smallest. Equal errors share a rank; laws without an error share the last one.

    Args:
        errors: error of each law by name; None if its run did not complete.
    """
    ordered = sorted(error for error in errors.values() if error is not None)
    return {name: len(ordered) + 1 if error is None else ordered.index(error) + 1 for name, error in errors.items()}


def ratios(errors: Mapping[str, float | None]) -> dict[str, float | None]:
    """Divide each error by the smallest one, both at least ``SMALLEST``; None stays None."""
    floored = [max(error, SMALLEST) for error in errors.values() if error is not None]
    return {name: None if error is None else max(error, SMALLEST) / min(floored) for name, error in errors.items()}


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
