"""Runner of many experiments on threads: scheduling, stopping, progress, errors and order of results.

The compiled loop releases Python's lock, so threads use all cores.
"""

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from typing import NamedTuple, TypeVar

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.outcome import Status
from spherical_wrist.prepare.cache import CachePool, RunCache
from spherical_wrist.simulation.rollouts import RolloutResult, roll_out
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.simulate import simulate
from spherical_wrist.stages import one_of_many

Item = TypeVar("Item")
Result = TypeVar("Result")
Progress = Callable[[int, int], None]
"""Function that is called with the number of finished items and their total whenever an item finishes."""


def ignore_progress(done: int, total: int) -> None:
    """Ignore the progress."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Worker(NamedTuple):
    """Worker of one thread, which runs experiments. Its methods raise CancelledError if the whole work is stopped.

    Attributes:
        cache: cache of the thread.
        stop: function that returns True to stop.
    """

    cache: RunCache
    stop: Callable[[], bool]

    def measure(self, experiment: Experiment) -> RolloutResult:
        """Run an experiment without keeping its series.

        Raises:
            WristError: see :func:`spherical_wrist.simulation.simulate.simulate`.
        """
        [result] = roll_out([lambda: experiment], self.cache, stop=self.stop)
        if isinstance(result, Exception):
            raise result
        return self._finished(result)

    def simulate(self, experiment: Experiment) -> Run:
        """Run an experiment and keep its series.

        Raises:
            WristError: see :func:`spherical_wrist.simulation.simulate.simulate`.
        """
        return self._finished(simulate(experiment, stop=self.stop, cache=self.cache))

    def _finished(self, result: Result) -> Result:
        if result.outcome.status is Status.INTERRUPTED:  # type: ignore[attr-defined]
            raise CancelledError
        return result


class Runner:
    """Runner of many experiments on threads. Results do not depend on the number of threads.

    Args:
        jobs: number of threads; None for the number of cores.
        stop: polled a few times a second; returns True to stop.

    Raises:
        ParameterError: ``jobs`` is less than 1.
    """

    def __init__(self, jobs: int | None = None, stop: Callable[[], bool] = lambda: False) -> None:
        if jobs is not None and jobs < 1:
            raise ParameterError(f"jobs = {jobs}: must be 1 or more")
        self._jobs, self._stop, self._caches = jobs or cores(), stop, CachePool()

    def map(
        self,
        work: Callable[[Item, Worker], Result],
        items: Sequence[Item],
        progress: Progress = ignore_progress,
        name: Callable[[Item], str] = lambda item: "",
    ) -> list[Result]:
        """Do the work for every item, and return the results in the order of the items.

        If an item fails, or the caller is interrupted (Ctrl-C), running work is stopped within milliseconds, waiting
        work is cancelled, and the exception is raised again.

        Args:
            work: function of an item and of a worker that runs experiments.
            items: items of work.
            progress: called from the calling thread whenever an item finishes.
            name: names an item in the log of stages; empty for no line.

        Raises:
            CancelledError: ``stop`` returned True.
        """
        halted = threading.Event()

        def stopping() -> bool:
            return halted.is_set() or self._stop()

        def work_on(item: Item) -> Result:
            with one_of_many(name(item)), self._caches.borrowed() as cache:
                return work(item, Worker(cache, stopping))

        with ThreadPoolExecutor(self._jobs, thread_name_prefix="wrist") as pool:
            try:
                futures = [pool.submit(work_on, item) for item in items]
                for done, future in enumerate(as_completed(futures), start=1):
                    future.result()
                    progress(done, len(futures))
            except BaseException:
                halted.set()
                pool.shutdown(cancel_futures=True)
                raise
        return [future.result() for future in futures]
