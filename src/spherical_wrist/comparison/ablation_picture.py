"""Picture of an ablation: a row for the law without each of its parts, and a panel for each figure."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.colours import GREY
from spherical_wrist.comparison.ablation import FIGURES, WHOLE
from spherical_wrist.comparison.ablation_table import row_name
from spherical_wrist.comparison.law_rows import (
    LawRows,
    columns_that_fit,
    law_rows,
    panel_widths,
    row_panels,
    rows_height,
)
from spherical_wrist.picture_axes import logarithmic
from spherical_wrist.picture_style import STYLE, WIDTHS

NARROWEST, MOST = 0.95, 7
"""Smallest width of a panel [in], and largest number of them side by side."""
HEAD = 0.04
"""Space above the first titles [in]."""


def ablation_picture(table: Mapping[str, Any], width: float = WIDTHS["two-column"]) -> Figure:
    """Draw a panel for each figure; a stem goes from the whole law's figure to that without a part. × is a lost run.

    Args:
        table: ablation as :func:`spherical_wrist.comparison.ablation_table.to_dict` returns it.
        width: width of the picture [in].
    """
    rows = law_rows({row_name(row): "user" if row["part"] is None else "rival" for row in table["rows"]}, width)
    columns = columns_that_fit(rows, width, NARROWEST, min(len(FIGURES), MOST))
    shares = [1.0] * -(-len(FIGURES) // -(-len(FIGURES) // columns))
    titles = [f"{figure.title} [{figure.unit}]" for figure in FIGURES]
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(width, HEAD + rows_height(rows, titles, width, shares)))
        panels = row_panels(drawing, rows, titles, HEAD, shares)
        for panel, figure in zip(panels, FIGURES, strict=True):
            values = {row_name(row): row[figure.name] for row in table["rows"]}
            _panel(panel, values, rows, panel_widths(rows, width, shares)[0], linear=figure.more)
    return drawing


def _panel(panel: Axes, values: Mapping[str, float | None], rows: LawRows, length: float, *, linear: bool) -> None:
    known = [value for value in values.values() if value is not None]
    if not linear and known:
        low, high = max(min(known), 1e-12), max(known)
        room = max((high / low) ** 0.12, 1.15)
        logarithmic(panel.xaxis, low / room, high * room, length)
    else:
        panel.set_xlim(0.0, 1.12 * max([*known, 1e-9]))
        panel.locator_params(axis="x", nbins=4)
    whole = values[WHOLE]
    if whole is not None:
        panel.axvline(whole, color=GREY, linewidth=0.6, zorder=1)
    for name, value in values.items():
        look, place = rows.looks[name], rows.places[name]
        if value is None:
            panel.plot(panel.get_xlim()[1], place, "x", color=look.colour, markersize=4.0, clip_on=False)
            continue
        if whole is not None:
            panel.plot([whole, value], [place, place], color=look.colour, linewidth=1.1, solid_capstyle="butt")
        panel.plot(value, place, "o", color=look.colour, markersize=4.0, zorder=look.order, clip_on=False)
