"""Inspection sheet of a run: its motion on the left, phase portraits, sensors and motors on the right.

Panels of channels that have no place of their own fill the shorter column.
"""

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.channels import Place
from spherical_wrist.colours import AXES
from spherical_wrist.inspection.drawing import MARK, STYLE
from spherical_wrist.inspection.panels import Panel, motion_panels, other_panels
from spherical_wrist.inspection.portrait import portrait
from spherical_wrist.plain_text import literal
from spherical_wrist.simulation.run import Run

GREY: Any = {"color": "0.5", "alpha": 0.1, "linewidth": 0.0, "zorder": 0}
"""Shade of what is outside of the steady window."""
ROW, WIDTH = 1.48, 11.0
"""Height of a panel with its title, and width of the sheet [in]."""
COLUMNS = ((0.74, 5.28), (6.94, 4.0))
"""Left end and width of the panels of both columns [in]."""
ABOVE, BELOW, LAST = 0.34, 0.07, 0.45
"""Space of a panel's title; below a panel, and below one with its own horizontal axis [in]."""


def run_picture(run: Run, title: Sequence[str]) -> Figure:
    """Draw a run that has at least one row.

    Args:
        run: the run.
        title: lines above the drawing, the first in bold: law, reference, outcome and conditions.
    """
    motion, hardware = list(motion_panels(run)), other_panels(run, *(set(Place) - {Place.OTHER}))
    other = other_panels(run, Place.OTHER)
    excess = 3 + len(hardware) - len(motion)
    split = min(max((len(other) + excess) // 2, 0), len(other))
    motion, hardware = [*motion, *other[:split]], [*hardware, *other[split:]]
    words = [part for text in title[1:] for part in textwrap.wrap(literal(text), 150)]
    top = 0.34 + 0.17 * len(words)
    body = ROW * max(len(motion), 3 + len(hardware)) + LAST
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(WIDTH, top + body))
        height = top + body
        drawing.text(0.012, 1.0 - 0.1 / height, literal(title[0]), weight="bold", fontsize=11.0, va="top")
        drawing.text(0.012, 1.0 - 0.32 / height, "\n".join(words), fontsize=8.5, va="top", linespacing=1.3)
        handles = [
            Line2D([], [], color=colour, linewidth=2.0, label=axis) for axis, colour in zip("xyz", AXES, strict=True)
        ]
        drawing.legend(handles=handles, loc="upper right", ncols=3)
        over_time(_column(drawing, COLUMNS[0], [BELOW] * len(motion), body), motion, run)
        panels = _column(drawing, COLUMNS[1], [LAST] * 3 + [BELOW] * len(hardware), body)
        for axis, panel in enumerate(panels[:3]):
            portrait(panel, run, axis)
        over_time(panels[3:], hardware, run)
    return drawing


def _column(drawing: Figure, place: tuple[float, float], below: Sequence[float], body: float) -> list[Axes]:
    """Add panels of equal height below each other, which fill the body of a drawing down to the last one's axis.

    The places are computed here because to find them, Matplotlib's layout engines draw everything several times.

    Args:
        drawing: the drawing.
        place: left end and width [in].
        below: space below each panel; the last one gets that of an axis in any case [in].
        body: height of the drawing without its title [in].
    """
    width, whole = drawing.get_size_inches()
    spaces = [*below[:-1], LAST]
    height = (body - ABOVE * len(spaces) - sum(spaces)) / len(spaces)
    panels, bottom = [], body
    for space in spaces:
        bottom -= ABOVE + height
        panels.append(drawing.add_axes((place[0] / width, bottom / whole, place[1] / width, height / whole)))
        bottom -= space
    return panels


def over_time(axes: Sequence[Axes], panels: Sequence[Panel], run: Run) -> None:
    """Draw panels over time below each other, with the steady window and the end of a run that was lost."""
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
        start, until = run.measurement.steady_from, run.measurement.steady_until
        words = f"time [s] · grey: before the steady window, t < {start:g} s"
        if until is not None:
            words = f"time [s] · grey: outside of the steady window, {start:g} s to {until:g} s"
        lost = run.outcome.status.lost
        axes[-1].set_xlabel(words + " · pink: where it ended early" * lost)
