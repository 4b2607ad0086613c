"""View of margins."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spherical_wrist.api.margins import Margins
from spherical_wrist.api.view import Content, View, as_json, library
from spherical_wrist.result_table import ResultTable, beside
from spherical_wrist.stability.picture import margins_picture
from spherical_wrist.stability.report import HEADLINE
from spherical_wrist.stability.tables import margins_table, ranges_table

UNITS = {"_db": "dB", "_deg": "°", "_s": "s", "_hz": "Hz", "_mm": "mm", "_kg": "kg"}
"""Units by the ends of names."""
RESPONSES = {"sensitivity": "", "complementary": "", "tip_mm_per_Nm": "mm/(N·m)"}
"""Largest singular values over the frequency, with their units."""


class MarginsView(View[Margins]):
    """View of margins: a row for each law."""

    keys = ("law",)

    def __init__(self, result: Margins, width: float | str | None = None) -> None:
        super().__init__(result, width)
        self.table = result.to_dict()

    def notes(self) -> list[str]:
        """Return why a law has no margins."""
        return [f"{law['law']}: no margins; {law['reason']}" for law in self.table["laws"] if not law["stable"]]

    def summary(self) -> ResultTable:
        """Return the margins at the plant's input, and the ranges, of the laws that have them."""
        return beside(margins_table(self.table), ranges_table(self.table))

    def figure(self) -> Figure:
        """Draw sensitivity and tip response over the frequency, and the worst tip errors."""
        return margins_picture(self.table, self.width)

    def rows(self) -> list[dict[str, Any]]:
        """Return the margins at the plant's input, and the ranges, of each law."""
        names = ("law", "stable", "reason", *HEADLINE, "bandwidth_hz", "worst_tip_error_mm", "command")
        return [
            {**{name: law[name] for name in names}, **(law["ranges"] or {})}
            for law in sorted(self.table["laws"], key=lambda law: not law["ranges"])  # the first has all columns
        ]

    def units(self) -> dict[str, str]:
        """Return the unit of each column that has one."""
        return {name: UNITS[_end(name)] for row in self.rows()[:1] for name in row if _end(name)}

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return pictures, tables, and JSON."""
        return {**super().files(), ".json": lambda path: as_json(self.table)}

    def to_xarray(self) -> Any:
        """Return margins by law, and responses by law and frequency."""
        dataset, xarray = super().to_xarray(), library("xarray")
        found = {law["law"]: law["response"] for law in self.table["laws"] if law["stable"]}
        if not found:
            return dataset
        frequency = next(iter(found.values()))["frequency_hz"]
        nothing = np.full(len(frequency), np.nan)
        for name, unit in RESPONSES.items():
            values = [found[law][name] if law in found else nothing for law in dataset.coords["law"].values]
            dataset[name] = xarray.DataArray(
                values, dims=("law", "frequency_hz"), attrs={"units": unit} if unit else {}
            )
        return dataset.assign_coords(frequency_hz=frequency)


def _end(name: str) -> str:
    return next((end for end in UNITS if name.endswith(end)), "")
