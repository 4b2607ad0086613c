"""Picture of a search: the Pareto front, and the gains on it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.colours import OWN, PALE
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.picture_axes import logarithmic, text_width, wrapped
from spherical_wrist.picture_style import FOR_ONE_COLUMN, SMALL, STYLE, TEXT, WIDTHS
from spherical_wrist.plain_text import literal

MARKERS, BOTH = {"precise": "^", "calm": "s"}, "*"
"""Markers of the trials that beat the default gains in one figure, and of one that does so in both."""
SIZES, ASIDE = {"^": 7.0, "s": 7.0, BOTH: 11.0}, {"^": -0.14, "s": 0.14, BOTH: 0.0}
"""By marker: its size on the front [pt], and its distance from the middle of a gain's row."""
WORDS = {"precise": ("more precise", "error"), "calm": ("calmer", "chattering")}
X, Y = "chattering_Nm_per_s", "rms_error_rad"
FURTHEST = 10.0
"""Points that are more times worse than the edges of the front are not shown."""
DEFAULT, FRONT = "#000000", OWN
HEIGHT, ROW = 2.6, 0.2
"""Height of the panel of the front, and of a row of gains [in]."""
LEFT, RIGHT, BELOW, BETWEEN, LINE = 0.72, 0.12, 0.4, 0.2, 0.14
"""Space around the panels, and height of a line of a legend [in]."""


def front_picture(table: Mapping[str, Any], width: float = WIDTHS["two-column"]) -> Figure:
    """Draw the error against the chattering of every trial, and the gains on the front beside or below it.

    Args:
        table: a search, by :func:`spherical_wrist.tuning.pareto.summary_of`.
        width: width of the picture [in].
    """
    stacked = width < FOR_ONE_COLUMN
    names = [each["name"].removeprefix("law.") for each in _varied(table)]
    name_width = max((text_width(name, SMALL) for name in names), default=0.0) + 0.08
    rows = max(ROW * len(names), ROW)
    whole = width - LEFT - RIGHT
    first = whole if stacked else 0.55 * (whole - name_width - BETWEEN)
    second = whole + LEFT - 0.06 - name_width if stacked else whole - first - name_width - BETWEEN
    with mpl.rc_context(STYLE):
        drawing = Figure()
        left, right = drawing.add_axes((0.1, 0.1, 0.4, 0.8)), drawing.add_axes((0.6, 0.1, 0.3, 0.8))
        _front(left, table, first)
        _gains(right, table, second)
        legends = [handles for handles in (_points(left), _bars(table)) if handles]
        lines = [len(handles) for handles in (_points(left), _bars(table))]
        title = (
            f"{table['law']['name']}: {table['trials']} sets of gains, geometric means over {len(table['cases'])} cases"
        )
        words = wrapped(title, TEXT, width - 0.12, bold=True)
        head = 0.1 + LINE * len(words)
        above = [head + LINE * lines[0], LINE * lines[1] + (0.1 if stacked else head)]
        if stacked:
            height = above[0] + HEIGHT + BELOW + above[1] + rows + BELOW
            places = [(LEFT, above[0], first, HEIGHT), (0.06 + name_width, height - BELOW - rows, second, rows)]
        else:
            rows = max(rows, HEIGHT + above[0] - above[1])
            height = above[1] + rows + BELOW
            across = LEFT + first + BETWEEN + name_width
            places = [(LEFT, above[0], first, height - BELOW - above[0]), (across, above[1], second, rows)]
        drawing.set_size_inches(width, height)
        for panel, (x, y, wide, high) in zip((left, right), places, strict=True):
            panel.set_position((x / width, 1.0 - (y + high) / height, wide / width, high / height))
        for panel, handles in zip((left, right), legends, strict=False):
            panel.legend(
                handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0, borderpad=0.3,
                labelspacing=0.25, handlelength=1.2, handletextpad=0.5,
            )  # fmt: skip
        drawing.text(0.06 / width, 1.0 - 0.06 / height, "\n".join(map(literal, words)), va="top", weight="bold")
    return drawing


