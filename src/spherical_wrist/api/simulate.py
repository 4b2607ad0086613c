"""``sw.simulate``: one run."""

from collections.abc import Callable
from typing import Unpack

from spherical_wrist.api.arguments import ExperimentGiven, ProgressGiven, changes_of, counter, law_of, tables_of
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.experiment.values import Conditions, LawGiven
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.simulate import simulate as simulate_experiment


def simulate(
    law: LawGiven | Experiment | None = None,
    *,
    experiment: ExperimentGiven | None = None,
    record_every: int = 1,
    keep_series: bool = True,
    interpreted: bool = False,
    progress: ProgressGiven | None = None,
    stop: Callable[[], bool] = lambda: False,
    watch: Callable[[Series], None] | None = None,
    cache: RunCache | None = None,
    **changes: Unpack[Conditions],
) -> Run:
    """Run the closed loop that an experiment describes.

    Simulating disables libmujoco's profiling clock for the whole process: ``MjData.timer`` stays at zero afterwards.

    Args:
        law: the law, or a whole experiment; by default that of ``experiment``.
        experiment: experiment, values of its parameters, or experiment file; by default the default experiment.
        record_every: interval of control instants that are kept in the series; the metrics use all instants.
        keep_series: True to keep the series. Without them, memory does not grow with the duration.
        interpreted: True to run loop and law in plain Python, for a debugger; hundreds of times slower.
        progress: True for a line on the error stream, or a function of the simulated and of all control periods.
        stop: polled a few times a second; returns True to stop. The run is then ``interrupted``, and keeps its series.
        watch: called with every chunk of the series as soon as it is simulated; for example ``LiveView.show``.
        cache: cache of models and laws; by default that of this thread.
        **changes: parameters of the experiment that replace its own, such as ``duration``; ``hardware="realistic"``.

    Returns:
        The run. Divergence is an outcome, not an exception.

    Raises:
        ParameterError: a parameter is not valid, the periods are no multiples of each other, the disturbance has no
            size, or the series would have too many rows.
        ModelError: the MJCF file is not a wrist.
        LawError: the law raises, writes no torque, or cannot be compiled.
    """
    described = _experiment(law, experiment, changes_of(changes))
    called = None
    if progress is not None and progress is not False:
        count, period = counter(progress, "simulating"), described.control_period
        total = round(described.duration / period)

        def called(simulated: float) -> None:
            count(round(simulated / period), total)

    return simulate_experiment(
        described,
        record_every=record_every,
        keep_series=keep_series,
        interpreted=interpreted,
        progress=called,
        stop=stop,
        watch=watch,
        cache=cache,
    )


def _experiment(
    law: LawGiven | Experiment | None, base: ExperimentGiven | None, changes: dict[str, object]
) -> Experiment:
    if isinstance(law, Experiment):
        if base is not None:
            raise ParameterError("two experiments are given, as the first argument and as experiment: give one")
        return Experiment(**with_changes(dict(law), changes)) if changes else law
    if isinstance(law, str) and law.endswith(".toml"):
        raise ParameterError(f"law = {law!r} is an experiment file: give experiment={law!r}")
    given = {} if law is None else {"law": law_of(law)}
    return Experiment(**with_changes(tables_of(base), {**changes, **given}))
