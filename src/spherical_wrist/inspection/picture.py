"""Inspection sheet of a run: its motion on the left, phase portraits on the right, all other channels below them."""

import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.channels import XYZ, Place
from spherical_wrist.colours import AXES
from spherical_wrist.inspection.drawing import MARK, STYLE
from spherical_wrist.inspection.panels import Panel, motion_panels, other_panels
from spherical_wrist.inspection.portrait import portrait, steady_portrait
from spherical_wrist.plain_text import literal
from spherical_wrist.simulation.run import Run

GREY: Any = {"color": "0.5", "alpha": 0.1, "linewidth": 0.0, "zorder": 0}
"""Shade of what is outside of the steady window."""
WIDTH, ROW = 11.0, 1.48
"""Width of the sheet, and height of a panel of the motion with its title [in]."""
SIDE, GAP, EDGE = 0.74, 0.7, 0.1
"""Left margin and space between two columns, both for the labels of vertical axes, and right margin [in]."""
MOTION, PORTRAIT = 4.76, 2.0
"""Widths of the panels of the motion and of a phase portrait [in]."""
ABOVE, BELOW, LAST = 0.34, 0.07, 0.45
"""Space of a panel's title; below a panel, and below one with its own horizontal axis [in]."""
SMALL_ROW, MOST_COLUMNS, FEW_COLUMNS = 1.0, 4, 3
"""Height of a small panel with its title [in]; columns of them, and columns of those whose title has a figure."""


class Box(NamedTuple):
    """Place of a panel: left end, bottom, width and height [in]."""

    left: float
    bottom: float
    width: float
    height: float


def run_picture(run: Run, title: Sequence[str]) -> Figure:
    """Draw a run that has at least one row.

    Args:
        run: the run.
        title: lines above the drawing, the first in bold: law, reference, outcome and conditions.
    """
    motion = list(motion_panels(run))
    grids = [
        (other_panels(run, *(set(Place) - {Place.OTHER})), FEW_COLUMNS),
        (other_panels(run, Place.OTHER), MOST_COLUMNS),
    ]
    words = [part for text in title[1:] for part in textwrap.wrap(literal(text), 150)]
    top, body = 0.34 + 0.17 * len(words), ROW * max(len(motion), 3) + LAST
    rows = [-(-len(panels) // columns) for panels, columns in grids]
    height = top + body + sum(SMALL_ROW * count + LAST for count in rows if count)
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(WIDTH, height))
        drawing.text(0.012, 1.0 - 0.1 / height, literal(title[0]), weight="bold", fontsize=11.0, va="top")
        drawing.text(0.012, 1.0 - 0.32 / height, "\n".join(words), fontsize=8.5, va="top", linespacing=1.3)
        handles = [
            Line2D([], [], color=colour, linewidth=2.0, label=axis) for axis, colour in zip(XYZ, AXES, strict=True)
        ]
        drawing.legend(handles=handles, loc="upper right", ncols=3)
        bottom = height - top
        places = _column(SIDE, MOTION, bottom, body, [BELOW] * len(motion))
        over_time([_panel(drawing, place) for place in places], motion, run, axis_label(run))
        left = SIDE + MOTION + GAP
        pairs = [_column(left + i * (PORTRAIT + GAP), PORTRAIT, bottom, body, [LAST] * 3) for i in range(2)]
        for axis, (whole, steady) in enumerate(zip(*pairs, strict=True)):
            portrait(_panel(drawing, whole), run, axis)
            steady_portrait(_panel(drawing, steady), run, axis)
        bottom -= body
        for (panels, columns), count in zip(grids, rows, strict=True):
            if panels:
                _small_panels(drawing, panels, columns, bottom, run)
                bottom -= SMALL_ROW * count + LAST
    return drawing


def _small_panels(drawing: Figure, panels: Sequence[Panel], columns: int, top: float, run: Run) -> None:
    """Draw panels in a grid, row by row; each column has an axis of time below it."""
    width = (WIDTH - SIDE - EDGE - GAP * (columns - 1)) / columns
    height = SMALL_ROW - ABOVE - BELOW
    for column in range(columns):
        own, left = panels[column::columns], SIDE + column * (width + GAP)
        places = [Box(left, top - SMALL_ROW * row - ABOVE - height, width, height) for row in range(len(own))]
        over_time([_panel(drawing, place) for place in places], own, run, "time [s]")


def _column(left: float, width: float, top: float, height: float, below: Sequence[float]) -> list[Box]:
    """Return places of equal height below each other, which fill a column down to the last one's axis.

    The places are computed here because to find them, Matplotlib's layout engines draw everything several times.

    Args:
        left: left end [in].
        width: width [in].
        top: upper end [in].
        height: height with titles and axes [in].
        below: space below each place; the last one gets that of an axis in any case [in].
    """
    spaces = [*below[:-1], LAST][: len(below)]
    each = (height - ABOVE * len(spaces) - sum(spaces)) / max(len(spaces), 1)
    places = []
    for space in spaces:
        top -= ABOVE + each
        places.append(Box(left, top, width, each))
        top -= space
    return places


def _panel(drawing: Figure, place: Box) -> Axes:
    width, height = drawing.get_size_inches()
    return drawing.add_axes((place.left / width, place.bottom / height, place.width / width, place.height / height))


def over_time(axes: Sequence[Axes], panels: Sequence[Panel], run: Run, label: str) -> None:
    """Draw panels over time below each other, with the steady window and the end of a run that was lost.

    Args:
        axes: where to draw them.
        panels: the panels.
        run: the run.
        label: label of the horizontal axis, below the last one.
    """
    for panel, draw in zip(axes, panels, strict=True):
        draw(panel)
        begin, end = float(run.time[0]), float(run.time[-1])
        stretched = 1.015 if run.outcome.status.lost else 1.0
        panel.set_xlim(begin, begin + stretched * (end - begin if end > begin else run.measurement.period))
        if begin < run.measurement.steady_from:
            panel.axvspan(begin, min(run.measurement.steady_from, end), **GREY)
        if end > run.measurement.window_end:
            panel.axvspan(max(run.measurement.window_end, begin), end, **GREY)
        if run.outcome.status.lost:
            panel.axvline(end, color=MARK, linewidth=2.0)
        panel.tick_params(labelbottom=panel is axes[-1])
    if len(axes):
        axes[-1].set_xlabel(label)


def axis_label(run: Run) -> str:
    """Return the label of the axis of time, which says what the shades and the mark are."""
    start, until = run.measurement.steady_from, run.measurement.steady_until
    words = f"time [s] · grey: before the steady window, t < {start:g} s"
    if until is not None:
        words = f"time [s] · grey: outside of the steady window, {start:g} s to {until:g} s"
    return words + " · pink: where it ended early" * run.outcome.status.lost
