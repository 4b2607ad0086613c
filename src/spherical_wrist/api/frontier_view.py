"""View of a frontier."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from spherical_wrist.api.frontier import Frontier
from spherical_wrist.api.view import Content, View, as_json
from spherical_wrist.comparison.frontier_picture import frontier_picture
from spherical_wrist.comparison.frontier_table import frontier_table
from spherical_wrist.result_table import ResultTable


class FrontierView(View[Frontier]):
    """View of a frontier: the first miss of each law along each axis."""

    keys = ("law", "axis")

    def __init__(self, result: Frontier, width: float | str | None = None) -> None:
        super().__init__(result, width)
        self.table = result.to_dict()

    def summary(self) -> ResultTable:
        """Return the values at the first misses, in display units."""
        return frontier_table(self.table, self.result.axes)

    def notes(self) -> list[str]:
        """Return the warnings of the runs."""
        return [f"warning: {warning}" for warning in self.table["warnings"]]

    def figure(self) -> Figure:
        """Draw one panel per axis."""
        return frontier_picture(self.table, self.result.axes, self.width)

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
