"""Robustness frontier: deviation from the nominal wrist up to which a law keeps bounds on its metrics, by axis."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.comparison.bounds import BOUNDS, Bounds, Miss, checked, find_miss, require
from spherical_wrist.comparison.crossing import Crossing, first_crossing
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.files import make_folder
from spherical_wrist.simulation.rollouts import RolloutResult
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress

NOMINAL_PLANT: Mapping[str, Any] = {"disturbance": {"level": 0.0}, "mass_scale": 1.0}
"""Default experiment of a frontier: a plant that equals the nominal wrist."""

RESOLVED = 0.4
"""Largest frequency of an axis, as a multiple of the control rate: above half of it, samples show a lower one."""


class Edge(NamedTuple):
    """First miss of the bounds by a law along an axis.

    Attributes:
        law: label of the law.
        axis: axis of the deviation.
        crossing: crossing, in deviations of the parameter from its base.
        experiment: experiment at the first miss; at the limit if there is none.
        miss: how that experiment misses the bounds; None if none missed.
        base: run of the nominal wrist, where the search began.
    """

    law: str
    axis: Axis
    crossing: Crossing
    experiment: Experiment
    miss: Miss | None
    base: RolloutResult | None = None

    @property
    def holds(self) -> float | None:
        """Value at the largest tested deviation below the first miss; None if the base misses."""
        return None if self.crossing.holds is None else self.axis.value(self.crossing.holds)

    @property
    def misses(self) -> float | None:
        """Value at the smallest deviation that missed; None if none missed."""
        return None if self.crossing.misses is None else self.axis.value(self.crossing.misses)


def frontier(
    laws: Laws,
    axes: Sequence[Axis],
    tables: Mapping[str, Any],
    changes: Mapping[str, Any],
    *,
    bounds: Bounds = BOUNDS,
    tolerance: float = 0.02,
    folder: Path | None = None,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
) -> list[Edge]:
    """Find the first deviation at which a metric exceeds its bound, by law and axis.

    Only the parameter of the axis is varied. The search is :func:`.first_crossing`, with its guarantees, which do not
    need an error that grows along the axis; a run that does not complete is a miss. All runs of a search use the same
    random numbers, so that only the size of the noise changes.

    Args:
        laws: laws by label.
        axes: axes.
        tables: experiment as plain tables, applied to ``NOMINAL_PLANT``.
        changes: values by dotted name that override both. Those of laws are ignored, as ``laws`` has them already.
        bounds: bounds on metrics.
        tolerance: relative tolerance of the crossings.
        folder: folder for results, created before anything is simulated.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished searches and their total.

    Returns:
        The first misses, ordered by law, then by axis.

    Raises:
        WristError: the experiment or a bound is not valid, a run has no such metric, or a law raises.
    """
    limits = checked(bounds)
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    tables = with_changes({**NOMINAL_PLANT, **tables}, shared)
    bases = {label: Experiment(**{**tables, "law": law}) for label, law in laws.items()}
    known: dict[Experiment, tuple[Miss | None, RolloutResult]] = {}  # most axes of a law begin with the same run

    def search(item: tuple[str, Axis], worker: Worker) -> Edge:
        label, axis = item

        def experiment(deviation: float) -> Experiment:
            return axis.change(bases[label], axis.value(deviation))

        def holds(deviation: float) -> bool:
            tested = experiment(deviation)
            if tested not in known:
                run = worker.measure(tested)
                require(limits, run.metrics)
                known[tested] = find_miss(run.outcome, run.metrics, limits), run
            return known[tested][0] is None

        crossing = first_crossing(holds, axis.first, axis.span, tolerance, axis.growth)
        end = experiment(axis.span if crossing.misses is None else crossing.misses)
        return Edge(label, axis, crossing, end, known[end][0], known[experiment(0.0)][1])

    work = [(label, _resolved(axis, bases[label])) for label in laws for axis in axes]
    for label, axis in work:
        axis.change(bases[label], axis.base)  # raises for invalid parameters before anything runs
    if folder is not None:
        make_folder(folder)
    # threads begin with different laws, which are compiled once each
    order = sorted(range(len(work)), key=lambda index: (index % len(axes), index))
    edges = Runner(jobs).map(
        search, [work[index] for index in order], progress, lambda item: f"{item[0]} along {item[1].name}"
    )
    return [edge for _, edge in sorted(zip(order, edges, strict=True), key=lambda pair: pair[0])]


def _resolved(axis: Axis, experiment: Experiment) -> Axis:
    """Return an axis without the frequencies that the control period does not resolve."""
    return axis.up_to(RESOLVED / experiment.control_period) if axis.unit == "Hz" else axis
