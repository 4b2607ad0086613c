"""Picture of a comparison: error against chattering."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.colours import BLUE, GREY, VERMILION
from spherical_wrist.comparison.report import CHATTERING, ERROR
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import literal

FRONT, BEATEN, FAILED = BLUE, GREY, VERMILION
LABEL_SIZE, GAP = 7.5, 0.055
"""Font size of the labels beside a panel, and their smallest distance as a fraction of its height."""


class Mark(NamedTuple):
    """Marker of a law in a panel."""

    x: float
    y: float
    text: str
    colour: str


def pareto_picture(table: Mapping[str, Any]) -> Figure:
    """Draw mean error against mean chattering, one panel per group of cases, one marker per law.

    Args:
        table: comparison as :func:`spherical_wrist.comparison.report.to_dict` returns it.
    """
    groups = list(table["laws"][0]["groups"])
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(5.6 * len(groups), 4.8), layout="constrained")
        panels = drawing.subplots(1, len(groups), squeeze=False, sharex=True, sharey=True)[0]
        marks = [_panel(panel, table, group) for panel, group in zip(panels, groups, strict=True)]
        panels[0].set_xlim(*_at_least(panels[0].get_xlim(), 0.5, 5.0))
        drawing.draw_without_rendering()  # sets the final limits
        for panel, shown in zip(panels, marks, strict=True):
            if shown:
                _label(panel, shown)
        panels[0].set_ylabel(METRICS[ERROR].label_and_unit)
        handles = _legend(any(row["lost"] for row in table["laws"]))
        drawing.legend(
            handles=handles, loc="outside lower center", ncols=1 if len(groups) == 1 else 4, fontsize=LABEL_SIZE
        )
    return drawing


def _legend(failures: bool) -> list[Line2D]:
    looks = [
        ("o", FRONT, FRONT, "no law is better in both (Pareto front)"),
        ("o", BEATEN, BEATEN, "another law is better in both"),
        ("o", FAILED, "white", "lost on some cases"),
        ("_", BEATEN, BEATEN, "mark: geometric mean over the cases; lines: their range"),
    ]
    return [
        Line2D([], [], linestyle="", marker=marker, color=colour, markerfacecolor=fill, markersize=5, label=label)
        for marker, colour, fill, label in looks
        if failures or colour != FAILED
    ]


def _panel(panel: Axes, table: Mapping[str, Any], group: str) -> list[Mark]:
    members = {case["case"] for case in table["cases"] if case["group"] == group}
    shown = []
    for row in table["laws"]:
        figures = row["groups"][group]
        if figures[ERROR] is None or figures[CHATTERING] is None:
            continue
        failed = len(members & set(row["lost"]))
        colour = FAILED if failed else FRONT if figures["on_pareto_front"] else BEATEN
        x, y, top = figures[CHATTERING]["mean"], figures[ERROR]["mean"], 4 if colour == FRONT else 3
        for figure, draw, other in ((ERROR, panel.vlines, x), (CHATTERING, panel.hlines, y)):
            draw(
                other, figures[figure]["smallest"], figures[figure]["largest"], color=colour, alpha=0.35, linewidth=0.8
            )
        panel.plot(x, y, "o", color=colour, markersize=5, markerfacecolor="white" if failed else colour, zorder=top)
        note = f" (lost on {failed})" if failed else ""
        shown.append(Mark(x, y, literal(row["law"].replace("_", " ")) + note, colour))
    front = sorted((x, y) for x, y, _, colour in shown if colour == FRONT)
    if front:
        panel.plot(*zip(*front, strict=True), color=FRONT, drawstyle="steps-post", linewidth=1.0, zorder=2)
    panel.set(xscale="log", yscale="log", xlabel="chattering [× plain computed torque]")
    panel.set_title(f"{literal(group)}: {len(members)} case{'s' * (len(members) > 1)}")
    panel.tick_params(labelleft=True)
    panel.xaxis.set_major_formatter("{x:g}")
    return shown


def _label(panel: Axes, shown: list[Mark]) -> None:
    """Draw labels in a column right of the panel, in the order of the markers, without overlap."""
    upright = panel.transData + panel.transAxes.inverted()
    marks = sorted(shown, key=lambda mark: (mark.y, -mark.x))
    places = spread_apart([float(upright.transform((mark.x, mark.y))[1]) for mark in marks], min(GAP, 1.0 / len(marks)))
    for place, mark in zip(places, marks, strict=True):
        line = {"arrowstyle": "-", "color": mark.colour, "alpha": 0.4, "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 3.0}
        panel.annotate(
            mark.text,
            (mark.x, mark.y),
            xytext=(1.03, place),
            textcoords="axes fraction",
            color=mark.colour,
            fontsize=LABEL_SIZE,
            va="center",
            arrowprops={**line, "relpos": (0.0, 0.5)},
        )


def _at_least(limits: tuple[float, float], low: float, high: float) -> tuple[float, float]:
    return min(limits[0], low), max(limits[1], high)


def spread_apart(wanted: list[float], gap: float) -> list[float]:
    """Find places in [0, 1], closest to ascending wanted ones, with at least ``gap`` between neighbours.

    Least squares under these constraints by the pool-adjacent-violators algorithm: neighbours that are too close form a
    block, which is centred at the mean of its members' wanted places.
    """
    blocks: list[list[float]] = []  # sum of (wanted − offset in the block), and number of members
    for index, place in enumerate(wanted):
        blocks.append([place - gap * index, 1.0])
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] > blocks[-1][0] / blocks[-1][1]:
            total, count = blocks.pop()
            blocks[-1][0] += total
            blocks[-1][1] += count
    highest = 1.0 - gap * (len(wanted) - 1)
    starts = [min(max(total / count, 0.0), highest) for total, count in blocks for _ in range(int(count))]
    return [start + gap * index for index, start in enumerate(starts)]
