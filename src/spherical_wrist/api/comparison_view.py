"""View of a comparison."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from spherical_wrist.api.view import Content, View, as_json
from spherical_wrist.comparison.picture import comparison_picture
from spherical_wrist.comparison.report import CHATTERING, ERROR, TIP_ERROR, as_csv, as_markdown, to_dict
from spherical_wrist.comparison.results import Comparison
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.result_table import Column, ResultTable, short

MEANS = (
    (ERROR, METRICS[ERROR].label, METRICS[ERROR].unit),
    (TIP_ERROR, METRICS[TIP_ERROR].label, METRICS[TIP_ERROR].unit),
    (CHATTERING, "chattering", "× plain"),
)
"""Figures of which a ranking has the means: key, heading, unit."""


class ComparisonView(View[Comparison]):
    """View of a comparison: the ranking, errors and chattering of each law, and a row for each cell."""

    keys = ("law", "case", "seed")

    def __init__(self, result: Comparison, width: float | str | None = None) -> None:
        super().__init__(result, width)
        self.table = to_dict(result, "default")

    def notes(self) -> list[str]:
        """Return the warnings of the runs."""
        return [f"warning: {warning}" for warning in self.table["warnings"]]

    def summary(self) -> ResultTable:
        """Return the ranking, with mean errors and chattering by hardware."""
        groups = list(self.table["laws"][0]["groups"])
        columns = [Column("law", text=True), Column("rank"), Column("median ratio"), Column("worst ratio")]
        columns += [Column("best on"), Column("within 5 % on"), Column("lost runs")]
        figures = [(key, group, heading, unit) for key, heading, unit in MEANS for group in groups]
        columns += [Column(f"{heading}, {group.partition(' ')[0]}", unit) for _, group, heading, unit in figures]
        rows = []
        for row in self.table["laws"]:
            counts = [row[key] for key in ("wins", "within_5_percent", "lost_runs")]
            means = [row["groups"][group][key] for key, group, *_ in figures]
            ratios = [row["median_ratio"], row["worst_ratio"]]
            rows.append(
                [row["law"], row["rank"], *ratios, *counts, *(None if each is None else each["mean"] for each in means)]
            )
        return ResultTable(self.result.headline(), columns, rows, notes=self.notes())

    def figure(self) -> Figure:
        """Draw mean error against mean chattering."""
        return comparison_picture(self.table, self.width)

    def rows(self) -> list[dict[str, Any]]:
        """Return the cells, with their metrics as columns."""
        left = ("metrics", "recording")
        return [
            {**{key: value for key, value in cell.items() if key not in left}, **cell["metrics"]}
            for cell in self.table["cells"]
        ]

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return pictures, tables, and the files that ``wrist compare`` writes."""
        own: dict[str, Callable[[Path], Content]] = {
            ".csv": lambda path: as_csv(self.table).encode(),
            ".md": lambda path: as_markdown(self.table, short).encode(),
            ".json": lambda path: as_json(self.table),
        }
        return {**super().files(), **own}
