"""The phase portrait of one axis: rate error against attitude error, and the surface that the law slides on."""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from spherical_wrist.experiment.run import Run
from spherical_wrist.inspection.curves import drawable, telling_rows, view
from spherical_wrist.inspection.drawing import AXES, FEW, INK, LAYER, figure, name, note

Array = npt.NDArray[np.float64]


def portrait(panel: Axes, run: Run, axis: int) -> None:
    """Draws the true errors of an axis: pale before the steady window, with a ring where they begin.

    Where the law has a surface: the line on which it is zero at the median slope, and the boundary layer around it.
    """
    e, rate = drawable(run.error[:, axis]), drawable(run.rate_error[:, axis])
    steady = run.time >= run.measurement.window_start
    rows = telling_rows(np.stack([e, rate], axis=1), 1500)
    first = int(np.searchsorted(rows, int(steady.argmax()) if steady.any() else len(e)))
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.0} if len(e) <= FEW else {}
    width = 0.8 if len(rows) < 4000 else 0.4  # a chattering one is a ball of wool
    for part, alpha in ((rows[: first + 1], 0.4), (rows[first:], 1.0)):
        panel.plot(e[part], rate[part], color=AXES[axis], alpha=alpha, linewidth=width, **marks)
    panel.plot(e[:1], rate[:1], "o", color=INK, markerfacecolor="white", markersize=5.0, zorder=4)
    low_x, high_x, cut_x = view(np.append(e, 0.0), 12.0)
    low_y, high_y, cut_y = view(np.append(rate, 0.0), 12.0)
    panel.set(xlim=(low_x, high_x), ylim=(low_y, high_y))
    text = _surface(panel, run, axis)
    letter = "xyz"[axis]
    panel.set(xlabel=f"$e_{letter}$ [rad]", ylabel=rf"$\dot e_{letter}$ [rad/s]")
    name(panel, f"Phase portrait, {letter}", text)
    if cut_x or cut_y:
        reach_e, reach_rate = (figure(float(np.nanmax(np.abs(values)))) for values in (e, rate))
        note(panel, f"goes beyond, to |e| = {reach_e} rad, |ė| = {reach_rate} rad/s")


def _surface(panel: Axes, run: Run, axis: int) -> str:
    """Draws where the surface is zero; says in words what that is."""
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
    if run.measured_attitude.size:
        return "S = 0"  # of what was measured: nothing can be said
    rest = np.abs(run.surface - run.slope * run.error - run.rate_error)
    scale = np.abs(run.surface) + np.abs(run.rate_error)
    return "S = 0" if not (rest > 1e-6 * scale + 1e-12).any() else "λα e + ė = 0"
