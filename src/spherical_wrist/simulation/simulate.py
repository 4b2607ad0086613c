"""Simulation of one experiment."""

from collections.abc import Callable
from math import ceil

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.embedded_files import EmbeddedFiles, description_of
from spherical_wrist.loop.engine import interpreted_engine
from spherical_wrist.measure.logged import Logged, channels_of
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.cache import RunCache, thread_cache
from spherical_wrist.prepare.closed_loop import CHUNK, ClosedLoop
from spherical_wrist.simulation.rollouts import roll_out
from spherical_wrist.simulation.run import Run, circumstances
from spherical_wrist.stages import detail

MAX_ROWS = 20_000_000
"""Largest number of rows of a series: about ten gigabytes of memory, 5½ hours at 1 kHz."""

WATCH_CHUNK = 1000
"""Control periods per chunk with ``watch``, a few milliseconds of wall time. Results do not depend on it."""


def simulate(
    experiment: Experiment,
    *,
    record_every: int = 1,
    keep_series: bool = True,
    interpreted: bool = False,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
    watch: Callable[[Series], None] | None = None,
    cache: RunCache | None = None,
) -> Run:
    """Run the closed loop that an experiment describes.

    Simulating disables libmujoco's profiling clock for the whole process: ``MjData.timer`` stays at zero afterwards.

    Args:
        experiment: experiment to run.
        record_every: interval of control instants that are kept in the series; the metrics use all instants.
        keep_series: True to keep the series. Without them, memory does not grow with the duration.
        interpreted: True to run loop and law in plain Python, for a debugger; hundreds of times slower.
        progress: called a few times a second with the simulated time [s].
        stop: polled a few times a second; returns True to stop. The run is then ``interrupted``, and keeps its series.
        watch: called with every chunk of the series as soon as it is simulated; for example ``LiveView.show``.
        cache: cache of models and laws; by default that of this thread.

    Returns:
        The run. Divergence is an outcome, not an exception, as is a law that raises after some time.

    Raises:
        ParameterError: the periods are no multiples of each other, the disturbance has no size, or the series would
            have too many rows.
        ModelError: the MJCF file is not a wrist.
        LawError: the law raises or writes no torque at the start, or cannot be compiled.
    """
    if record_every < 1:
        raise ParameterError(f"record_every = {record_every}: must be 1 or more")
    rows = experiment.duration / experiment.control_period / record_every
    if keep_series and rows > MAX_ROWS:
        raise ParameterError(
            f"the series would have {rows:.3g} rows, at most {MAX_ROWS:g} are possible: keep fewer with "
            f"record_every = {ceil(rows * record_every / MAX_ROWS)} (--record-every), or none (--no-recording)"
        )
    kept = [Series.empty()]
    channels = channels_of(experiment.law, experiment.sensing, experiment.actuation)

    def keep(loop: ClosedLoop, logged: Logged) -> None:
        if keep_series or watch is not None:
            first = loop.sample - len(logged.time)
            which = slice(-first % record_every, None, record_every)
            kept_rows = logged.rows(which).series(loop.wrist, channels)
            if keep_series:
                kept.append(kept_rows)
            if watch is not None:
                watch(kept_rows)
        if progress is not None:
            progress(loop.sample * experiment.control_period)

    embedded_files = EmbeddedFiles.of(experiment) if keep_series else EmbeddedFiles()
    if cache is None:
        cache = RunCache(interpreted_engine()) if interpreted else thread_cache(experiment.wrist_file)
    chunk = CHUNK if watch is None else WATCH_CHUNK
    [result] = roll_out([lambda: experiment], cache, stop=stop, keep=keep, chunk=chunk)
    if isinstance(result, Exception):
        raise result
    detail(f"simulated {experiment.duration:g} s: {result.wall_time:.3g} s")
    series = Series.joined(kept)
    return Run(
        channels=series.channels,
        described=series.described,
        description=description_of(experiment, embedded_files),
        outcome=result.outcome,
        metrics=result.metrics,
        measurement=result.measurement,
        versions=circumstances(),
        warnings=result.warnings,
        embedded_files=embedded_files,
        every=record_every,
        wall_time=result.wall_time,
        _experiment=experiment,
    )
