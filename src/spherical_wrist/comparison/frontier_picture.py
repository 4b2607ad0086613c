"""Picture of a frontier: for each axis, one bar per law up to its first miss of the bound."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.frontier import Axis
from spherical_wrist.comparison.picture import BEATEN, FRONT
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import literal

COLUMNS = 2
NOTE = """One axis at a time; the experiment sets all else.
A bar ends at the first value that missed the bound;
no smaller tested value missed it.
Blue: law that holds the bound furthest."""


def frontier_picture(table: Mapping[str, Any], axes: Sequence[Axis]) -> Figure:
    """Draw one panel per axis with one bar per law, longest on top, over the logarithm of the deviation.

    Args:
        table: frontier as :func:`spherical_wrist.comparison.frontier_report.to_dict` returns it.
        axes: axes of the frontier.
    """
    rows = -(-len(axes) // COLUMNS)
    height = 0.9 + 0.19 * len(table["laws"])
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(5.2 * min(COLUMNS, len(axes)), height * rows + 0.5), layout="constrained")
        panels = drawing.subplots(rows, min(COLUMNS, len(axes)), squeeze=False).ravel()
        for panel, axis in zip(panels, axes, strict=False):
            _panel(panel, axis, table)
        for panel in panels[len(axes) :]:
            panel.set_axis_off()
            panel.text(0.5, 0.5, NOTE, ha="center", va="center", fontsize=8, color=BEATEN, transform=panel.transAxes)
        drawing.suptitle(f"where each law first exceeds {table['bound_mm']:g} mm of tip error", fontsize=10)
    return drawing


def _panel(panel: Axes, axis: Axis, table: Mapping[str, Any]) -> None:
    edges = {law["law"]: law["edges"][axis.name] for law in table["laws"]}
    scale, unit = axis.shown
    names = sorted(edges, key=lambda law: (edges[law]["found"] != CrossingStatus.NOMINAL, _deviation(edges[law], axis)))
    reached = [scale * _deviation(edges[name], axis) for name in names]
    start = 0.5 * min([scale * axis.first, *(value for value in reached if value > 0.0)])
    for place, (name, value) in enumerate(zip(names, reached, strict=True)):
        status = edges[name]["found"]
        end, colour = value, FRONT if value == reached[-1] else BEATEN
        shown = _short(scale * axis.nominal + value)
        if status == CrossingStatus.NOMINAL:
            end, shown, colour = start, "misses already at the nominal", BEATEN  # no bar
        panel.barh(place, end - start, left=start, height=0.62, color=colour, alpha=0.85)
        text = f"> {shown}" if status == CrossingStatus.NEVER else shown
        panel.annotate(text, (end, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=6.5)
    panel.set_yticks(range(len(names)), [literal(name.replace("_", " ")) for name in names], fontsize=7)
    panel.set(xscale="log", xlim=(start, 2.5 * max(*reached, 2.0 * start)), ylim=(-0.6, len(names) - 0.4))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_formatter("")  # minor labels would overlap
    panel.set_axisbelow(True)
    panel.set_xlabel(f"{axis.name}{f' − {axis.nominal:g}' if axis.nominal else ''} [{unit}]")
    panel.set_title(axis.meaning, fontsize=8.5)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)


def _deviation(edge: Mapping[str, Any], axis: Axis) -> float:
    """Return the deviation at the first miss, or the limit if there is none."""
    if edge["found"] == CrossingStatus.NEVER:
        return axis.limit
    return float(edge["misses"]) - axis.nominal


def _short(value: float) -> str:
    """Format a value with three digits, without an exponent."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"
