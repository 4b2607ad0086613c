"""From an experiment to a run."""

from collections.abc import Callable
from math import ceil

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.evidence import Evidence
from spherical_wrist.experiment.measured import measured
from spherical_wrist.experiment.run import Run, circumstances
from spherical_wrist.simulation.closed_loop import CHUNK, ClosedLoop
from spherical_wrist.simulation.engine import compiled_engine, interpreted_engine
from spherical_wrist.simulation.logged import Logged
from spherical_wrist.simulation.series import Series
from spherical_wrist.simulation.workbench import Workbench

MOST_ROWS = 20_000_000
"""Rows of a series: some ten gigabytes in memory, 5½ hours at 1 kHz."""

WATCHED = 1000
"""Control periods that are simulated at a time where somebody watches: a few milliseconds; the bits are the same."""


def simulate(
    experiment: Experiment,
    *,
    record_every: int = 1,
    keep_series: bool = True,
    interpreted: bool = False,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
    watch: Callable[[Series], None] | None = None,
) -> Run:
    """Runs the closed loop that an experiment describes.

    Simulating clears libmujoco's profiling clock for the whole process: ``MjData.timer`` stays at zero afterwards.

    Args:
        experiment: what to run.
        record_every: keep every so-many-th control instant in the series; the metrics see all of them.
        keep_series: keep the series at all. Without them memory does not grow with the duration.
        interpreted: run the loop and the law as plain Python, for a debugger; hundreds of times slower.
        progress: called now and then with the simulated time [s].
        stop: asked now and then whether to stop; the run is then ``interrupted`` and keeps what was simulated.
        watch: called with every piece of the series as soon as it is simulated, such as ``LiveView.show``.

    Returns:
        The run. That it diverged is an outcome and no exception.

    Raises:
        ParameterError: the experiment's periods do not fit, its disturbance has no size, or there would be too many
            rows to keep.
        ModelError: the MJCF file is not a wrist.
        LawError: the law raises, returns no torque, or cannot be compiled.
    """
    if record_every < 1:
        raise ParameterError(f"record_every = {record_every}: must be 1 or more")
    rows = experiment.duration / experiment.control_period / record_every
    if keep_series and rows > MOST_ROWS:
        raise ParameterError(
            f"the series would have {rows:.3g} rows, {MOST_ROWS:g} are the most: keep every so-many-th with "
            f"record_every = {ceil(rows * record_every / MOST_ROWS)} (--record-every), or none (--no-recording)"
        )
    kept = [Series.empty()]

    def keep(loop: ClosedLoop, logged: Logged) -> None:
        if keep_series or watch is not None:
            first = loop.sample - len(logged.time)
            piece = loop.series(logged).rows(slice(-first % record_every, None, record_every))
            if keep_series:
                kept.append(piece)
            if watch is not None:
                watch(piece)
        if progress is not None:
            progress(loop.sample * experiment.control_period)

    evidence = Evidence.of(experiment) if keep_series else Evidence()
    bench = Workbench(interpreted_engine() if interpreted else compiled_engine())
    found = measured(experiment, bench, keep, stop, CHUNK if watch is None else WATCHED)
    return Run(
        **Series.joined(kept).arrays(),
        description=experiment.model_dump(mode="json"),
        outcome=found.outcome,
        metrics=found.metrics,
        measurement=found.measurement,
        versions=circumstances(),
        evidence=evidence,
        every=record_every,
        wall_time=found.wall_time,
        _experiment=experiment,
    )
