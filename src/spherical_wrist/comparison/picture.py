"""Picture of a comparison: a row for each law, with its errors relative to the best law, and its chattering."""

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from spherical_wrist.colours import GREY
from spherical_wrist.comparison.law_rows import LawRows, law_rows, one_column, panel_widths, row_panels, rows_height
from spherical_wrist.comparison.report import CHATTERING, heading
from spherical_wrist.picture_axes import logarithmic, text_width
from spherical_wrist.picture_style import SMALL, STYLE, WIDTHS

HEAD, LINE = 0.06, 0.15
"""Height of the legend without its lines, and of each line [in]."""
SHARES = (2.0, 1.2, 0.8)
"""Relative widths of the panels."""
ROOM = 0.08
"""Part of an axis beyond the last figure, for the marks of lost runs."""
CASE: dict[str, Any] = {"marker": ".", "markersize": 4.5, "markeredgewidth": 0.0, "alpha": 0.45, "linestyle": ""}
MEDIAN: dict[str, Any] = {"marker": "o", "markersize": 4.0, "linestyle": ""}
WORST: dict[str, Any] = {"marker": "|", "markersize": 6.0, "markeredgewidth": 1.2, "linestyle": ""}
LOST: dict[str, Any] = {"marker": "x", "markersize": 4.0, "markeredgewidth": 1.1, "linestyle": ""}
INTERVAL: dict[str, Any] = {"linewidth": 1.8, "solid_capstyle": "butt"}


