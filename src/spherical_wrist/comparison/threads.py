"""Many runs at a time, on threads: the compiled loop does not hold Python's lock."""

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from typing import TypeVar

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.run import Run
from spherical_wrist.experiment.simulate import simulate
from spherical_wrist.simulation.outcome import Status

Item = TypeVar("Item")
Result = TypeVar("Result")
Simulate = Callable[[Experiment, bool], Run]
"""Simulates an experiment; keeps the series where the second argument says so."""
Progress = Callable[[int, int], None]
"""Told how many of how many are done, whenever one is."""


def cores() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_threads(
    work: Callable[[Item, Simulate], Result],
    items: Sequence[Item],
    jobs: int | None = None,
    progress: Progress = lambda done, total: None,
) -> list[Result]:
    """Does the work for every item, several at a time, and returns the results in the order of the items.

    The results do not depend on the number of threads. Where one item fails, or the caller is interrupted (Ctrl-C),
    what is running is stopped within milliseconds, what is waiting is dropped, and the exception goes on.

    Args:
        work: takes an item, and a function that simulates and that an interruption stops.
        items: what is to be done.
        jobs: threads; None for as many as there are cores.
        progress: told what is done, from the calling thread.

    Raises:
        ParameterError: ``jobs`` is less than 1.
    """
    if jobs is not None and jobs < 1:
        raise ParameterError(f"jobs = {jobs}: must be 1 or more")
    halted = threading.Event()

    def stoppable(experiment: Experiment, keep_series: bool) -> Run:
        run = simulate(experiment, keep_series=keep_series, stop=halted.is_set)
        if run.outcome.status is Status.INTERRUPTED:
            raise CancelledError
        return run

    with ThreadPoolExecutor(jobs or cores(), thread_name_prefix="wrist") as pool:
        try:
            futures = [pool.submit(work, item, stoppable) for item in items]
            for done, future in enumerate(as_completed(futures), start=1):
                future.result()
                progress(done, len(futures))
        except BaseException:
            halted.set()
            pool.shutdown(cancel_futures=True)
            raise
    return [future.result() for future in futures]
