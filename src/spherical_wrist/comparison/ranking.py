"""Who is best: ranks, scores and Pareto fronts of plain numbers."""

from collections.abc import Iterable, Mapping
from math import exp, log

SMALLEST = 1e-12
"""Error [rad] below which two laws count as equally good: about the rounding of an attitude."""


def ranks(errors: Mapping[str, float | None]) -> dict[str, int]:
    """The rank of each, 1 for the smallest error; equals share a rank, and those without one share the last.

    Args:
        errors: error of each law by name; None where it has none because its run did not complete.
    """
    found = sorted(error for error in errors.values() if error is not None)
    return {name: len(found) + 1 if error is None else found.index(error) + 1 for name, error in errors.items()}


def ratios(errors: Mapping[str, float | None]) -> dict[str, float | None]:
    """Each error as a multiple of the smallest, both taken as ``SMALLEST`` at least; None stays None."""
    found = [max(error, SMALLEST) for error in errors.values() if error is not None]
    return {name: None if error is None else max(error, SMALLEST) / min(found) for name, error in errors.items()}


def geometric_mean(values: Iterable[float]) -> float | None:
    """(∏ x_i)^(1/n) of positive numbers; None of none."""
    logarithms = [log(value) for value in values]
    return exp(sum(logarithms) / len(logarithms)) if logarithms else None


def pareto_front(points: Mapping[str, tuple[float, float]]) -> list[str]:
    """The names of the points that no other one beats, from the smallest first coordinate to the largest.

    A point is beaten by one that is no larger in both coordinates and smaller in one of them; equal points do not beat
    each other.
    """
    front: list[str] = []
    lowest = float("inf")
    for name, (x, y) in sorted(points.items(), key=lambda item: item[1]):
        if y < lowest or (front and (x, y) == points[front[-1]]):
            front.append(name)
            lowest = y
    return front
