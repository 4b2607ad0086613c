"""View of a campaign's stored episodes."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from spherical_wrist.api.sweep import CampaignResults
from spherical_wrist.api.view import Content, View, as_json
from spherical_wrist.campaign.summary import FIGURES, QUANTILES
from spherical_wrist.measure.bound import BOUND
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.picture_style import FOR_ONE_COLUMN, STYLE, law_looks
from spherical_wrist.plain_text import literal
from spherical_wrist.report.findings import findings
from spherical_wrist.report.page import page
from spherical_wrist.result_table import Column, ResultTable

HEIGHT = 2.7
"""Height of a panel [in]."""


class CampaignView(View[CampaignResults]):
    """View of a campaign: quantiles of the errors by law, their distributions, and a row for each episode."""

    keys = ("law", "sample")

    @cached_property
    def laws(self) -> list[dict[str, Any]]:
        """Summary of each law."""
        return self.result.summary()

    def summary(self) -> ResultTable:
        """Return episodes by outcome, and median and 95 % of the errors of those that completed."""
        quantiles = {"median": str(QUANTILES[0]), "95 %": str(QUANTILES[1])}
        figures = [(METRICS[name], word) for name in FIGURES for word in quantiles]
        columns = [Column("law", text=True), Column("episodes"), Column("not completed")]
        columns += [Column(f"{metric.label}, {word}", metric.shown_unit) for metric, word in figures]
        rows = [
            [
                law["law"],
                law["episodes"],
                law["episodes"] - law["completed"],
                *(metric.shown_value(law[metric.name].get(quantiles[word])) for metric, word in figures),
            ]
            for law in self.laws
        ]
        return ResultTable(self.result.headline(), columns, rows)

    def figure(self) -> Figure:
        """Draw the shares of episodes up to each error, by law; those that did not complete are beyond all."""
        episodes, bases = self.result.episodes, self.result.campaign.bases
        looks = law_looks({label: base.law.status for label, base in bases.items()}, lines=True)
        with mpl.rc_context(STYLE):
            beside = 1 if self.width < FOR_ONE_COLUMN else len(FIGURES)
            below = -(-len(FIGURES) // beside)
            drawing = Figure(figsize=(self.width, HEIGHT * below), layout="constrained")
            for panel, name in zip(drawing.subplots(below, beside, squeeze=False).flat, FIGURES, strict=True):
                for law in self.laws:
                    query = f"SELECT {name} AS value FROM episodes WHERE law = ? AND outcome = 'completed'"
                    values = np.sort(episodes.arrays(query, [law["law"]])["value"])
                    shares = np.arange(1, len(values) + 1) / law["episodes"]
                    look, label = looks[law["law"]].line, literal(law["law"])
                    panel.step(values, shares, where="post", label=label, **look)
                panel.set(xscale="log", xlabel=METRICS[name].label_and_unit, ylim=(0.0, 1.02))
                if METRICS[name].unit == "mm":
                    panel.axvline(BOUND, color="0.3", linewidth=0.9, linestyle="--")
                panel.set_ylabel("share of episodes up to it")
            drawing.axes[-1].legend(loc="best")
        return drawing

    def rows(self) -> list[dict[str, Any]]:
        """Return the episodes in order."""
        return list(self.result.episodes.in_order())

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return the report page, tables, JSON and pictures."""
        own: dict[str, Callable[[Path], Content]] = {
            ".html": lambda path: page(*findings(self.result.folder, BOUND)).encode(),
            ".json": lambda path: as_json(self.laws),
        }
        return {**super().files(), **own}
