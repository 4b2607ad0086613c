"""View of a frontier."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from spherical_wrist.api.frontier import Frontier
from spherical_wrist.api.view import Content, Summary, View, as_json
from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.frontier_picture import frontier_picture
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.report.parts import written


class FrontierView(View[Frontier]):
    """View of a frontier: the first miss of each law along each axis."""

    keys = ("law", "axis")

    def __init__(self, result: Frontier) -> None:
        super().__init__(result)
        self.table = result.to_dict()

    def summary(self) -> Summary:
        """Return the values at the first misses, in display units."""
        headings = ["law", *(f"{axis.name} [{axis.shown[1]}]" for axis in self.result.axes)]
        rows = [
            [law["law"], *(_entry(law["edges"][axis.name], axis) for axis in self.result.axes)]
            for law in self.table["laws"]
        ]
        return Summary(headings, rows)

    def figure(self) -> Figure:
        """Draw one panel per axis."""
        return frontier_picture(self.table, self.result.axes)

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each law and axis."""
        about = {axis["axis"]: axis for axis in self.table["axes"]}
        return [
            {
                "law": law["law"],
                "axis": axis,
                "parameter": about[axis]["parameter"],
                "unit": about[axis]["unit"],
                "base": about[axis]["base"],
                **edge,
            }
            for law in self.table["laws"]
            for axis, edge in law["edges"].items()
        ]

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return pictures, tables, and JSON."""
        return {**super().files(), ".json": lambda path: as_json(self.table)}


def _entry(edge: Mapping[str, Any], axis: Axis) -> str:
    scale = axis.shown[0]
    if edge["found"] == CrossingStatus.NOMINAL:
        return "nominal"
    if edge["found"] == CrossingStatus.NEVER:
        return f"{'<' if axis.downwards else '>'} {scale * edge['holds']:.3g}"
    return str(written(scale * edge["misses"], short=True))
