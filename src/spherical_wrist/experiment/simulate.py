"""From an experiment to a run."""

import time
from collections.abc import Callable

import numpy as np

from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.run import Run, versions
from spherical_wrist.metrics import Meter
from spherical_wrist.plant import perturbed
from spherical_wrist.simulation.closed_loop import ClosedLoop
from spherical_wrist.simulation.engine import compiled_engine, interpreted_engine
from spherical_wrist.simulation.nominal import peak_torque
from spherical_wrist.simulation.outcome import Outcome, Status
from spherical_wrist.simulation.series import Series


def simulate(
    experiment: Experiment,
    *,
    record_every: int = 1,
    keep_series: bool = True,
    interpreted: bool = False,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
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

    Returns:
        The run. That it diverged is an outcome and no exception.

    Raises:
        ParameterError: the experiment's periods do not fit, or its disturbance has no size.
        ModelError: the MJCF file is not a wrist.
        LawError: the law raises, returns no torque, or cannot be compiled.
    """
    if record_every < 1:
        raise ParameterError(f"record_every = {record_every}: must be 1 or more")
    nominal = experiment.nominal()
    timing = experiment.timing(nominal)
    plant = perturbed(nominal, experiment.perturbation)
    engine = interpreted_engine() if interpreted else compiled_engine()
    needs_peak = experiment.disturbance.amplitude is None and experiment.disturbance.level > 0.0
    reference = experiment.reference.drawn(np.random.default_rng([experiment.seed, 3]))
    peak = peak_torque(nominal, reference, timing, engine, stop) if needs_peak else 0.0
    disturbance = experiment.disturbance.torque(peak, np.random.default_rng(experiment.seed))
    loop = ClosedLoop(
        plant,
        nominal,
        experiment.law,
        reference,
        disturbance,
        timing,
        engine,
        experiment.start,
        experiment.hardware,
    )
    measurement = experiment.measurement(nominal)
    meter, kept = Meter(measurement), [Series.empty()]
    outcome = None
    began = time.perf_counter()
    while outcome is None:
        if stop():
            outcome = Outcome(Status.INTERRUPTED, loop.sample * timing.control_period, "stopped on request")
            break
        first = loop.sample
        piece = loop.advance()
        meter.add(piece)
        if keep_series:
            kept.append(piece.rows(slice(-first % record_every, None, record_every)))
        if progress is not None:
            progress(loop.sample * timing.control_period)
        outcome = loop.outcome
    wall_time = time.perf_counter() - began
    series = Series.joined(kept)
    return Run(
        **series.arrays(),
        description=experiment.model_dump(mode="json"),
        outcome=outcome,
        metrics=meter.result(),
        measurement=measurement,
        versions=versions(),
        every=record_every,
        wall_time=wall_time,
        _experiment=experiment,
    )
