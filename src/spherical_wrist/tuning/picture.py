"""Picture of a search: the Pareto front, and the gains on it."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from spherical_wrist.comparison.picture import BEATEN, FAILED, FRONT, LABEL_SIZE
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import literal

MARKERS = {"precise": "^", "calm": "s"}
WORDS = {"precise": "more precise", "calm": "calmer"}
X, Y = "chattering_Nm_per_s", "rms_error_rad"
FURTHEST = 10.0
"""Points that are more times worse than the edges of the front are not shown."""


def front_picture(table: Mapping[str, Any]) -> Figure:
    """Draw the error against the chattering of every trial, and beside it the gains on the front.

    Args:
        table: a search, by :func:`spherical_wrist.tuning.pareto.summary_of`.
    """
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(9.6, 4.6), layout="constrained")
        left, right = drawing.subplots(1, 2, width_ratios=(3.0, 2.0))
        _front(left, table)
        _gains(right, table)
        law, cases = literal(table["law"]["name"].replace("_", " ")), len(table["cases"])
        right.legend(handles=_legend(), fontsize=LABEL_SIZE, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        drawing.suptitle(f"{law}: {table['trials']} sets of gains, each on {cases} cases", fontsize=10)
    return drawing


def _front(panel: Axes, table: Mapping[str, Any]) -> None:
    front, default = table["front"], table["default"]
    panel.set(
        xscale="log", yscale="log", xlabel=f"{METRICS[X].label_and_unit}, geometric mean over the cases",
        ylabel=f"{METRICS[Y].label_and_unit}, geometric mean",
    )  # fmt: skip
    marks = [*front, *([default] if default[X] is not None else [])]
    if not marks:
        panel.text(0.5, 0.5, "no gains completed every case", ha="center", transform=panel.transAxes)
        return
    largest = [FURTHEST * max(point[key] for point in marks) for key in (X, Y)]
    others = [point for point in table["others"] if point[X] < largest[0] and point[Y] < largest[1]]
    panel.plot(
        [point[X] for point in others], [point[Y] for point in others], "o", color=BEATEN, alpha=0.45, markersize=3.0,
        markeredgewidth=0.0, label="other gains that were tried",
    )  # fmt: skip
    panel.plot(
        [point[X] for point in front], [point[Y] for point in front], "o", color=FRONT, drawstyle="steps-post",
        linestyle="-", linewidth=1.0, markersize=4.5, label="Pareto front: none is better in both",
    )  # fmt: skip
    if default[X] is not None:
        panel.plot(
            default[X], default[Y], "D", color=FAILED, markersize=7.0, markerfacecolor="white", markeredgewidth=1.6,
            label="default gains",
        )  # fmt: skip
        panel.axvline(default[X], color=FAILED, linewidth=0.7, alpha=0.5, zorder=0)
        panel.axhline(default[Y], color=FAILED, linewidth=0.7, alpha=0.5, zorder=0)
    for key, marker in MARKERS.items():
        for point in _chosen(table, key):
            figure = "error" if key == "precise" else "chattering"
            label = f"trial {point['trial']}, {WORDS[key]}: {figure} × {point[f'{figure}_ratio']:.2g}"
            panel.plot(
                point[X], point[Y], marker, color=FRONT, markersize=8.0, markeredgecolor="white", linestyle="",
                label=label,
            )  # fmt: skip
    panel.legend(fontsize=LABEL_SIZE, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    _ticks(panel.xaxis, panel.get_xlim())
    _ticks(panel.yaxis, panel.get_ylim())


def _chosen(table: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """Return the trial that beats the default gains in one figure without losing in the other, if there is one."""
    return [point for point in table["front"] if point["trial"] == table[key] and point["trial"] != 0]


def _ticks(axis: Axis, ends: tuple[float, float]) -> None:
    """Label a logarithmic axis with plain numbers, and enough of them on a short one."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)) if ends[1] > 4.0 * ends[0] else MaxNLocator(5))
    axis.set_major_formatter(lambda value, _: f"{value:g}" if value >= 1e-3 else f"{value:.2g}")
    axis.set_minor_formatter(NullFormatter())


def _gains(panel: Axes, table: Mapping[str, Any]) -> None:
    """Draw a row for each gain, as a multiple of its default: range, middle half of the front, named trials."""
    shown = [each for each in table["parameters"] if each["default"] > 0.0 and each["low"] > 0.0]
    for row, each in enumerate(shown):
        factors = [point["values"][each["name"]] / each["default"] for point in table["front"]]
        ends = each["low"] / each["default"], each["high"] / each["default"]
        panel.plot(ends, (row, row), color=BEATEN, alpha=0.3, linewidth=6.0, solid_capstyle="butt")
        if factors:
            panel.plot(np.quantile(factors, (0.25, 0.75)), (row, row), color=FRONT, alpha=0.4, linewidth=6.0,
                       solid_capstyle="butt")  # fmt: skip
        for (key, marker), aside in zip(MARKERS.items(), (-0.12, 0.12), strict=True):
            factors = [point["values"][each["name"]] / each["default"] for point in _chosen(table, key)]
            panel.plot(
                factors, [row + aside] * len(factors), marker, color=FRONT, markersize=6.0, markeredgecolor="white"
            )
    panel.axvline(1.0, color=FAILED, linewidth=1.0)
    panel.set_yticks(range(len(shown)), [each["name"].removeprefix("law.") for each in shown])
    panel.set(xscale="log", xlabel="gain [× default]", ylim=(len(shown) - 0.4, -0.6))
    _ticks(panel.xaxis, panel.get_xlim())
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)


def _legend() -> list[Line2D]:
    bars = (("searched", BEATEN, 0.3), ("middle half of the front", FRONT, 0.4))
    return [
        *(Line2D([], [], color=colour, alpha=alpha, linewidth=6.0, label=label) for label, colour, alpha in bars),
        *(
            Line2D([], [], color=FRONT, linestyle="", marker=marker, markersize=6.0, label=f"the {WORDS[key]} trial")
            for key, marker in MARKERS.items()
        ),
    ]
