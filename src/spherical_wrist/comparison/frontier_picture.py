"""Picture of a frontier: a row for each law and a panel for each axis, with the first value that missed a bound."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.colours import GREY
from spherical_wrist.comparison.bounds import statement
from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.frontier_report import OUTCOME
from spherical_wrist.comparison.law_rows import (
    LawRows,
    columns_that_fit,
    draw_key,
    key_height,
    law_rows,
    one_column,
    panel_widths,
    row_panels,
    rows_height,
)
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.picture_axes import logarithmic, text_width
from spherical_wrist.picture_style import SMALL, STYLE, WIDTHS
from spherical_wrist.plain_text import literal

OF_BOUNDS = "osD^v"
"""Markers of the bounds that are missed, in their order."""
NARROWEST, MOST = 0.6, 6
"""Smallest width of a panel [in], and largest number of them side by side."""
PAGE = 8.5
"""Height from which a picture of one column has numbers in place of names, so that it fits a page [in]."""
HEAD, LINE = 0.06, 0.15
"""Height of the legend without its lines, and of each line [in]."""


class Mark(NamedTuple):
    """Marker at the end of a row.

    Attributes:
        sign: marker of Matplotlib.
        filled: False for an outline.
        meaning: what it stands for.
    """

    sign: str
    filled: bool
    meaning: str


def frontier_picture(table: Mapping[str, Any], axes: Sequence[Axis], width: float = WIDTHS["two-column"]) -> Figure:
    """Draw a panel for each axis, with the laws in the order of the table in all of them, best on top.

    Args:
        table: frontier as :func:`spherical_wrist.comparison.frontier_report.to_dict` returns it.
        axes: axes of the frontier.
        width: width of the picture [in].
    """
    statuses = {law["law"]: law["status"] for law in table["laws"]}
    titles = [f"{axis.name} [{axis.shown[1]}]" for axis in axes]
    rows = law_rows(statuses, width)
    shares = _shares(rows, width, len(axes))
    size = rows_height(rows, titles, width, shares)
    numbered = one_column(width) and size > PAGE
    if numbered:
        rows = law_rows(statuses, width, numbered=True)
        shares = _shares(rows, width, len(axes))
        size = rows_height(rows, titles, width, shares) + key_height(rows, width)
    with mpl.rc_context(STYLE):
        handles = _legend(table, axes)
        side_by_side = _fitting(handles, width)
        head = HEAD + LINE * -(-len(handles) // side_by_side)
        drawing = Figure(figsize=(width, head + size))
        panels = row_panels(drawing, rows, titles, head, shares)
        for panel, axis in zip(panels, axes, strict=True):
            edges = {law["law"]: law["edges"][axis.name] for law in table["laws"]}
            _panel(panel, axis, edges, rows, panel_widths(rows, width, shares)[0], table["bounds"])
        if numbered:
            draw_key(drawing, rows)
        drawing.legend(
            handles=handles, loc="upper right", ncols=side_by_side, fontsize=SMALL, borderpad=0.3, handletextpad=0.1,
            columnspacing=1.0, labelspacing=0.2, borderaxespad=0.3,
        )  # fmt: skip
    return drawing


def _shares(rows: LawRows, width: float, axes: int) -> list[float]:
    """Return the relative widths of panels side by side: as many in the last line as in the others."""
    columns = columns_that_fit(rows, width, NARROWEST, min(axes, MOST))
    return [1.0] * -(-axes // -(-axes // columns))


def _mark(edge: Mapping[str, Any], bounds: Mapping[str, float]) -> Mark:
    if edge["found"] == CrossingStatus.NEVER:
        return Mark(">", False, "no miss up to here")
    if edge["found"] == CrossingStatus.NOMINAL:
        return Mark("x", True, "the nominal wrist misses")
    if edge["by"] == OUTCOME:
        return Mark("X", True, "run lost")
    place = list(bounds).index(edge["by"])
    return Mark(OF_BOUNDS[place % len(OF_BOUNDS)], True, "misses " + statement(edge["by"], bounds[edge["by"]]))


def _legend(table: Mapping[str, Any], axes: Sequence[Axis]) -> list[Line2D]:
    """Return an entry for each marker that is in the picture."""
    found = [_mark(law["edges"][axis.name], table["bounds"]) for law in table["laws"] for axis in axes]
    return [
        Line2D([], [], linestyle="", marker=mark.sign, color=GREY, markersize=4.0, label=literal(mark.meaning),
               markerfacecolor=GREY if mark.filled else "white")
        for mark in sorted(set(found), key=lambda mark: "".join([*OF_BOUNDS, "X", ">", "x"]).index(mark.sign))
    ]  # fmt: skip


def _fitting(handles: Sequence[Line2D], width: float) -> int:
    """Return the number of entries of a legend that fit side by side."""
    widest = max(text_width(str(handle.get_label()), SMALL) for handle in handles) + 0.35
    return max(1, min(len(handles), int(width // widest)))


def _panel(
    panel: Axes,
    axis: Axis,
    edges: Mapping[str, Mapping[str, Any]],
    rows: LawRows,
    width: float,
    bounds: Mapping[str, float],
) -> None:
    scale, _ = axis.shown
    ends = {label: scale * _value(edge, axis) for label, edge in edges.items()}
    base = scale * axis.base
    start = base or 0.5 * min([scale * axis.first, *(end for end in ends.values() if end > 0.0)])
    if axis.downwards:
        logarithmic(panel.xaxis, min(*ends.values(), 0.5 * start) / 1.15, start, width)
        panel.invert_xaxis()
    else:
        logarithmic(panel.xaxis, start, 1.15 * max(*ends.values(), 2.0 * start), width)
    for label, edge in edges.items():
        place, look, mark = rows.places[label], rows.looks[label], _mark(edge, bounds)
        at = start if edge["found"] == CrossingStatus.NOMINAL else ends[label]
        panel.plot([start, at], [place, place], color=look.colour, linewidth=1.1, solid_capstyle="butt")
        panel.plot(
            at, place, mark.sign, color=look.colour, markerfacecolor=look.colour if mark.filled else "white",
            markersize=min(4.0, 36.0 * rows.row), clip_on=False, zorder=look.order,
        )  # fmt: skip


def _value(edge: Mapping[str, Any], axis: Axis) -> float:
    """Return the value at the first miss, or the last one if there is none."""
    return axis.limit if edge["found"] == CrossingStatus.NEVER else float(edge["misses"])
