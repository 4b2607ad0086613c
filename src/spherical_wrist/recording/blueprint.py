"""Layout of the viewer for a recording."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun.blueprint as rrb

from spherical_wrist.channels import Place
from spherical_wrist.measure.series import Plot, Series, in_place
from spherical_wrist.recording.geometry import Drawable
from spherical_wrist.recording.layout import EXPERIMENT_TEXT, METRICS_TEXT, TIMELINE, TIP_PLOT, TIPS, WORLD, plot_entity

TRAIL = 1.5
"""Length of the tip's trails [s]."""

LEGEND = 6
"""Largest number of curves of a plot with a legend; a longer legend would hide the curves."""

_EYE = np.array([0.60, -0.79, 0.12])
"""From the middle of the wrist to the eye: that of the package's model's overview camera."""


def blueprint(
    wrist: Drawable, series: Series, ranges: Mapping[str, tuple[float, float]], bound: float
) -> rrb.Blueprint:
    """Return the layout of the viewer: the scene and the texts on the left, the plots on the right.

    Args:
        wrist: the eye looks at it from a distance that fits its size.
        series: its channels say which plots there are.
        ranges: ends of the plots' vertical axes; one that has none is as high as its curves at any time.
        bound: on the tip error [mm].
    """
    texts = rrb.Tabs(
        rrb.TextDocumentView(name="Summary", origin=METRICS_TEXT),
        rrb.TextDocumentView(name="Experiment", origin=EXPERIMENT_TEXT),
        active_tab=0,
    )
    faulty = bool(in_place(list(series.plots()), Place.HARDWARE))  # which makes the texts longer
    stack = [[_plot(plot, ranges.get(plot.name), bound) for plot in place] for place in _stack(list(series.plots()))]
    places = [_place(views) for views in stack if views]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_scene(wrist), texts, row_shares=[1.0, 1.6 if faulty else 1.15]),
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


def _stack(plots: Sequence[Plot]) -> list[list[Plot]]:
    """Return the plots of every place from top to bottom; those that share a place are tabs.

    Tip error, attitude error and torque are on top. All others share the lowest place.
    """
    above = [in_place(plots, place) for place in (Place.TIP, Place.ERROR, Place.TORQUE)]
    below = in_place(plots, Place.SURFACE, Place.HARDWARE, Place.OTHER)
    return [*(place[:1] for place in above), [*below, *(plot for place in above for plot in place[1:])]]


def _plot(plot: Plot, ends: tuple[float, float] | None, bound: float) -> rrb.TimeSeriesView:
    symbol = f" {plot.symbol}" if plot.channel.place <= Place.TORQUE else ""  # tabs of the lowest place are narrow
    bounded = plot.name == TIP_PLOT
    legend = bounded or 1 < len(plot.axes) <= LEGEND
    return rrb.TimeSeriesView(
        name=plot.title + symbol + (f" [{plot.unit}]" if plot.unit else "") + f", bound {bound:g} mm" * bounded,
        origin=plot_entity(plot.name),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=None if ends is None else rrb.ScalarAxis(range=ends),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=None if legend else False),
    )
