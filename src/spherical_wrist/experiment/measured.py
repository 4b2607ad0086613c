"""Experiments run and measured, on a bench that runs share, without keeping their series."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.guard import guarded_motion, guarded_torque
from spherical_wrist.libmujoco import warnings_kept_in_data
from spherical_wrist.metrics import LogMeter, Measurement, Metrics
from spherical_wrist.simulation.closed_loop import CHUNK, ClosedLoop
from spherical_wrist.simulation.engine import Engine
from spherical_wrist.simulation.logged import Logged
from spherical_wrist.simulation.nominal import Motion, peak_torque
from spherical_wrist.simulation.outcome import Outcome, Status
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.simulation.workbench import Machine, Sampled, Workbench
from spherical_wrist.wrist import Wrist


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
        stop: see :func:`spherical_wrist.experiment.simulate.simulate`.
        chunk: control periods that are simulated at a time; the bits do not depend on it.

    Raises:
        WristError: see :func:`spherical_wrist.experiment.simulate.simulate`.
    """
    measurement = experiment.measurement(bench.wrist(experiment.wrist_file))
    meter = LogMeter(measurement, bench.engine)
    try:
        loop = closed_loop(experiment, bench, stop)
    except StoppedError:
        outcome = Outcome(Status.INTERRUPTED, 0.0, "stopped on request")
        return Measured(outcome, meter.result(), measurement, 0.0)
    began, ended = time.perf_counter(), loop.outcome
    while ended is None:
        if stop():
            ended = Outcome(Status.INTERRUPTED, loop.sample * measurement.period, "stopped on request")
            break
        logged = loop.run(chunk)
        meter.add(logged)
        keep(loop, logged)
        ended = loop.outcome
    return Measured(ended, meter.result(), measurement, time.perf_counter() - began)


def closed_loop(
    experiment: Experiment,
    bench: Workbench,
    stop: Callable[[], bool] = lambda: False,
    machine: Callable[[Timing], Machine] | None = None,
    seat: int = 0,
) -> ClosedLoop:
    """The closed loop that an experiment describes, at its start.

    Args:
        experiment: what to run.
        bench: what it shares with others on the same thread.
        stop: asked now and then whether to stop sizing the disturbance.
        machine: makes plant and nominal model, where they are not to be those of the bench.
        seat: of the bench, whose plant it takes.

    Raises:
        StoppedError: asked to stop.
        WristError: see :func:`spherical_wrist.experiment.simulate.simulate`.
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
    made = machine(timing) if machine else bench.machine(experiment.wrist_file, experiment.perturbation, timing, seat)
    parts = (law, reference, disturbance, timing, engine, experiment.start, experiment.hardware)
    return ClosedLoop(nominal, nominal, *parts, bench, made)


class StoppedError(Exception):
    """Stopped on request before there was anything to go on with."""


def _peak(nominal: Wrist, reference: Motion, timing: Timing, engine: Engine, stop: Callable[[], bool]) -> float:
    """See ``peak_torque``; a peak that was cut short must not be remembered.

    Raises:
        StoppedError: asked to stop.
    """
    stopped: list[bool] = []

    def halted() -> bool:
        if stop():
            stopped.append(True)
        return bool(stopped)

    peak = peak_torque(nominal, reference, timing, engine, halted)
    if stopped:
        raise StoppedError
    return peak
