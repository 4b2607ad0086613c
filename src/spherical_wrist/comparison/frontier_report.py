"""Frontier as plain tables for JSON.

The keys of the JSON object are stable:

===============  ====================================================================================================
``bounds``       largest permitted value of each bounded metric, by its name
``tolerance``    of the crossings, relative
``axes``         ``axis`` (name), ``meaning``, ``parameter``, ``unit``, ``base`` (value of the nominal wrist, where the
                 search starts), ``first`` (first deviation tested), ``limit`` (last value), ``growth`` (ratio of the
                 deviations tested before the bisection), ``shown_factor`` and ``shown_unit`` (for display)
``laws``         best first: ``law`` (label), ``name``, ``status``, ``option`` (value of ``--law`` that makes it again),
                 ``parameters``, and by axis ``edges``: ``found`` (``crossing``, ``never within the limit``, ``misses
                 already at the nominal``), ``holds`` and ``misses`` (values of the parameter, null where there is
                 none), ``by`` (metric that exceeds its bound there the most, ``outcome`` for a run that did not
                 complete, null where none missed), ``reason`` (the same in words), ``tested`` (how many runs),
                 ``command`` (replays the first miss, or the run at the limit)
``warnings``     sentences about what makes the runs of the nominal wrist doubtful, where each search begins
``versions``     of the packages and the platform
``files``        names of the files written
``wall_time_s``  time that all runs took
===============  ====================================================================================================
"""

from collections.abc import Sequence
from typing import Any

from spherical_wrist.comparison.bounds import Bounds
from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.frontier import Edge
from spherical_wrist.comparison.law_selection import Laws, law_option
from spherical_wrist.comparison.ranking import ranks
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.experiment.command import command_of
from spherical_wrist.measure.warnings import summarized
from spherical_wrist.simulation.rollouts import RolloutResult
from spherical_wrist.simulation.run import versions

OUTCOME = "outcome"
"""Value of ``by`` for a run that did not complete."""


def to_dict(
    edges: Sequence[Edge], laws: Laws, axes: Sequence[Axis], bounds: Bounds, tolerance: float, wall_time: float
) -> dict[str, Any]:
    """Return a frontier as the JSON object described above."""
    by_law = {law: [edge for edge in edges if edge.law == law] for law in laws}
    return {
        "bounds": dict(bounds),
        "tolerance": tolerance,
        "axes": [
            {
                "axis": axis.name,
                "meaning": axis.meaning,
                "parameter": axis.parameter,
                "unit": axis.unit,
                "base": axis.base,
                "first": axis.first,
                "limit": axis.limit,
                "growth": axis.growth,
                "shown_factor": axis.shown[0],
                "shown_unit": axis.shown[1],
            }
            for axis in axes
        ],
        "laws": [
            {
                "law": law,
                "name": laws[law].name,
                "status": laws[law].status,
                "option": law_option(law, laws[law]),
                "parameters": {
                    name: value for name, value in laws[law].model_dump(mode="json").items() if name != "name"
                },
                "edges": {edge.axis.name: _edge(edge) for edge in by_law[law]},
            }
            for law in order(edges, laws, axes)
        ],
        "warnings": _warnings(edges),
        "versions": versions(),
        "files": [],
        "wall_time_s": wall_time,
    }


def _warnings(edges: Sequence[Edge]) -> list[str]:
    """Return the warnings of the runs at the base of the axes that completed; most axes of a law share one."""
    done: dict[str, RolloutResult] = {}
    for edge in edges:
        if (
            edge.base is not None
            and not edge.base.outcome.status.lost
            and all(edge.base.metrics != run.metrics for run in done.values())
        ):
            done[f"the nominal wrist with {edge.law}, where axis {edge.axis.name} begins"] = edge.base
    metrics = {name: run.metrics for name, run in done.items()}
    return list(summarized(metrics, {name: run.warnings for name, run in done.items()}))


def order(edges: Sequence[Edge], laws: Laws, axes: Sequence[Axis]) -> list[str]:
    """Sort the labels of the laws by mean rank over the axes. On each axis, the law that holds furthest is first."""
    total = dict.fromkeys(laws, 0)
    for axis in axes:
        places = ranks({edge.law: _reach(edge) for edge in edges if edge.axis.name == axis.name})
        for law, place in places.items():
            total[law] += place
    return sorted(total, key=lambda law: total[law])


def _reach(edge: Edge) -> float:
    """Return a number that is smaller if a law holds the bound further; infinity if it never holds."""
    if edge.crossing.status is CrossingStatus.NOMINAL:
        return float("inf")
    return float("-inf") if edge.crossing.misses is None else -edge.crossing.misses


def _edge(edge: Edge) -> dict[str, Any]:
    try:
        command = command_of(edge.experiment)
    except ParameterError:  # a law that is defined in the calling program has no command
        command = None
    return {
        "found": str(edge.crossing.status),
        "holds": edge.holds,
        "misses": edge.misses,
        "by": None if edge.miss is None else edge.miss.metric or OUTCOME,
        "reason": None if edge.miss is None else edge.miss.reason,
        "tested": len(edge.crossing.tested),
        "command": command,
    }
