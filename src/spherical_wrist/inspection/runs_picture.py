"""Picture of several runs over time: tip error with its bound, attitude error, and torque, a line for each run."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.arrays import Array
from spherical_wrist.colours import GREY, INK
from spherical_wrist.inspection.curves import drawable
from spherical_wrist.picture_axes import logarithmic, text_width, wrapped
from spherical_wrist.picture_style import FOR_ONE_COLUMN, SMALL, STYLE, TEXT, WIDTHS, LawLook, law_looks
from spherical_wrist.plain_text import literal
from spherical_wrist.simulation.run import Run

HEIGHT, BETWEEN = 1.25, 0.28
"""Height of a panel, and space between panels, with the title of the lower one [in]."""
LEFT, RIGHT, BELOW, LINE = 0.55, 0.12, 0.4, 0.155
"""Space beside and below the panels, and height of a line of the legend [in]."""
TITLE = 0.2
"""Space of the title of the first panel [in]."""
BINS_PER_INCH = 25
"""Pieces into which the time is cut, so that lines that chatter are told apart."""
SHADE = "#f2f2f2"
"""Of times outside of the steady window."""


class Panel(NamedTuple):
    """Panel over time.

    Attributes:
        title: quantity and its unit.
        curves: values by label of the run, (n,).
        bound: largest acceptable value; None for none.
        decades: True for a logarithmic axis.
    """

    title: str
    curves: Mapping[str, Array]
    bound: float | None = None
    decades: bool = True


def runs_picture(
    runs: Mapping[str, Run],
    statuses: Mapping[str, str],
    width: float = WIDTHS["two-column"],
    *,
    bound: float | None = None,
    attitude_bound: float | None = None,
    window: tuple[float | None, float | None] = (None, None),
) -> Figure:
    """Draw runs that have at least one row.

    Args:
        runs: runs by label.
        statuses: status of their laws (:data:`~spherical_wrist.control.contract.LawStatus`) by label.
        width: width of the picture [in].
        bound: largest acceptable tip error [mm].
        attitude_bound: largest acceptable attitude error [rad].
        window: interval of time that is drawn [s]; None for an end of the runs.
    """
    looks = law_looks(statuses, lines=True)
    tips = {label: _size(1e3 * (run.tip - run.desired_tip)) for label, run in runs.items()}
    panels = [
        Panel("tip error [mm]", tips, bound),
        Panel("attitude error [rad]", {label: _size(run.error) for label, run in runs.items()}, attitude_bound),
        Panel("torque, magnitude [N·m]", {label: _size(run.torque) for label, run in runs.items()}, decades=False),
    ]
    times = np.concatenate([run.time[[0, -1]] for run in runs.values()])
    begin = float(times.min()) if window[0] is None else window[0]
    period = max(run.measurement.period for run in runs.values())
    end = float(times.max()) + period if window[1] is None else window[1]
    entries = [_entry(label, run, looks[label]) for label, run in runs.items()]
    if bound is not None or attitude_bound is not None:
        entries.append(Line2D([], [], color=INK, linestyle="--", linewidth=0.8, label="bound"))
    columns = _fitting(entries, width)
    top = 0.1 + LINE * -(-len(entries) // columns)
    size = width - LEFT - RIGHT
    bins = round(BINS_PER_INCH * size)
    step = (end - begin) / bins
    height = top + TITLE + len(panels) * (HEIGHT + BETWEEN) - BETWEEN + BELOW
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(width, height))
        drawing.legend(
            handles=entries, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=columns, fontsize=SMALL,
            handlelength=1.6, handletextpad=0.5, columnspacing=1.2, labelspacing=0.3, borderaxespad=0.3,
        )  # fmt: skip
        for place, panel in enumerate(panels):
            above = top + TITLE + HEIGHT + place * (HEIGHT + BETWEEN)
            axes = drawing.add_axes((LEFT / width, 1.0 - above / height, size / width, HEIGHT / height))
            axes.set_title(panel.title, loc="left", pad=3.0)
            _draw(axes, panel, runs, looks, np.linspace(begin, end, bins + 1))
            _shade(axes, next(iter(runs.values())), begin, end)
            axes.set_xlim(begin, end)
            axes.tick_params(labelbottom=place == len(panels) - 1)
        binned = step >= 2.0 * period
        words = f"time [s] · lines: RMS over {1e3 * step:.2g} ms, bands: extremes" if binned else "time [s]"
        axes.set_xlabel("\n".join(wrapped(words, TEXT, size)))
        if width < FOR_ONE_COLUMN:
            axes.locator_params(axis="x", nbins=6)
    return drawing


def _size(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(drawable(vectors), axis=1))


def _draw(axes: Axes, panel: Panel, runs: Mapping[str, Run], looks: Mapping[str, LawLook], edges: Array) -> None:
    seen = [] if panel.bound is None else [np.array([panel.bound])]
    for label, values in panel.curves.items():
        run, look = runs[label], looks[label]
        inside = np.flatnonzero((run.time >= edges[0]) & (run.time < edges[-1]) & np.isfinite(values))
        if not len(inside):
            continue
        time, shown = run.time[inside], values[inside]
        line = {**look.line, "linewidth": 0.8 * look.weight}
        if len(time) < 4 * len(edges):
            axes.plot(time, shown, marker="." if len(time) == 1 else "", **line)
        else:
            time, low, shown, high = in_bins(time, shown, edges)
            axes.fill_between(time, low, high, color=look.colour, alpha=0.18, linewidth=0.0, zorder=look.order - 1)
            axes.plot(time, shown, **line)
        seen.append(shown)
        if run.outcome.status.lost:
            axes.plot(time[-1], shown[-1], "x", color=look.colour, markersize=6.0, markeredgewidth=1.5, clip_on=False)
    every = np.concatenate(seen) if seen else np.array([1.0])
    positive = every[every > 0.0]
    if panel.decades and len(positive):
        smallest, largest = float(np.quantile(positive, 0.01)), float(positive.max())
        logarithmic(axes.yaxis, max(0.5 * smallest, 1e-9 * largest), 2.5 * largest, HEIGHT)
    else:
        axes.set_ylim(0.0, 1.4 * float(np.quantile(every, 0.998)) or 1.0)
    if panel.bound is not None:
        axes.axhline(panel.bound, color=INK, linestyle="--", linewidth=0.8, zorder=1)


def in_bins(time: Array, values: Array, edges: Array) -> tuple[Array, Array, Array, Array]:
    """Return the middle, the smallest value, the RMS and the largest value of each bin that has values."""
    starts = np.searchsorted(time, edges[:-1])
    full = np.diff(np.append(starts, len(time))) > 0
    starts = starts[full]
    counts = np.diff(np.append(starts, len(time)))
    middles = 0.5 * (edges[1:] + edges[:-1])[full]
    rms = np.sqrt(np.add.reduceat(np.square(values), starts) / counts)
    return middles, np.minimum.reduceat(values, starts), rms, np.maximum.reduceat(values, starts)


def _shade(axes: Axes, run: Run, begin: float, end: float) -> None:
    """Shade times outside of the steady window of a run, over which its figures are not computed."""
    for low, high in ((begin, run.measurement.steady_from), (run.measurement.window_end, end)):
        if low < high:
            axes.axvspan(max(low, begin), min(high, end), color=SHADE, linewidth=0.0, zorder=0)


def _entry(label: str, run: Run, look: LawLook) -> Line2D:
    ended = f" (× {run.outcome.status} at {run.outcome.time:.3g} s)" if run.outcome.status.lost else ""
    colour = look.colour if look.colour != GREY else GREY
    return Line2D([], [], color=colour, linestyle=look.dash, linewidth=look.weight, label=literal(label) + ended)


def _fitting(entries: Sequence[Line2D], width: float) -> int:
    widest = max(text_width(str(entry.get_label()), SMALL) for entry in entries) + 0.45
    return max(1, min(len(entries), int((width - 0.1) // widest)))
