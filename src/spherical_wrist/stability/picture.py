"""Picture of margins: sensitivity and tip response over the frequency, and a row of figures for each law."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.colours import GREY
from spherical_wrist.comparison.law_rows import (
    LawRows,
    columns_that_fit,
    law_rows,
    one_column,
    panel_widths,
    row_panels,
    rows_height,
)
from spherical_wrist.picture_axes import logarithmic
from spherical_wrist.picture_style import SMALL, STYLE, WIDTHS

CLAIMED = 2.0
"""Sensitivity that a robust loop stays below (6 dB)."""
SHOWN = (
    ("worst_tip_error_mm", 1e3, "worst tip error [µm]"),
    ("max_sensitivity", 1.0, "largest sensitivity Ms"),
    ("delay_margin_s", 1e3, "delay margin [ms]"),
)
"""Figures of the rows: key in the JSON object, factor, title."""
BODE = 1.75
"""Height of the panels over the frequency [in]."""
NARROWEST = 0.45
"""Smallest width of the panels of figures [in]."""
LEFT, RIGHT, TOP, BELOW, BETWEEN = 0.5, 0.12, 0.24, 0.42, 0.62
"""Space around the panels over the frequency [in]."""


def margins_picture(table: Mapping[str, Any], width: float = WIDTHS["two-column"]) -> Figure:
    """Draw the margins of the laws that have a linear loop; the smallest worst tip error is on top.

    The colours of the rows are those of the lines. Where there are many laws, the lines of others are grey.

    Args:
        table: margins as :func:`spherical_wrist.stability.report.to_dict` returns them.
        width: width of the picture [in].
    """
    laws = sorted((law for law in table["laws"] if law["stable"]), key=lambda law: law["worst_tip_error_mm"])
    rows = law_rows({law["law"]: law["status"] for law in laws}, width, lines=True)
    columns = columns_that_fit(rows, width, NARROWEST, len(SHOWN))
    shares = [1.0] * columns
    titles = [title for *_, title in SHOWN]
    lines = 2 if one_column(width) else 1
    top = lines * (TOP + BODE + BELOW)
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(width, top + rows_height(rows, titles, width, shares)))
        sensitivity, tip = _over_frequency(drawing, lines)
        for law in laws:
            response, look = law["response"], rows.looks[law["law"]].line
            sensitivity.plot(response["frequency_hz"], response["sensitivity"], **look)
            tip.plot(response["frequency_hz"], response["tip_mm_per_Nm"], **look)
        size = (width - LEFT - RIGHT) if lines == 2 else 0.5 * (width - LEFT - RIGHT - BETWEEN)
        _finish(sensitivity, laws, "sensitivity", size)
        _finish(tip, laws, "tip_mm_per_Nm", size)
        sensitivity.axhline(CLAIMED, color=GREY, linewidth=0.8, linestyle="--", zorder=1)
        sensitivity.annotate(
            f"Ms = {CLAIMED:g}", (0.015, CLAIMED), xycoords=("axes fraction", "data"), xytext=(0, 2),
            textcoords="offset points", fontsize=SMALL, color=GREY,
        )  # fmt: skip
        for (key, factor, _), panel in zip(SHOWN, row_panels(drawing, rows, titles, top, shares), strict=True):
            figures = {law["law"]: None if law[key] is None else factor * law[key] for law in laws}
            _figures(panel, rows, figures, panel_widths(rows, width, shares)[0])
            if key == "max_sensitivity":
                panel.axvline(CLAIMED, color=GREY, linewidth=0.8, linestyle="--", zorder=1)
    return drawing


def _over_frequency(drawing: Figure, lines: int) -> list[Axes]:
    """Add the two panels over the frequency, side by side or below each other."""
    width, height = drawing.get_size_inches()
    size = (width - LEFT - RIGHT - (2 - lines) * BETWEEN) / (3 - lines)
    places = [(LEFT, TOP), (LEFT + (2 - lines) * (size + BETWEEN), TOP + (lines - 1) * (TOP + BODE + BELOW))]
    return [
        drawing.add_axes((left / width, 1.0 - (above + BODE) / height, size / width, BODE / height))
        for left, above in places
    ]


def _finish(panel: Axes, laws: list[Mapping[str, Any]], key: str, length: float) -> None:
    panel.set(xlabel="frequency [Hz]")
    frequencies = [value for law in laws for value in law["response"]["frequency_hz"]]
    largest = max((max(law["response"][key]) for law in laws), default=1.0)
    if key == "sensitivity":
        panel.set_title("sensitivity to torques at the input")
        low, high = 1e-3, 2.2 * max(largest, CLAIMED)
    else:
        panel.set_title("tip displacement by torques [mm/(N·m)]")
        low, high = 1e-4 * largest, 1.6 * largest
    logarithmic(panel.yaxis, low, high, BODE)
    logarithmic(panel.xaxis, min(frequencies, default=0.1), max(frequencies, default=500.0), length)


def _figures(panel: Axes, rows: LawRows, figures: Mapping[str, float | None], length: float) -> None:
    """Draw one figure of each law; a figure without an end is an arrow at the edge."""
    values = [value for value in figures.values() if value]
    low, high = min(values, default=1.0), max(values, default=1.0)
    start, stop = low / (high / low) ** 0.06 / 1.1, high * (high / low) ** 0.06 * 1.1
    logarithmic(panel.xaxis, start, stop, length)
    for label, value in figures.items():
        look, place = rows.looks[label], rows.places[label]
        at = stop if value is None else value or start
        panel.plot([start, at], [place, place], **{**look.line, "linewidth": 1.1})
        panel.plot(
            at, place, ">" if value is None else "o", color=look.colour, markersize=4.0, clip_on=False,
            markerfacecolor="white" if value is None else look.colour, zorder=look.order,
        )  # fmt: skip
