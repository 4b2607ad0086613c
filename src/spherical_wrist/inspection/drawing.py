"""Style of the pictures of recordings, without a screen or global state."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import Locator, LogLocator, MaxNLocator, NullFormatter

from spherical_wrist.arrays import Array
from spherical_wrist.colours import AXES, PURPLE, YELLOW
from spherical_wrist.colours import INK as TEXT_COLOUR
from spherical_wrist.inspection.curves import BINS, drawable, telling_rows, view
from spherical_wrist.picture_axes import text_width
from spherical_wrist.picture_style import SMALL, TEXT
from spherical_wrist.picture_style import STYLE as COMMON

INK, MARK, LAYER = TEXT_COLOUR, PURPLE, YELLOW
"""Of text, of a run that ended before its time, and of the boundary layer."""
STYLE: Any = {
    **COMMON,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": True,
    "lines.linewidth": 0.9,
}
BETWEEN = 0.1
"""Smallest space between a title and figures beside it [in]."""
FEW = 60
"""Most rows of which every one gets a mark."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def figure(value: float | None, unit: str = "") -> str:
    """A number with three digits, as print has it; a dash for none."""
    if value is None:
        return "—"
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        shown = f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"
        return f"{shown} {unit}".rstrip().replace("-", "−")
    digits, _, exponent = f"{value:.2e}".partition("e")
    factor = "" if float(digits) == 1.0 else f"{float(digits):g}·".replace("-", "−")
    return f"{factor}10{str(int(exponent)).translate(_RAISED)} {unit}".rstrip()


def line(panel: Axes, time: Array, values: Array, bins: int = BINS, **look: Any) -> None:
    """One curve over time, of few points that look like all; short ones with a mark at every row."""
    values = drawable(values)
    rows = telling_rows(values, bins)
    marks = {"marker": "o", "markersize": 3.0} if len(time) <= FEW else {}
    panel.plot(time[rows], values[rows], **{**marks, **look})


def lines(panel: Axes, time: Array, vectors: Array, **look: Any) -> None:
    """Three curves over time, in the colours of the axes; the one that goes furthest behind the others."""
    curves = list(zip(AXES, drawable(vectors).T, strict=True))
    for colour, values in sorted(curves, key=lambda curve: _extent(curve[1]), reverse=True):
        line(panel, time, values, color=colour, **look)


def _extent(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def fit(panel: Axes, *shown: Array) -> None:
    """Set the ends of the vertical axis; where something is beyond them, a note says how far it goes."""
    values = drawable(np.concatenate([each.ravel() for each in shown]))
    low, high, cut = view(values)
    panel.set_ylim(low, high)
    if cut:
        note(panel, f"goes from {figure(float(np.nanmin(values)))} to {figure(float(np.nanmax(values)))}")


def fit_decades(panel: Axes, sizes: Array, below: float = 0.005) -> None:
    """Make the vertical axis logarithmic, where there is something positive to show on it, but for a part below it."""
    positive = sizes[sizes > 0.0]
    if not len(positive):
        return
    largest = float(positive.max())
    low, high = 0.6 * max(float(np.quantile(positive, below)), 1e-20 * largest), 1.6 * largest
    panel.set_ylim(low, high)  # before the scale, which would look for positive values among the curves
    panel.set_yscale("log", nonpositive="mask")
    panel.yaxis.set_major_locator(_decades(high / low))
    panel.yaxis.set_major_formatter(lambda value, _: figure(value))
    panel.yaxis.set_minor_formatter(NullFormatter())


def _decades(ratio: float) -> Locator:
    """Places of labels on a logarithmic axis, enough of them and not too many, by the ratio of its ends."""
    if ratio < 5.0:
        return MaxNLocator(4)
    steps = {30.0: (1.0, 2.0, 5.0), 300.0: (1.0, 3.0)}
    return LogLocator(subs=next((subs for limit, subs in steps.items() if ratio < limit), (1.0,)))


def note(panel: Axes, text: str) -> None:
    """Write a remark at the lower right of a panel; an empty one is left out."""
    if not text:
        return
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    panel.text(
        0.995, 0.03, text, transform=panel.transAxes, ha="right", va="bottom", fontsize=7.0, color=INK, bbox=ground
    )


def name(panel: Axes, title: str, *figures: str, bold: bool = True) -> None:
    """Write the title of a panel at its upper left, and figures at its upper right, where there is room for them.

    Args:
        panel: the panel.
        title: what it shows.
        bold: False for a small title.
        *figures: what is to be read off it; the first of them that fits is written.
    """
    size = TEXT if bold else SMALL
    room = panel.bbox.width / panel.figure.dpi
    room -= text_width(title, size, bold=bold) + BETWEEN
    fitting = (text for text in figures if text_width(text, SMALL) <= room)
    panel.set_title(title, loc="left", weight="bold" if bold else "normal", pad=3.0, fontsize=size)
    panel.set_title(next(fitting, ""), loc="right", pad=3.0, color=INK, fontsize=SMALL)