def _front(panel: Axes, table: Mapping[str, Any], length: float) -> None:
    front, default = table["front"], table["default"]
    panel.set(xlabel=METRICS[X].label_and_unit, ylabel=METRICS[Y].label_and_unit)
    marks = [*front, *([default] if default[X] is not None else [])]
    if not marks:
        panel.text(0.5, 0.5, "no gains completed every case", ha="center", transform=panel.transAxes)
        return
    largest = {key: FURTHEST * max(point[key] for point in marks) for key in (X, Y)}
    others = [point for point in table["others"] if all(point[key] < largest[key] for key in (X, Y))]
    for key, axis, size in ((X, panel.xaxis, length), (Y, panel.yaxis, HEIGHT)):
        values = [point[key] for point in (*marks, *others)]
        logarithmic(axis, 0.88 * min(values), 1.14 * max(values), size)
    _dots(panel, others, "o", color=PALE, markersize=2.5, markeredgewidth=0.0, label="other gains")
    _dots(
        panel, front, "o", color=FRONT, drawstyle="steps-post", linestyle="-", linewidth=1.0, markersize=3.5,
        label="Pareto front: none is better in both",
    )  # fmt: skip
    if default[X] is not None:
        look: dict[str, Any] = {"color": DEFAULT, "linewidth": 0.6, "linestyle": "--", "zorder": 1}
        panel.axvline(default[X], **look)
        panel.axhline(default[Y], **look)
        _dots(
            panel, [default], "D", color=DEFAULT, markersize=5.0, markerfacecolor="white", markeredgewidth=1.2,
            label="default gains",
        )  # fmt: skip
    for choice in _choices(table):
        mark: dict[str, Any] = {
            "color": FRONT,
            "markersize": SIZES[choice.marker],
            "markeredgecolor": "white",
            "zorder": 4,
        }
        _dots(panel, [choice.point], choice.marker, label=choice.label, **mark)


def _dots(panel: Axes, points: list[Mapping[str, Any]], marker: str, **look: Any) -> None:
    if points:
        given = {"linestyle": "", **look}
        panel.plot([point[X] for point in points], [point[Y] for point in points], marker=marker, **given)


def _points(panel: Axes) -> list[Any]:
    """Return a legend entry of the panel of the front."""
    return [line for line in panel.get_lines() if not str(line.get_label()).startswith("_")]


class Choice(NamedTuple):
    """Trial that beats the default gains in one figure without losing in the other, or in both.

    Attributes:
        marker: its marker.
        point: the trial.
        name: name in short.
        label: name and figures.
    """

    marker: str
    point: Mapping[str, Any]
    name: str
    label: str


def _choices(table: Mapping[str, Any]) -> list[Choice]:
    """Return the trials that the picture names: none, one or two."""
    named: dict[int, list[str]] = {}
    for key in MARKERS:
        if table[key]:  # 0 is the default
            named.setdefault(table[key], []).append(key)
    found = []
    for point in table["front"]:
        keys = named.get(point["trial"], [])
        if keys:
            words = " and ".join(WORDS[key][0] for key in keys)
            figures = ", ".join(f"{WORDS[key][1]} × {point[f'{WORDS[key][1]}_ratio']:.2g}" for key in keys)
            marker = MARKERS[keys[0]] if len(keys) == 1 else BOTH
            found.append(Choice(marker, point, f"the {words} trial", f"trial {point['trial']}, {words}: {figures}"))
    return sorted(found, key=lambda choice: choice.marker != MARKERS["precise"])


def _varied(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the gains that have a row: those whose ratio to the default makes sense."""
    return [each for each in table["parameters"] if each["default"] > 0.0 and each["low"] > 0.0]


def _gains(panel: Axes, table: Mapping[str, Any], length: float) -> None:
    """Draw a row for each gain, as a multiple of its default: range, middle half of the front, named trials."""
    shown = _varied(table)
    seen = [1.0]
    for row, each in enumerate(shown):
        factors = [point["values"][each["name"]] / each["default"] for point in table["front"]]
        ends = each["low"] / each["default"], each["high"] / each["default"]
        seen += [*ends, *factors]
        panel.plot(ends, (row, row), color=PALE, alpha=0.6, linewidth=5.0, solid_capstyle="butt")
        if factors:
            middle = np.quantile(factors, (0.25, 0.75))
            panel.plot(middle, (row, row), color=FRONT, alpha=0.45, linewidth=5.0, solid_capstyle="butt")
        for choice in _choices(table):
            factor = choice.point["values"][each["name"]] / each["default"]
            look: dict[str, Any] = {
                "color": FRONT,
                "markersize": 0.75 * SIZES[choice.marker],
                "markeredgecolor": "white",
                "zorder": 4,
            }
            panel.plot(factor, row + ASIDE[choice.marker], choice.marker, **look)
    panel.axvline(1.0, color=DEFAULT, linewidth=0.6, linestyle="--", zorder=1)
    panel.set_yticks(range(len(shown)), [each["name"].removeprefix("law.") for each in shown])
    panel.set(xlabel="gain [× default]", ylim=(len(shown) - 0.4, -0.6))
    logarithmic(panel.xaxis, 0.95 * min(seen), 1.05 * max(seen), length)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)


def _bars(table: Mapping[str, Any]) -> list[Line2D]:
    """Return a legend entry of the panel of gains."""
    entries = []
    if _varied(table):
        entries.append(Line2D([], [], color=PALE, alpha=0.6, linewidth=5.0, label="range that was searched"))
        if table["front"]:
            entries.append(Line2D([], [], color=FRONT, alpha=0.45, linewidth=5.0, label="middle half of the front"))
        entries += [
            Line2D([], [], color=FRONT, linestyle="", marker=choice.marker, markersize=5.0, label=choice.name)
            for choice in _choices(table)
        ]
    return entries
