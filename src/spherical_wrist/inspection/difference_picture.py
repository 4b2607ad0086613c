"""Picture of the difference of two series over time, on logarithmic axes: one panel a unit."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.arrays import Array
from spherical_wrist.colours import SIZES
from spherical_wrist.inspection.difference import Difference, sizes
from spherical_wrist.inspection.drawing import INK, MARK, STYLE, figure, fit_decades, line
from spherical_wrist.inspection.instants import common_instants
from spherical_wrist.measure.series import Series
from spherical_wrist.picture_axes import wrapped
from spherical_wrist.picture_style import FOR_ONE_COLUMN, LARGE, TEXT, WIDTHS
from spherical_wrist.plain_text import literal


def difference_picture(
    a: Series, b: Series, found: Difference, names: Sequence[str], width: float = WIDTHS["two-column"]
) -> Figure:
    """Draw the difference of every array that differs, over the instants that both series have.

    Args:
        a: a series.
        b: another one.
        found: what :func:`spherical_wrist.inspection.difference.difference` says of them.
        names: of the two, for the title.
        width: width of the picture [in].
    """
    narrow = width < FOR_ONE_COLUMN
    groups: dict[str, list[str]] = {}
    for array in found.arrays:
        if array.largest and array.name != "time":
            groups.setdefault(array.unit, []).append(array.name)
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(width, 1.0 + (1.6 + 0.4 * narrow) * max(len(groups), 1)), layout="constrained")
        panels = drawing.subplots(max(len(groups), 1), 1, sharex=True, squeeze=False)[:, 0]
        title = wrapped(f"{names[0]} against {names[1]}: {_summary(found)}", LARGE, width - 0.2, bold=True)
        drawing.suptitle("\n".join(map(literal, title)))
        common = common_instants(a.time, b.time)
        time = a.time[common.rows_a]
        for panel, (unit, group) in zip(panels, groups.items(), strict=False):
            curves = {
                each: sizes(a.channel(each), a.channels[each][common.rows_a], b.channels[each][common.rows_b])
                for each in group
            }
            _draw(panel, time, curves, found.tolerance, narrow=narrow)
            panel.set_ylabel(f"difference [{unit}]" if unit else "difference")
            if found.first is not None:
                panel.axvline(found.first.time, color=MARK, linewidth=1.4, zorder=1)
        if not groups:
            panels[0].text(0.5, 0.5, "nothing to draw", ha="center", transform=panels[0].transAxes)
        if len(time) > 1:
            panels[0].set_xlim(time[0] - 0.01 * (time[-1] - time[0]), time[-1])
        panels[-1].set_xlabel("\n".join(wrapped("time [s]" + _legend(found), TEXT, width - 0.8)))
    return drawing


def _draw(panel: Axes, time: Array, curves: Mapping[str, Array], tolerance: float, *, narrow: bool) -> None:
    for place, (name, size) in enumerate(curves.items()):
        shown = np.where(np.isfinite(size) & (size > 0.0), size, np.nan)
        # what lies behind is wider, since arrays that follow from each other differ alike
        behind = place == 0 and len(curves) > 1
        width, alpha = (3.0, 0.4) if behind else (0.9, 1.0)
        look: dict[str, Any] = {"color": SIZES[place % len(SIZES)], "linewidth": width, "alpha": alpha}
        if np.isnan(shown).mean() > 0.5:
            look |= {"marker": ".", "markersize": 3.0}  # rows by themselves make no line
        line(panel, time, shown, label=name, **look)
    every = np.concatenate([*curves.values()])
    fit_decades(panel, every[np.isfinite(every)], 0.0)
    if tolerance:
        panel.axhline(tolerance, color=INK, linestyle="--", linewidth=0.9)
        low, high = panel.get_ylim()
        panel.set_ylim(min(low, 0.6 * tolerance), max(high, 1.6 * tolerance))
    if narrow:
        panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1, labelspacing=0.2)
    else:
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _summary(found: Difference) -> str:
    if found.same:
        return "the same" if not found.tolerance else f"the same within {figure(found.tolerance)}"
    return f"different from t = {found.first.time:.6g} s on" if found.first is not None else "different"


def _legend(found: Difference) -> str:
    pink = " · pink: the first difference" + " beyond the tolerance" * bool(found.tolerance)
    dashed = f" · dashed: tolerance {figure(found.tolerance)}"
    return pink * (found.first is not None) + dashed * bool(found.tolerance)
