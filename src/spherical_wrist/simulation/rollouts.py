"""Rollouts of experiments: prepare, run chunk by chunk, compute the metrics."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.errors import as_exception
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.loop import Progress
from spherical_wrist.loop.outcome import Outcome, Status, StoppedError
from spherical_wrist.loop.rollout import Rollout, compiled_run_all, run_chunk
from spherical_wrist.measure.logged import Logged
from spherical_wrist.measure.metrics import Metrics, MetricSettings
from spherical_wrist.measure.warnings import warnings_of, without_repeats
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.closed_loop import CHUNK, MAX_STEPS, ClosedLoop, prepare
from spherical_wrist.simulation.metric_accumulator import MetricAccumulator
from spherical_wrist.simulation.verdict import Verdict, verdict
from spherical_wrist.stages import stage


class RolloutResult(NamedTuple):
    """Result of a run without its series.

    Attributes:
        outcome: outcome of the run.
        metrics: metrics of the run.
        measurement: settings of the metrics.
        wall_time: wall time of the simulation, without preparation and compilation [s].
        warnings: sentences about what makes the figures doubtful; see :mod:`spherical_wrist.measure.warnings`.
    """

    outcome: Outcome
    metrics: Metrics
    measurement: MetricSettings
    wall_time: float
    warnings: tuple[str, ...]

    @property
    def verdict(self) -> Verdict:
        """Verdict on the run: the sentence with which a summary begins."""
        return verdict(self.outcome, self.metrics, self.measurement, self.warnings)


def _discard(loop: ClosedLoop, logged: Logged) -> None:
    """Discard the log."""


def roll_out(
    makers: Sequence[Callable[[], Experiment]],
    cache: RunCache,
    *,
    stop: Callable[[], bool] = lambda: False,
    keep: Callable[[ClosedLoop, Logged], None] = _discard,
    chunk: int = CHUNK,
) -> list[RolloutResult | Exception]:
    """Run experiments to their end, and compute their metrics. The results are bit for bit those of separate runs.

    All experiments are prepared before the first one runs, which is faster: a run evicts from the processor's caches
    what the next preparation needs, and the thread waits for Python's lock only once.

    Args:
        makers: functions that create the experiments, at most ``SLOTS``.
        cache: cache of this thread.
        stop: polled a few times a second; returns True to stop. Unfinished runs then end as ``interrupted``.
        keep: called with the loop and each chunk of its log; only for a single experiment.
        chunk: number of control periods per chunk; the results do not depend on it.

    Returns:
        Result of each experiment, or the exception that creating, preparing or running it raised.
    """
    with warnings_kept_in_data():
        with _preparation_turn(), stage(f"prepared {len(makers)} run{'s' * (len(makers) > 1)}"):
            runs = [_Run(make, cache, slot, stop) for slot, make in enumerate(makers)]
            rollouts = _rollouts(runs, chunk)
        if cache.engine.compiled:
            compiled_run_all()  # before time is taken
        while rollouts:
            if stop():
                for run in rollouts:
                    run.add_warnings()
                break
            began = time.perf_counter()
            done = run_chunk(list(rollouts.values()), cache.engine, cache.log(_longest(rollouts)))
            elapsed = time.perf_counter() - began
            with _preparation_turn():
                for index, (run, progress) in enumerate(zip(rollouts, done.progress, strict=True)):
                    run.update(progress, done.faults.get(index), elapsed)
                    if done.logged is not None and run.loop is not None and run.fault is None:
                        keep(run.loop, done.logged)
                rollouts = _rollouts(runs, chunk)
    return [run.result() for run in runs]


class _Run:
    """Run of one experiment on a slot of a cache. It stores the exception of a failure."""

    def __init__(self, make: Callable[[], Experiment], cache: RunCache, slot: int, stop: Callable[[], bool]) -> None:
        self.loop: ClosedLoop | None = None
        self.fault: Exception | None = None
        self._wall_time, self._period = 0.0, 0.0
        self._metrics: MetricAccumulator | None = None
        try:
            experiment = make()
            self._measurement = experiment.measurement(cache.wrist(experiment.wrist_file))
            self._metrics = MetricAccumulator(self._measurement, cache.engine)
            self._period = experiment.control_period
            self.loop = prepare(experiment, cache, stop=stop, slot=slot)
        except StoppedError:
            pass
        except BaseException as error:  # a user's code may raise anything
            self.fault = as_exception(error)

    @property
    def running(self) -> bool:
        return self.loop is not None and self.fault is None and self.loop.outcome is None

    def next_rollout(self, chunk: int, steps: int) -> Rollout | None:
        """Return the next inputs with the arguments of the loop; None if sampling them raises, which ends the run."""
        assert self.loop is not None
        assert self._metrics is not None
        try:
            inputs = self.loop.next_inputs(chunk, steps)
        except BaseException as error:  # a user's code may raise anything
            self._end(as_exception(error))
            return None
        return Rollout(self.loop.parts, inputs, self._metrics.settings, self._metrics.totals, self.loop.widths)

    def update(self, progress: Progress, fault: Exception | None, elapsed: float) -> None:
        """Add the progress of one chunk, and the exception that its law raised."""
        assert self.loop is not None
        self._wall_time += elapsed
        try:
            self.loop.record_progress(*progress, fault)
        except BaseException as error:  # a user's code may raise anything
            self.fault = as_exception(error)
        if self.loop.outcome is not None:
            self.add_warnings()

    def _end(self, error: Exception) -> None:
        """End the run as failed, or with an error if it has not begun."""
        assert self.loop is not None
        try:
            self.loop.fail(error)
        except Exception as fault:
            self.fault = fault
        else:
            self.add_warnings()

    def add_warnings(self) -> None:
        """Add the warnings that follow from the metrics of a finished run to those of its loop."""
        assert self.loop is not None
        assert self._metrics is not None
        self.loop.warnings += self.loop.measured_warnings()
        lost = self.loop.outcome is not None and self.loop.outcome.status.lost
        if lost or self._metrics.totals["saturated"]["summed"][0] > 0.0:
            self.loop.warnings += self.loop.reach_warnings()

    def result(self) -> RolloutResult | Exception:
        if self.fault is not None:
            return self.fault
        assert self._metrics is not None
        samples = 0 if self.loop is None else self.loop.sample
        interrupted = Outcome(Status.INTERRUPTED, samples * self._period, "stopped on request")
        outcome = None if self.loop is None else self.loop.outcome
        metrics, prepared = self._metrics.result(), () if self.loop is None else self.loop.warnings
        warnings = without_repeats((*prepared, *warnings_of(metrics)))
        return RolloutResult(outcome or interrupted, metrics, self._measurement, self._wall_time, warnings)


def _rollouts(runs: Sequence[_Run], chunk: int) -> dict[_Run, Rollout]:
    """Sample the next inputs of every run that has not ended."""
    running = [run for run in runs if run.running]
    steps = MAX_STEPS // max(len(running), 1)  # together as many as a single run, so that ``stop`` is polled as often
    rollouts = {run: run.next_rollout(chunk, steps) for run in running}
    return {run: rollout for run, rollout in rollouts.items() if rollout is not None}


def _longest(rollouts: dict[_Run, Rollout]) -> int:
    return max(len(rollout.inputs.time) for rollout in rollouts.values())


_preparing = threading.Lock()
TURN_TIMEOUT = 0.02
"""Longest time [s] that a thread waits for others to prepare: twice the usual time of a preparation.

Two threads that prepare at the same time slow each other down by passing Python's lock to and fro, finish at the same
time, and do so again after every chunk. Slow disturbances are sampled in NumPy without that lock, so that a longer
wait does not help.
"""


@contextmanager
def _preparation_turn() -> Iterator[None]:
    """Let one thread prepare at a time, unless the wait is too long."""
    acquired = _preparing.acquire(timeout=TURN_TIMEOUT)
    try:
        yield
    finally:
        if acquired:
            _preparing.release()
