"""Timing for the benchmarks, interleaved within one process."""

import statistics
import time
from collections.abc import Callable


def interleaved(tasks: dict[str, Callable[[], float]], repetitions: int) -> dict[str, list[float]]:
    """Run tasks in turn, each of which returns its own time. The first round is a warm-up."""
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for repetition in range(repetitions + 1):
        for name, task in tasks.items():
            elapsed = task()
            if repetition:
                times[name].append(elapsed)
    return times


def ratio(times: dict[str, list[float]], a: str, b: str) -> float:
    """Compute the median over repetitions of the ratio a/b."""
    return statistics.median(x / y for x, y in zip(times[a], times[b], strict=True))


def timed(function: Callable[[], object]) -> float:
    """Return the wall time of one call [s]."""
    began = time.perf_counter()
    function()
    return time.perf_counter() - began