def comparison_picture(table: Mapping[str, Any], width: float = WIDTHS["two-column"]) -> Figure:
    """Draw the laws in the order of their ranks, best on top.

    The first panel has the combined error relative to the best law: of each case, its median with the interval, and the
    worst of all runs. The second has the chattering relative to plain computed torque, as geometric mean and range over
    the cases of the last group. The third, which a picture of one column leaves out, counts the cases within 5 % of the
    best law, and those that were lost.

    Args:
        table: comparison as :func:`spherical_wrist.comparison.report.to_dict` returns it.
        width: width of the picture [in].
    """
    rows = law_rows({law["law"]: law["status"] for law in table["laws"]}, width)
    group = list(table["laws"][0]["groups"])[-1]
    titles = [
        "error [× best law]",
        heading(CHATTERING),
        f"cases of {len(table['cases'])}: best or within 5 %",
    ][: 2 if one_column(width) else 3]
    shares = SHARES[: len(titles)]
    sizes = panel_widths(rows, width, shares)
    with mpl.rc_context(STYLE):
        handles = _legend(table)
        columns = max(1, int(width // (max(text_width(str(each.get_label()), SMALL) for each in handles) + 0.3)))
        head = HEAD + LINE * -(-len(handles) // columns)
        drawing = Figure(figsize=(width, head + rows_height(rows, titles, width, shares)))
        error, chattering, *counts = row_panels(drawing, rows, titles, head, shares)
        _errors(error, table, rows, sizes[0])
        _chattering(chattering, table["laws"], group, rows, sizes[1])
        for panel in counts:
            _counts(panel, table["laws"], len(table["cases"]), rows)
        drawing.legend(
            handles=handles, loc="upper right", ncols=min(columns, len(handles)), fontsize=SMALL, borderpad=0.3,
            handlelength=1.2, handletextpad=0.4, columnspacing=1.0, labelspacing=0.2, borderaxespad=0.3,
        )  # fmt: skip
    return drawing


def _legend(table: Mapping[str, Any]) -> list[Line2D]:
    """Return an entry for each kind of mark that is in the picture."""
    cases = len(table["cases"])
    entries = []
    if cases > 1:
        entries.append(Line2D([], [], color=GREY, label="a case", **{**CASE, "markersize": 6.0}))
    bars = any(_interval(law)[0] < _interval(law)[1] for law in table["laws"])
    line = {**MEDIAN, **INTERVAL, "linestyle": "-"} if bars else MEDIAN
    words = "median" if cases > 1 else "the case"
    entries.append(Line2D([], [], color=GREY, label=f"{words}, interval of 95 %" if bars else words, **line))
    entries.append(Line2D([], [], color=GREY, label="worst run", **WORST))
    if any(law["lost_runs"] for law in table["laws"]):
        entries.append(Line2D([], [], color=GREY, label="a run was lost", **LOST))
    return entries


def _interval(law: Mapping[str, Any]) -> tuple[float, float]:
    low, high = (inf if end is None else end for end in law["median_interval_95"])
    return low, high


def _errors(panel: Axes, table: Mapping[str, Any], rows: LawRows, length: float) -> None:
    by_law: dict[str, list[float]] = {law["law"]: [] for law in table["laws"]}
    for standing in table["standings"]:
        if standing["ratio"] is not None:
            by_law[standing["law"]].append(standing["ratio"])
    worst = [law["worst_ratio"] for law in table["laws"] if law["worst_ratio"] is not None]
    highest = max([1.0, *worst, *(ratio for ratios in by_law.values() for ratio in ratios)]) * 1.05
    lowest, edge = _ends(1.0 / 1.05, highest)
    logarithmic(panel.xaxis, lowest, edge, length)
    panel.axvline(1.0, color=GREY, linewidth=0.6, zorder=1)
    for law in table["laws"]:
        look, place = rows.looks[law["law"]], rows.places[law["law"]]
        given: dict[str, Any] = {"color": look.colour, "zorder": look.order}
        ratios = by_law[law["law"]]
        if len(table["cases"]) > 1:
            panel.plot(ratios, [place] * len(ratios), **given, **CASE)
        low, high = (min(end, edge) for end in _interval(law))
        panel.plot([low, high], [place, place], **{**given, **INTERVAL})
        if law["median_ratio"] is not None:
            panel.plot(law["median_ratio"], place, **given, **MEDIAN)
        if law["worst_ratio"] is not None:
            panel.plot(law["worst_ratio"], place, **given, **WORST)
        if law["lost_runs"]:
            panel.plot(edge, place, clip_on=False, **given, **LOST)


def _chattering(panel: Axes, laws: Sequence[Mapping[str, Any]], group: str, rows: LawRows, length: float) -> None:
    spreads = {law["law"]: law["groups"][group][CHATTERING] for law in laws}
    found = [spread for spread in spreads.values() if spread is not None]
    lowest = min([1.0, *(spread["smallest"] for spread in found)])
    highest = max([1.5, *(spread["largest"] for spread in found)])
    logarithmic(panel.xaxis, *_ends(lowest, highest), length)
    panel.axvline(1.0, color=GREY, linewidth=0.6, zorder=1)
    for label, spread in spreads.items():
        if spread is None:
            continue
        look, place = rows.looks[label], rows.places[label]
        given: dict[str, Any] = {"color": look.colour, "zorder": look.order}
        panel.plot([spread["smallest"], spread["largest"]], [place, place], linewidth=0.9, **given)
        panel.plot(spread["mean"], place, **given, **MEDIAN)


def _counts(panel: Axes, laws: Sequence[Mapping[str, Any]], cases: int, rows: LawRows) -> None:
    for law in laws:
        look, place, close = rows.looks[law["law"]], rows.places[law["law"]], law["within_5_percent"]
        panel.plot([0, close], [place, place], color=look.colour, linewidth=1.1, solid_capstyle="butt")
        panel.plot(close, place, color=look.colour, zorder=look.order, clip_on=False, **MEDIAN)
        if law["lost"]:
            panel.plot(len(law["lost"]), place, color=look.colour, zorder=look.order, clip_on=False, **LOST)
    panel.set_xlim(0, max(cases, 1))
    panel.xaxis.set_major_locator(MaxNLocator(4, integer=True))


def _ends(low: float, high: float) -> tuple[float, float]:
    """Return the ends of a logarithmic axis with some room beyond its figures."""
    return low / (high / low) ** (0.5 * ROOM), high * (high / low) ** ROOM
