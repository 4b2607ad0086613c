"""Many short runs at a time, on threads, each with a workbench that keeps what runs share."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from typing import TypeVar

from spherical_wrist.comparison.threads import Progress, cores
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.measured import Measured, measured
from spherical_wrist.simulation.outcome import Status
from spherical_wrist.simulation.workbench import Workbench

Item = TypeVar("Item")
Result = TypeVar("Result")
Measure = Callable[[Experiment], Measured]


class Benches:
    """Workbenches that threads take and give back.

    Args:
        jobs: threads; None for as many as there are cores.
        stop: asked now and then whether to stop.

    Raises:
        ParameterError: ``jobs`` is less than 1.
    """

    def __init__(self, jobs: int | None = None, stop: Callable[[], bool] = lambda: False) -> None:
        if jobs is not None and jobs < 1:
            raise ParameterError(f"jobs = {jobs}: must be 1 or more")
        self._jobs, self._stop = jobs or cores(), stop
        self._idle: list[Workbench] = []

    def each(
        self,
        work: Callable[[Item, Measure], Result],
        items: Sequence[Item],
        progress: Progress = lambda done, total: None,
    ) -> list[Result]:
        """Does the work for every item and returns the results in the order of the items.

        The results do not depend on the number of threads. Where one item fails, what is running is stopped within
        milliseconds, what is waiting is dropped, and the exception goes on.

        Args:
            work: takes an item, and a function that runs an experiment.
            items: what is to be done.
            progress: told what is done, from the calling thread.

        Raises:
            CancelledError: it was asked to stop.
        """
        halted = threading.Event()

        def stopping() -> bool:
            return halted.is_set() or self._stop()

        def on_a_bench(item: Item) -> Result:
            try:
                bench = self._idle.pop()
            except IndexError:
                bench = Workbench()

            def run(experiment: Experiment) -> Measured:
                try:
                    found = measured(experiment, bench, stop=stopping)
                except WristError:
                    if stopping():  # the peak torque of a motion that was cut short is no size of a disturbance
                        raise CancelledError from None
                    raise
                if found.outcome.status is Status.INTERRUPTED:
                    raise CancelledError
                return found

            try:
                return work(item, run)
            finally:
                self._idle.append(bench)

        with ThreadPoolExecutor(self._jobs, thread_name_prefix="wrist") as pool:
            futures = [pool.submit(on_a_bench, item) for item in items]
            try:
                for done, future in enumerate(as_completed(futures), start=1):
                    future.result()
                    progress(done, len(futures))
            except BaseException:
                halted.set()
                pool.shutdown(cancel_futures=True)
                raise
        return [future.result() for future in futures]
