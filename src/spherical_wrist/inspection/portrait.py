"""The phase portrait of one axis: rate error against attitude error, and the surface that the law slides on."""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from spherical_wrist.colours import AXES
from spherical_wrist.inspection.curves import drawable, telling_rows, view, with_gaps
from spherical_wrist.inspection.drawing import FEW, INK, LAYER, figure, name, note
from spherical_wrist.simulation.run import Run

Array = npt.NDArray[np.float64]


def portrait(panel: Axes, run: Run, axis: int) -> None:
    """Draw the true errors of an axis: pale outside of the steady window, with a ring where they begin.

    Where the law has a surface: the line on which it is zero at the median slope, and the boundary layer around it.
    """
    e, rate = with_gaps(drawable(run.error))[:, axis], drawable(run.rate_error[:, axis])
    steady = run.measurement.in_window(run.time)
    rows = telling_rows(np.stack([e, rate], axis=1), 1500)
    inside = np.flatnonzero(steady) if steady.any() else np.array([len(e)])
    first, last = (int(np.searchsorted(rows, row)) for row in inside[[0, -1]])
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.0} if len(e) <= FEW else {}
    width = 0.4 if _is_wool(rate[rows]) else 0.8
    for part, alpha in ((rows[: first + 1], 0.5), (rows[first : last + 1], 1.0), (rows[last:], 0.5)):
        panel.plot(e[part], rate[part], color=AXES[axis], alpha=alpha, linewidth=width, **marks)
    panel.plot(e[:1], rate[:1], "o", color=INK, markerfacecolor="white", markersize=5.0, zorder=4)
    cut = _frame(panel, e, rate)
    text = _surface(panel, run, axis)
    letter = "xyz"[axis]
    panel.set(xlabel=f"$e_{letter}$ [rad]", ylabel=rf"$\dot e_{letter}$ [rad/s]")
    panel.locator_params(axis="x", nbins=6)
    name(panel, f"Phase portrait, {letter}", text)
    if cut:
        reach_e, reach_rate = (figure(float(np.nanmax(np.abs(values)))) for values in (e, rate))
        note(panel, f"goes beyond, to |e| = {reach_e} rad, |ė| = {reach_rate} rad/s")


def _is_wool(rate: Array) -> bool:
    """Return True if a curve turns so often that its lines would run into each other, as with chattering."""
    turns = np.diff(np.sign(np.diff(rate))) != 0.0
    return len(turns) > 500 and float(turns.mean()) > 0.2


def _frame(panel: Axes, e: Array, rate: Array) -> bool:
    """Set the ends of both axes; returns whether something is beyond them.

    A short excursion must not squeeze all else into a dot, unless the run was started far off: then it is the matter.
    """
    for squeezed in (12.0, np.inf):
        across, upwards = (view(np.append(values, 0.0), squeezed) for values in (e, rate))
        panel.set(xlim=across[:2], ylim=upwards[:2])
        if across[0] <= e[0] <= across[1] and upwards[0] <= rate[0] <= upwards[1]:
            break
    return across[2] or upwards[2]


def _surface(panel: Axes, run: Run, axis: int) -> str:
    """Draw where the surface is zero; says in words what that is."""
    if "slope" not in run.channels:
        return ""
    slopes = run.slope[:, axis][np.isfinite(run.slope[:, axis])]
    if not len(slopes):
        return ""
    slope = float(np.median(slopes))
    ends = np.array(panel.get_xlim())
    panel.plot(ends, -slope * ends, color=INK, linestyle="--", linewidth=0.9, zorder=3)
    layer = run.measurement.boundary_layer
    if layer is not None:
        line = -slope * ends
        look: dict[str, Any] = {"color": LAYER, "alpha": 0.2, "linewidth": 0.0}
        panel.fill_between(ends, line - layer[axis], line + layer[axis], zorder=0, **look)
    which = "median slope" if np.ptp(slopes) > 1e-9 * slope else "slope"
    return f"dashed: {_meaning(run)} at the {which} {figure(slope)} 1/s"


def _meaning(run: Run) -> str:
    """``S = 0``, unless the surface is known to have further terms, such as an integral."""
    if "measured_attitude" in run.channels:
        return "S = 0"  # of what was measured: nothing can be said
    rest = np.abs(run.surface - run.slope * run.error - run.rate_error)
    scale = np.abs(run.surface) + np.abs(run.rate_error)
    return "S = 0" if not (rest > 1e-6 * scale + 1e-12).any() else "λα e + ė = 0"
