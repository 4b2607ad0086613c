"""How the viewer shows a recording."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import rerun.blueprint as rrb

from spherical_wrist.recording.geometry import Drawable
from spherical_wrist.recording.hardware import hardware_curves
from spherical_wrist.recording.layout import (
    EXPERIMENT_TEXT,
    HARDWARE,
    METRICS_TEXT,
    PLOTTED,
    TIMELINE,
    TIPS,
    WORLD,
    plot_entity,
)
from spherical_wrist.recording.plots import plotted
from spherical_wrist.simulation.series import COLUMNS

TRAIL = 1.5
"""Length of the tip's trails [s]."""

STACKED = 3
"""Plots that always show; the rest share the place below them, a tab each."""

ABOVE_HARDWARE = (("error",), ("surface", "rate_error", "slope"), ("torque", "disturbance"))
"""Plots from top to bottom where the lowest place is taken by those of the hardware; those that share one are tabs."""

LEGEND = 6
"""Most curves of a plot that a legend names; more would hide them."""

_EYE = np.array([0.60, -0.79, 0.12])
"""From the middle of the wrist to the eye: that of the package's model's overview camera."""


def blueprint(
    wrist: Drawable,
    arrays: Mapping[str, npt.NDArray[np.float64]],
    ranges: Mapping[str, tuple[float, float]],
) -> rrb.Blueprint:
    """The layout of the viewer: the scene and the tables on the left, the plots on the right.

    Args:
        wrist: the eye looks at it from a distance that fits its size.
        arrays: of the series, by name; they say which plots there are.
        ranges: ends of the plots' vertical axes; one that has none is as high as its curves at any time.
    """
    tables = rrb.Horizontal(
        rrb.TextDocumentView(name="Metrics", origin=METRICS_TEXT),
        rrb.TextDocumentView(name="Experiment", origin=EXPERIMENT_TEXT),
    )
    names, hardware = plotted(arrays), hardware_curves(arrays)
    told = {name: (" ".join(PLOTTED[name]), COLUMNS[name]["unit"], arrays[name].shape[1]) for name in names}
    told |= {name: (HARDWARE[name][0], HARDWARE[name][2], curves.shape[1]) for name, curves in hardware.items()}
    views = {name: _plot(name, *what, ranges.get(name)) for name, what in told.items()}
    if hardware:
        stack = [*([name for name in place if name in views] for place in ABOVE_HARDWARE), list(hardware)]
    else:
        stack = [*([name] for name in names[:STACKED]), names[STACKED:]]
    places = [_place([views[name] for name in place]) for place in stack if place]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_scene(wrist), tables, row_shares=[1.7, 1.0]),
            rrb.Vertical(*places),
            column_shares=[1.0, 1.0],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
    )


def _scene(wrist: Drawable) -> rrb.Spatial3DView:
    middle, extent = wrist.model.stat.center, wrist.model.stat.extent
    trail = rrb.VisibleTimeRange(
        TIMELINE,
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-TRAIL),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    return rrb.Spatial3DView(
        name="Wrist: actual solid, orange trail · desired wires, green trail",
        origin=WORLD,
        background=[58, 64, 74],
        overrides={entity: [rrb.VisibleTimeRanges([trail])] for entity in TIPS.values()},
        eye_controls=rrb.EyeControls3D(position=middle + 1.05 * extent * _EYE, look_target=middle, eye_up=(0, 0, 1)),
        line_grid=rrb.LineGrid3D(visible=False),
    )


def _place(views: Sequence[rrb.View]) -> rrb.View | rrb.Container:
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)


def _plot(name: str, title: str, unit: str, curves: int, ends: tuple[float, float] | None) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        name=title + (f" [{unit}]" if unit else ""),
        origin=plot_entity(name),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=None if ends is None else rrb.ScalarAxis(range=ends),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=None if 1 < curves <= LEGEND else False),
    )
