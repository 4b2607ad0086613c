"""From an experiment to a run."""

import time
from collections.abc import Callable
from math import ceil
from typing import NamedTuple

import numpy as np

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.evidence import Evidence
from spherical_wrist.experiment.guard import guarded_motion, guarded_torque
from spherical_wrist.experiment.run import Run, circumstances
from spherical_wrist.libmujoco import warnings_kept_in_data
from spherical_wrist.metrics import LogMeter, Measurement, Metrics
from spherical_wrist.simulation.closed_loop import CHUNK, ClosedLoop
from spherical_wrist.simulation.engine import Engine, compiled_engine, interpreted_engine
from spherical_wrist.simulation.logged import Logged
from spherical_wrist.simulation.nominal import Motion, peak_torque
from spherical_wrist.simulation.outcome import Outcome, Status
from spherical_wrist.simulation.series import Series
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.simulation.workbench import Machine, Sampled, Workbench
from spherical_wrist.wrist import Wrist

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


class Measured(NamedTuple):
    """What is left of a run without its series.

    Attributes:
        outcome: how it ended.
        metrics: figures of merit.
        measurement: what they depend on besides the series.
        wall_time: time that simulating took, without compiling [s].
    """

    outcome: Outcome
    metrics: Metrics
    measurement: Measurement
    wall_time: float


@warnings_kept_in_data()
def measured(
    experiment: Experiment,
    bench: Workbench,
    keep: Callable[[ClosedLoop, Logged], None] = lambda loop, logged: None,
    stop: Callable[[], bool] = lambda: False,
    chunk: int = CHUNK,
) -> Measured:
    """Runs the closed loop that an experiment describes, and measures it.

    Args:
        experiment: what to run.
        bench: for runs that follow one another on one thread; what they share is made once, and the bits are the same.
        keep: called with the loop and each piece of the log.
        stop: see :func:`simulate`.
        chunk: control periods that are simulated at a time; the bits do not depend on it.

    Raises:
        WristError: see :func:`simulate`.
    """
    measurement = experiment.measurement(bench.wrist(experiment.wrist_file))
    meter, outcome = LogMeter(measurement, bench.engine), None
    try:
        loop = closed_loop(experiment, bench, stop)
    except _StoppedError:
        return Measured(Outcome(Status.INTERRUPTED, 0.0, "stopped on request"), meter.result(), measurement, 0.0)
    began = time.perf_counter()
    while outcome is None:
        if stop():
            outcome = Outcome(Status.INTERRUPTED, loop.sample * experiment.control_period, "stopped on request")
            break
        logged = loop.run(chunk)
        meter.add(logged)
        keep(loop, logged)
        outcome = loop.outcome
    return Measured(outcome, meter.result(), measurement, time.perf_counter() - began)


def closed_loop(
    experiment: Experiment,
    bench: Workbench,
    stop: Callable[[], bool] = lambda: False,
    machine: Callable[[Timing], Machine] | None = None,
) -> ClosedLoop:
    """The closed loop that an experiment describes, at its start.

    Args:
        experiment: what to run.
        bench: what it shares with others on the same thread.
        stop: asked now and then whether to stop sizing the disturbance.
        machine: makes plant and nominal model, where they are not to be those of the bench.

    Raises:
        WristError: see :func:`simulate`.
    """
    nominal = bench.wrist(experiment.wrist_file)
    timing = experiment.timing(nominal)
    engine, law, seed = bench.engine, experiment.law, experiment.seed
    drawn = guarded_motion(experiment.reference, experiment.generator_of_reference, experiment.duration)
    reference = Sampled(drawn, bench)
    peak, load = 0.0, experiment.disturbance
    if load.amplitude is None and load.level > 0.0:
        peak = bench.value(
            ("peak", experiment.wrist_file, drawn, timing), lambda: _peak(nominal, reference, timing, engine, stop)
        )
    torque = guarded_torque(load, peak, np.random.default_rng(seed))
    disturbance = bench.sampled(("torque", load, peak, seed), torque)
    made = machine(timing) if machine else bench.machine(experiment.wrist_file, experiment.perturbation, timing)
    parts = (law, reference, disturbance, timing, engine, experiment.start, experiment.hardware)
    return ClosedLoop(nominal, nominal, *parts, bench, made)


class _StoppedError(Exception):
    """Stopped before there was a peak to go on with."""


def _peak(nominal: Wrist, reference: Motion, timing: Timing, engine: Engine, stop: Callable[[], bool]) -> float:
    """See ``peak_torque``; a peak that was cut short must not be remembered.

    Raises:
        _StoppedError: asked to stop.
    """
    stopped: list[bool] = []

    def halted() -> bool:
        if stop():
            stopped.append(True)
        return bool(stopped)

    peak = peak_torque(nominal, reference, timing, engine, halted)
    if stopped:
        raise _StoppedError
    return peak
