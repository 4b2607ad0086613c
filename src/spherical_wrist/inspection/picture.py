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
from spherical_wrist.inspection.drawing import AXES, MARK, STYLE
from spherical_wrist.inspection.panels import Panel, motion_panels, other_panels
from spherical_wrist.inspection.portrait import portrait
from spherical_wrist.loop.outcome import Status
from spherical_wrist.plain_text import literal
from spherical_wrist.simulation.run import Run

ROW, WIDTH = 1.5, 11.0
"""Height of a panel and width of the sheet [in]."""


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
    rows = max(len(motion), 3 + len(hardware))
    with mpl.rc_context(STYLE):
        words = [part for text in title[1:] for part in textwrap.wrap(literal(text), 150)]
        top = 0.34 + 0.17 * len(words)
        drawing = Figure(figsize=(WIDTH, ROW * rows + top), layout="constrained")
        parts: Any = drawing.subfigures(2, 1, height_ratios=(top, ROW * rows))
        head, body = parts
        head.text(0.012, 1.0 - 0.1 / top, literal(title[0]), weight="bold", fontsize=11.0, va="top")
        head.text(0.012, 1.0 - 0.32 / top, "\n".join(words), fontsize=8.5, va="top", linespacing=1.3)
        handles = [
            Line2D([], [], color=colour, linewidth=2.0, label=axis) for axis, colour in zip("xyz", AXES, strict=True)
        ]
        head.legend(handles=handles, loc="upper right", ncols=3)
        left, right = body.subfigures(1, 2, width_ratios=(1.25, 1.0))
        over_time(left.subplots(len(motion), 1, sharex=True, squeeze=False)[:, 0], motion, run)
        share = (rows - len(hardware)) / 3.0
        heights = [share] * 3 + [1.0] * len(hardware)
        panels = right.subplots(len(heights), 1, squeeze=False, gridspec_kw={"height_ratios": heights})[:, 0]
        for axis, panel in enumerate(panels[:3]):
            portrait(panel, run, axis)
        over_time(panels[3:], hardware, run)
    return drawing


def over_time(axes: Sequence[Axes], panels: Sequence[Panel], run: Run) -> None:
    """Draw panels over time below each other, with the steady window and the end of a run that diverged."""
    for panel, draw in zip(axes, panels, strict=True):
        draw(panel)
        begin, end = float(run.time[0]), float(run.time[-1])
        stretched = 1.015 if run.outcome.status == Status.DIVERGED else 1.0
        panel.set_xlim(begin, begin + stretched * (end - begin if end > begin else run.measurement.period))
        if begin < run.measurement.steady_from:
            panel.axvspan(begin, min(run.measurement.steady_from, end), color="0.5", alpha=0.1, linewidth=0.0, zorder=0)
        if run.outcome.status == Status.DIVERGED:
            panel.axvline(end, color=MARK, linewidth=2.0)
        panel.tick_params(labelbottom=panel is axes[-1])
    if len(axes):
        words = f"time [s] · grey: before the steady window, t < {run.measurement.steady_from:g} s"
        diverged = run.outcome.status == Status.DIVERGED
        axes[-1].set_xlabel(words + " · pink: where it diverged" * diverged)
