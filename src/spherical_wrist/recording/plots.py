"""Channels over time: those with a plot, and the rest."""

from collections.abc import Iterable
from colorsys import hsv_to_rgb

import numpy as np
import rerun as rr

from spherical_wrist.arrays import Array
from spherical_wrist.colours import ORANGE, PALE, of_components, rgb
from spherical_wrist.measure.series import Plot, Series
from spherical_wrist.recording.layout import SERIES, TIP_PLOT, plot_entity
from spherical_wrist.recording.scene import timeline

AGGREGATION = rr.components.AggregationPolicy
DRAWN_IN_FULL = 20_000
"""Most rows of which a plot draws every one; of more, the extremes on every pixel.

The viewer's default, the mean of what falls on a pixel, makes a chattering torque look smooth.
"""

_SMALLEST, _LARGEST = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
"""Limits of a plot's axis, which has single precision."""


PEAKS = 200
"""Most points of the tip error, each the largest of so many rows; the exact tips are among the arrays.

All rows would take a twentieth of a recording.
"""

IN_SIGHT = 20.0
"""Largest ratio of the bound to a tip error that is drawn with the bound in sight; it would be flat otherwise."""


def send_channels(
    recording: rr.RecordingStream, time: rr.TimeColumn, series: Series, bound: float
) -> dict[str, list[str]]:
    """Send every channel of a series in double precision, NaN included.

    Args:
        recording: destination.
        time: the control instants.
        series: the series, as :func:`~spherical_wrist.recording.stream.checked` returns it.
        bound: on the tip error [mm].

    Returns:
        Entities of every channel by its name: one, or one for each group of its components.
    """
    plots = list(series.plots())
    send_styles(recording, plots, len(series), bound)
    send_curves(recording, time, [plot for plot in plots if plot.name != TIP_PLOT])
    send_tip_error(recording, series.time, plots, len(series), bound)
    entities: dict[str, list[str]] = {name: [] for name in series.channels}
    for plot in plots:
        if plot.is_stored:
            entities[plot.channel.name].append(plot_entity(plot.name))
    rest = [_component(name, series.channels[name]) for name, own in entities.items() if not own]
    recording.send_columns(SERIES, [time], rest)
    return {name: own or [SERIES] for name, own in entities.items()}


def send_styles(recording: rr.RecordingStream, plots: Iterable[Plot], rows: int, bound: float) -> None:
    """Send names and colours of the curves of plots.

    Args:
        recording: destination.
        plots: the plots.
        rows: number of rows that are drawn in the end.
        bound: on the tip error [mm].
    """
    policy = AGGREGATION.Off if rows <= DRAWN_IN_FULL else AGGREGATION.MinMax
    for plot in plots:
        names, colours = plot.labels, _colours(plot)
        if plot.name == TIP_PLOT:
            names, colours = [plot.title.lower(), f"bound {bound:g} mm"], [*colours, rgb(PALE)]
        widths = [1.5] * len(colours)
        style = rr.SeriesLines(names=names, colors=colours, widths=widths, aggregation_policy=policy)
        recording.log(plot_entity(plot.name), style, static=True)


def send_curves(recording: rr.RecordingStream, time: rr.TimeColumn, plots: Iterable[Plot]) -> None:
    """Send the curves of plots; see :func:`send_channels`."""
    for plot in plots:
        recording.send_columns(plot_entity(plot.name), [time], rr.Scalars.columns(scalars=plot.curves))


def send_tip_error(recording: rr.RecordingStream, times: Array, plots: Iterable[Plot], rows: int, bound: float) -> None:
    """Send the curve of the tip error, of many rows the peaks, and its bound as a second curve.

    Args:
        recording: destination.
        times: control instants [s].
        plots: plots, that of the tip error among them.
        rows: number of rows that are drawn in the end.
        bound: on the tip error [mm].
    """
    [curve] = [plot.curves[:, 0] for plot in plots if plot.name == TIP_PLOT]
    step = -(-rows // PEAKS)
    shown = [first + int(np.argmax(curve[first : first + step])) for first in range(0, len(curve), step)]
    scalars = rr.Scalars.columns(scalars=np.stack([curve[shown], np.full(len(shown), bound)], axis=1))
    recording.send_columns(plot_entity(TIP_PLOT), [timeline(times[shown])], scalars)


def ranges(series: Series, bound: float) -> dict[str, tuple[float, float]]:
    """Return the :func:`limits` of every plot by its name; of the tip error, with its bound [mm] unless far above."""
    found = {plot.name: limits(plot.curves) for plot in series.plots()}
    top = found[TIP_PLOT][1]
    if top < 1.1 * bound <= IN_SIGHT * top:
        found[TIP_PLOT] = limits(np.array([0.0, 1.1 * bound]))
    return found


def _colours(plot: Plot) -> list[tuple[int, int, int]]:
    """Return the colours of the curves: those of the axes, of the palette, or around the circle of hues."""
    count = len(plot.axes)
    if count == 1:
        return [rgb(ORANGE)]
    if colours := of_components(plot.axes):
        return list(map(rgb, colours))
    hues = (hsv_to_rgb(k / count, 0.6, 0.95) for k in range(count))
    return [(round(255.0 * red), round(255.0 * green), round(255.0 * blue)) for red, green, blue in hues]


def _component(name: str, array: Array) -> rr.ComponentColumn:
    batch = rr.components.ScalarBatch(array.ravel())
    lengths = np.full(len(array), array[0].size)
    return rr.ComponentColumn(rr.ComponentDescriptor(name), batch, lengths=lengths)


def limits(array: Array) -> tuple[float, float]:
    """Return the ends of a plot's vertical axis: zero and the bulk of the values are inside.

    Values beyond the bulk are inside too, unless they would squeeze it to less than a quarter of the plot: so a small
    residue stays readable after a large transient. The viewer puts its labels at multiples of a power of ten, and puts
    none where they would be too close: where that leaves less than two, the ends move outwards to the next label.
    """
    values = np.clip(array[np.isfinite(array)], -_LARGEST, _LARGEST)
    if not len(values):
        return -1.0, 1.0
    whole = _with_zero(float(values.min()), float(values.max()))
    bulk = _with_zero(*np.quantile(values, (0.02, 0.98)))
    low, high = max(1.3 * bulk[0], whole[0]), min(1.3 * bulk[1], whole[1])
    if whole[1] - whole[0] <= 4.0 * (high - low):
        low, high = whole
    if not _SMALLEST < high - low < _LARGEST:
        return -1.0, 1.0
    step = 10.0 ** np.floor(np.log10(high - low))
    if high - low > 7.5 * step:
        step *= 10.0
    if high - low < 2.0 * step:
        low, high = step * np.floor(low / step + 0.05), step * np.ceil(high / step - 0.05)
    margin = 0.05 * (high - low)
    return float(low - margin), float(high + margin)


def _with_zero(low: float, high: float) -> tuple[float, float]:
    return min(float(low), 0.0), max(float(high), 0.0)
