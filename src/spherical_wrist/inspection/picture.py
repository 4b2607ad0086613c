"""Inspection sheet of a run: its motion, phase portraits on the right or below, and all other channels below them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.channels import XYZ, Place
from spherical_wrist.colours import AXES
from spherical_wrist.errors import ParameterError
from spherical_wrist.inspection.drawing import MARK, STYLE
from spherical_wrist.inspection.panels import Panel, motion_panels, other_panels
from spherical_wrist.inspection.portrait import portrait, steady_portrait
from spherical_wrist.picture_axes import wrapped
from spherical_wrist.plain_text import literal
from spherical_wrist.simulation.run import Run

GREY: Any = {"color": "0.5", "alpha": 0.1, "linewidth": 0.0, "zorder": 0}
"""Shade of what is outside of the steady window."""
WIDTH, ROW = 11.0, 1.48
"""Usual width of the sheet, and height of a panel of the motion with its title [in]."""
NARROWEST, BESIDE = 6.25, 9.5
"""Smallest width of the sheet, and the width from which phase portraits are beside the motion [in]."""
SIDE, GAP, EDGE = 0.74, 0.7, 0.1
"""Left margin and space between two columns, both for the labels of vertical axes, and right margin [in]."""
MOTION, PORTRAIT = 4.76, 2.0
"""Widths of the panels of the motion and of a phase portrait on a sheet of the usual width [in]."""
ABOVE, BELOW, LAST = 0.34, 0.07, 0.45
"""Space of a panel's title; below a panel, and below one with its own horizontal axis [in]."""
LOW_ROW, PORTRAIT_ROW, SMALLEST = 1.15, 1.65, 1.75
"""Of a sheet that has them below each other: heights of a panel and of a phase portrait; and smallest width of a small
panel [in]."""
HEAD, WORDS = 11.0, 8.5
"""Sizes of the title and of the words below it [pt]."""
SMALL_ROW, MOST_COLUMNS, FEW_COLUMNS = 1.0, 4, 3
"""Height of a small panel with its title [in]; columns of them, and columns of those whose title has a figure."""


class Box(NamedTuple):
    """Place of a panel: left end, bottom, width and height [in]."""

    left: float
    bottom: float
    width: float
    height: float


def check_width(width: float) -> None:
    """Check that a sheet of a width has room for its panels.

    Raises:
        ParameterError: it has not.
    """
    if width < NARROWEST:
        raise ParameterError(
            f"width {width:.3g}in: an inspection sheet is at least {NARROWEST:g}in wide, such as two-column; errors "
            "and torque alone fit one column: wrist plot FILE.rrd -o OUT.pdf --width one-column"
        )


def run_picture(run: Run, title: Sequence[str], width: float = WIDTH) -> Figure:
    """Draw a run that has at least one row.

    Args:
        run: the run.
        title: lines above the drawing, the first in bold: law, reference, outcome and conditions.
        width: width of the sheet [in].

    Raises:
        ParameterError: the sheet is too narrow.
    """
    check_width(width)
    motion = list(motion_panels(run))
    fitting = int((width - SIDE - EDGE + GAP) // (SMALLEST + GAP))
    grids = [
        (other_panels(run, *(set(Place) - {Place.OTHER})), min(FEW_COLUMNS, fitting)),
        (other_panels(run, Place.OTHER), min(MOST_COLUMNS, fitting)),
    ]
    heads = wrapped(title[0], HEAD, width - 1.3, bold=True)
    words = [part for text in title[1:] for part in wrapped(text, WORDS, width - 0.3)]
    beside = width >= BESIDE
    below = 0.12 + 0.2 * len(heads)
    top = below + 0.02 + 0.17 * len(words)
    body = (ROW * max(len(motion), 3) if beside else LOW_ROW * len(motion)) + LAST
    portraits = 0.0 if beside else 2.0 * PORTRAIT_ROW
    rows = [-(-len(panels) // columns) for panels, columns in grids]
    height = top + body + portraits + sum(SMALL_ROW * count + LAST for count in rows if count)
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(width, height))
        edge = 0.13 / width
        head, body_text = literal("\n".join(heads)), literal("\n".join(words))
        drawing.text(edge, 1.0 - 0.1 / height, head, weight="bold", fontsize=HEAD, va="top", linespacing=1.2)
        drawing.text(edge, 1.0 - below / height, body_text, fontsize=WORDS, va="top", linespacing=1.3)
        handles = [
            Line2D([], [], color=colour, linewidth=2.0, label=axis) for axis, colour in zip(XYZ, AXES, strict=True)
        ]
        drawing.legend(handles=handles, loc="upper right", ncols=3)
        bottom = height - top
        scale = (width - SIDE - EDGE - 2.0 * GAP) / (MOTION + 2.0 * PORTRAIT)
        across = scale * MOTION if beside else width - SIDE - EDGE
        places = _column(SIDE, across, bottom, body, [BELOW] * len(motion))
        over_time([_panel(drawing, place) for place in places], motion, run, axis_label(run))
        if beside:
            size, left = scale * PORTRAIT, SIDE + across + GAP
            kinds = [_column(left + i * (size + GAP), size, bottom, body, [LAST] * 3) for i in range(2)]
            pairs = [list(pair) for pair in zip(*kinds, strict=True)]
        else:
            size, above = (across - 2.0 * GAP) / 3.0, bottom - body
            pairs = [_column(SIDE + i * (size + GAP), size, above, portraits, [LAST] * 2) for i in range(3)]
        for axis, (whole, steady) in enumerate(pairs):
            portrait(_panel(drawing, whole), run, axis)
            steady_portrait(_panel(drawing, steady), run, axis)
        bottom -= body + portraits
        for (panels, columns), count in zip(grids, rows, strict=True):
            if panels:
                _small_panels(drawing, panels, columns, bottom, run)
                bottom -= SMALL_ROW * count + LAST
    return drawing


def _small_panels(drawing: Figure, panels: Sequence[Panel], columns: int, top: float, run: Run) -> None:
    """Draw panels in a grid, row by row; each column has an axis of time below it."""
    width = (drawing.get_figwidth() - SIDE - EDGE - GAP * (columns - 1)) / columns
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
    """Return the label of the axis of time, which explains the shades and the mark."""
    start, until = run.measurement.steady_from, run.measurement.steady_until
    words = f"time [s] · grey: before the steady window, t < {start:g} s"
    if until is not None:
        words = f"time [s] · grey: outside of the steady window, {start:g} s to {until:g} s"
    return words + " · pink: where it ended early" * run.outcome.status.lost
