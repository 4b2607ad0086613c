"""Table of a frontier for a paper: a row for each law, a column for each axis."""

from collections.abc import Mapping, Sequence
from typing import Any

from spherical_wrist.comparison.bounds import statement
from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.law_selection import named_laws
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.picture_style import own_laws
from spherical_wrist.result_table import Cell, Column, ResultTable, short


def frontier_table(table: Mapping[str, Any], axes: Sequence[Axis]) -> ResultTable:
    """Return the first value of each axis at which each law missed a bound; the law that goes furthest stands out.

    Args:
        table: frontier as :func:`spherical_wrist.comparison.frontier_report.to_dict` returns it.
        axes: axes of the frontier.
    """
    laws = table["laws"]
    reach = [[_reach(law["edges"][axis.name], axis) for axis in axes] for law in laws]
    furthest = [max(column) for column in zip(*reach, strict=True)]
    bounds = " or ".join(statement(name, bound) for name, bound in table["bounds"].items())
    own = own_laws({law["law"]: law["status"] for law in laws})
    return ResultTable(
        f"First value at which a law misses {bounds}",
        [Column("law", text=True), *(Column(axis.name.replace("_", " "), axis.shown[1]) for axis in axes)],
        [[law["law"], *(_cell(law["edges"][axis.name], axis) for axis in axes)] for law in laws],
        frozenset(
            (row, column + 1)
            for row, values in enumerate(reach)
            for column, value in enumerate(values)
            if value == furthest[column] >= 0.0
        ),
        ["nominal: the nominal wrist misses already; > or <: no miss up to there.", *named_laws(laws)],
        frozenset(place for place, law in enumerate(laws) if law["law"] in own),
    )


def _reach(edge: Mapping[str, Any], axis: Axis) -> float:
    if edge["found"] == CrossingStatus.NEVER:
        return float("inf")
    return -1.0 if edge["found"] == CrossingStatus.NOMINAL else axis.deviation(edge["misses"])


def _cell(edge: Mapping[str, Any], axis: Axis) -> Cell:
    scale, _ = axis.shown
    if edge["found"] == CrossingStatus.NEVER:
        return f"{'<' if axis.downwards else '>'} {short(scale * axis.limit)}"
    return "nominal" if edge["found"] == CrossingStatus.NOMINAL else float(scale * edge["misses"])
