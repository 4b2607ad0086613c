"""``sw.frontier``: distance from the nominal wrist up to which each law keeps bounds on its metrics."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Unpack

from spherical_wrist.api.arguments import Arguments, ExperimentGiven, LawsGiven, ProgressGiven
from spherical_wrist.comparison.bounds import BOUNDS, Bounds, statement
from spherical_wrist.comparison.frontier import Edge
from spherical_wrist.comparison.frontier import frontier as find_frontier
from spherical_wrist.comparison.frontier_report import order, to_dict
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.experiment.axes import Axis, chosen_axes
from spherical_wrist.experiment.values import Conditions
from spherical_wrist.result import Result, counted


@dataclass(frozen=True, repr=False)
class Frontier(Result):
    """First misses of bounds on metrics.

    Attributes:
        laws: laws by label.
        axes: axes along which the wrist deviates.
        edges: first miss of each law along each axis.
        bounds: largest permitted values, by metric.
        tolerance: relative tolerance of the values.
        wall_time: time that all took [s].
    """

    view: ClassVar[str] = "spherical_wrist.api.frontier_view:FrontierView"

    laws: Laws
    axes: tuple[Axis, ...]
    edges: tuple[Edge, ...]
    bounds: Bounds
    tolerance: float
    wall_time: float

    def headline(self) -> str:
        """Return the number of laws, the axes, the bounds, and the law that keeps them furthest."""
        first = order(self.edges, self.laws, self.axes)[0]
        size = f"{counted(len(self.laws), 'law')}, {', '.join(axis.name for axis in self.axes)}"
        bounds = ", ".join(statement(name, bound) for name, bound in self.bounds.items())
        return f"{size}: {first} keeps {bounds} furthest, in the mean of the ranks"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of :mod:`spherical_wrist.comparison.frontier_report`."""
        return to_dict(self.edges, self.laws, self.axes, self.bounds, self.tolerance, self.wall_time)


def frontier(
    laws: LawsGiven | None = None,
    *,
    axes: str | Sequence[str] = (),
    bounds: Bounds = BOUNDS,
    tolerance: float = 0.02,
    experiment: ExperimentGiven | None = None,
    jobs: int | None = None,
    progress: ProgressGiven | None = None,
    **changes: Unpack[Conditions],
) -> Frontier:
    """Find the first deviation at which a metric exceeds its bound, by law and axis.

    See :func:`spherical_wrist.comparison.frontier.frontier` for what is searched, and what is known afterwards.

    Args:
        laws: laws; by default all of the package.
        axes: names of the axes, such as ``"heavier"`` and ``"delay"``; by default all.
        bounds: largest permitted values by metric, such as ``{"max_tip_error_mm": 0.1}``.
        tolerance: relative tolerance of the values.
        experiment: experiment to deviate from; by default an undisturbed plant equal to the nominal model.
        jobs: number of threads; by default one for each core.
        progress: True for a line on the error stream, or a function of the finished searches and of all.
        **changes: parameters of the experiment that replace its own, such as ``duration``; ``hardware="realistic"``.

    Raises:
        WristError: a law, an axis or a parameter is not valid, or a law raises.
    """
    given = Arguments.of(laws, experiment, changes, progress, "searching")
    along = chosen_axes([axes] if isinstance(axes, str) else axes)
    began = time.perf_counter()
    edges = find_frontier(
        given.laws,
        along,
        given.tables,
        given.changes,
        bounds=bounds,
        tolerance=tolerance,
        jobs=jobs,
        progress=given.progress,
    )
    return Frontier(given.laws, along, tuple(edges), bounds, tolerance, time.perf_counter() - began)
