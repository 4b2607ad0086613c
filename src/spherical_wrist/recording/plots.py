"""The arrays over time: those with a plot of their own, and the rest."""

from collections.abc import Mapping
from colorsys import hsv_to_rgb

import numpy as np
import numpy.typing as npt
import rerun as rr

from spherical_wrist.recording.hardware import hardware_curves
from spherical_wrist.recording.layout import HARDWARE, PLOTTED, SERIES, plot_entity
from spherical_wrist.simulation.series import COLUMNS

Array = npt.NDArray[np.float64]

AXIS_COLOURS = ((235, 85, 80), (95, 200, 115), (90, 150, 250))
"""Of x, y and z, in every plot."""

AGGREGATION = rr.components.AggregationPolicy
DRAWN_IN_FULL = 20_000
"""Most rows of which a plot draws every one; of more, the extremes on every pixel.

The viewer's default, the mean of what falls on a pixel, makes a chattering torque look smooth.
"""

_SMALLEST, _LARGEST = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
"""Of a plot's axis, which has single precision."""


def plotted(arrays: Mapping[str, Array]) -> list[str]:
    """Names of the arrays that get a plot: those that have something to show."""
    return [name for name in PLOTTED if np.isfinite(arrays[name]).any()]


def send_arrays(recording: rr.RecordingStream, time: rr.TimeColumn, arrays: Mapping[str, Array]) -> None:
    """Sends every array of a series in double precision, NaN included.

    Args:
        recording: where to.
        time: the control instants.
        arrays: of a series, by name.
    """
    send_styles(recording, arrays, len(arrays["time"]))
    sent = send_curves(recording, time, arrays)
    rest = [_component(name, array) for name, array in arrays.items() if name not in sent and array.size]
    recording.send_columns(SERIES, [time], rest)


def send_styles(recording: rr.RecordingStream, arrays: Mapping[str, Array], rows: int) -> None:
    """Sends how the curves of every plot look.

    Args:
        recording: where to.
        arrays: of a series, by name.
        rows: as many rows are drawn in the end.
    """
    policy = AGGREGATION.Off if rows <= DRAWN_IN_FULL else AGGREGATION.MinMax
    for name, (_, lines) in _curves(arrays).items():
        count = len(lines)
        around = [[round(255.0 * part) for part in hsv_to_rgb(k / count, 0.6, 0.95)] for k in range(count)]
        colours = AXIS_COLOURS[:count] if count <= len(AXIS_COLOURS) else around
        style = rr.SeriesLines(names=lines, colors=colours, widths=[1.5] * count, aggregation_policy=policy)
        recording.log(plot_entity(name), style, static=True)


def send_curves(recording: rr.RecordingStream, time: rr.TimeColumn, arrays: Mapping[str, Array]) -> set[str]:
    """Sends the curves of every plot, and returns the names of the plots; see :func:`send_arrays`."""
    curves = _curves(arrays)
    for name, (curve, _) in curves.items():
        recording.send_columns(plot_entity(name), [time], rr.Scalars.columns(scalars=curve))
    return set(curves)


def ranges(arrays: Mapping[str, Array]) -> dict[str, tuple[float, float]]:
    """The :func:`limits` of every plot, by its name."""
    return {name: limits(curve) for name, (curve, _) in _curves(arrays).items()}


def _curves(arrays: Mapping[str, Array]) -> dict[str, tuple[Array, list[str]]]:
    """Of every plot, by its name, the curves (n, m) and their m names."""
    found = {
        name: (arrays[name], [f"{PLOTTED[name][1]} {axis}" for axis in COLUMNS[name]["axes"]])
        for name in plotted(arrays)
    }
    faults = hardware_curves(arrays)
    return found | {name: (curve, _lines(HARDWARE[name][1], curve.shape[1])) for name, curve in faults.items()}


def _lines(symbol: str, count: int) -> list[str]:
    """Names of the curves of a plot: of its axes, or numbers from 0."""
    if count == 1:
        return [symbol]
    return [f"{symbol} {axis}" for axis in (COLUMNS["error"]["axes"] if count == 3 else range(count))]


def _component(name: str, array: Array) -> rr.ComponentColumn:
    batch = rr.components.ScalarBatch(array.ravel())
    lengths = np.full(len(array), array[0].size)
    return rr.ComponentColumn(rr.ComponentDescriptor(name), batch, lengths=lengths)


def limits(array: Array) -> tuple[float, float]:
    """Ends of a plot's vertical axis: zero and the bulk of the values are inside.

    Values beyond the bulk are inside too, unless they would squeeze it to less than a quarter of the plot: so a small
    residue stays readable after a large transient. The viewer puts its labels at multiples of a power of ten, and puts
    none where they would be too close: where that leaves less than two, the ends move outwards to the next label.
    """
    values = np.clip(array[np.isfinite(array)], -_LARGEST, _LARGEST)
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
