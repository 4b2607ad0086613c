"""Picture of a frontier: for each axis, one bar per law up to its first miss of the bound."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.comparison.bounds import statement
from spherical_wrist.comparison.crossing import CrossingStatus
from spherical_wrist.comparison.picture import BEATEN, FRONT
from spherical_wrist.experiment.axes import Axis
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import literal

COLUMNS = 2
NOTE = """One axis at a time; the experiment sets all else.
A bar ends at the first value that missed a bound;
no smaller tested value missed it.
Blue: law that holds the bounds furthest."""


def frontier_picture(table: Mapping[str, Any], axes: Sequence[Axis]) -> Figure:
    """Draw one panel per axis with one bar per law, longest on top, over the logarithm of the value.

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
        bounds = " or ".join(statement(name, bound) for name, bound in table["bounds"].items())
        drawing.suptitle(f"where each law first exceeds {bounds}", fontsize=10)
    return drawing


def _panel(panel: Axes, axis: Axis, table: Mapping[str, Any]) -> None:
    edges = {law["law"]: law["edges"][axis.name] for law in table["laws"]}
    scale, unit = axis.shown
    names = sorted(edges, key=lambda law: (edges[law]["found"] != CrossingStatus.NOMINAL, _deviation(edges[law], axis)))
    reached = [scale * axis.value(_deviation(edges[name], axis)) for name in names]
    # a logarithm has no zero: there, bars begin below the first value
    start = scale * axis.base or 0.5 * min([scale * axis.first, *(value for value in reached if value > 0.0)])
    for place, (name, value) in enumerate(zip(names, reached, strict=True)):
        status = edges[name]["found"]
        end, colour = value, FRONT if value == reached[-1] else BEATEN
        shown = _short(value)
        if status == CrossingStatus.NOMINAL:
            end, shown, colour = start, "misses already at the nominal", BEATEN  # no bar
        panel.barh(place, end - start, left=start, height=0.62, color=colour, alpha=0.85)
        text = f"{'<' if axis.downwards else '>'} {shown}" if status == CrossingStatus.NEVER else shown
        panel.annotate(text, (end, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=6.5)
    panel.set_yticks(range(len(names)), [literal(name.replace("_", " ")) for name in names], fontsize=7)
    far = max([axis.deviation(value / scale) for value in reached] + [axis.first])
    panel.set(xscale="log", xlim=_limits(axis, start, scale * axis.value(far)), ylim=(-0.6, len(names) - 0.4))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_formatter("")  # minor labels would overlap
    panel.set_axisbelow(True)
    panel.set_xlabel(f"{axis.name.replace('_', ' ')} [{unit}]")
    panel.set_title(axis.meaning.partition(",")[0], fontsize=8.5)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)


def _limits(axis: Axis, start: float, furthest: float) -> tuple[float, float]:
    """Return the ends of a panel: room for the figure at the longest bar, which goes to the right also downwards."""
    ratio = max(furthest / start, start / furthest, 1.05)
    return start, start / ratio**1.35 if axis.downwards else start * ratio**1.35


def _deviation(edge: Mapping[str, Any], axis: Axis) -> float:
    """Return the deviation at the first miss, or the largest one if there is none."""
    if edge["found"] == CrossingStatus.NEVER:
        return axis.span
    return axis.deviation(float(edge["misses"]))


def _short(value: float) -> str:
    """Format a value with three digits, without an exponent."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"
