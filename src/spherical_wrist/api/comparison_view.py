"""View of a comparison."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from spherical_wrist.api.view import Content, Summary, View, as_json
from spherical_wrist.comparison.picture import pareto_picture
from spherical_wrist.comparison.report import CHATTERING, ERROR, as_csv, as_markdown, to_dict
from spherical_wrist.comparison.results import Comparison
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.report.parts import written


class ComparisonView(View[Comparison]):
    """View of a comparison: the ranking, error against chattering, and a row for each cell."""

    keys = ("law", "case", "seed")

    def __init__(self, result: Comparison) -> None:
        super().__init__(result)
        self.table = to_dict(result, "default")

    def notes(self) -> list[str]:
        """Return the warnings of the runs."""
        return [f"warning: {warning}" for warning in self.table["warnings"]]

    def summary(self) -> Summary:
        """Return the ranking, with mean errors and chattering by hardware."""
        groups = list(self.table["laws"][0]["groups"])
        short = [group.partition(" ")[0] for group in groups]
        headings = ["law", "rank", "median ratio", "worst ratio", "best on", "within 5 % on", "lost"]
        headings += [f"RMS error, {word} [{METRICS[ERROR].unit}]" for word in short]
        headings += [f"chattering, {word} [×]" for word in short]
        rows = []
        for row in self.table["laws"]:
            means = [row["groups"][group][key] for key in (ERROR, CHATTERING) for group in groups]
            figures = [None if each is None else each["mean"] for each in means]
            place = [row[key] for key in ("law", "rank", "median_ratio", "worst_ratio", "wins", "within_5_percent")]
            rows.append([*place, len(row["lost"]), *figures])
        return Summary(headings, rows)

    def figure(self) -> Figure:
        """Draw mean error against mean chattering."""
        return pareto_picture(self.table)

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
            ".md": lambda path: as_markdown(self.table, _number).encode(),
            ".json": lambda path: as_json(self.table),
        }
        return {**super().files(), **own}


def _number(value: float | None) -> str:
    return "—" if value is None else str(written(value)).replace("<sup>", "^").replace("</sup>", "")
