"""The phase portrait of one axis: rate error against attitude error, and the surface that the law slides on."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from spherical_wrist.arrays import Array
from spherical_wrist.channels import XYZ
from spherical_wrist.colours import AXES
from spherical_wrist.inspection.curves import drawable, telling_rows, view, with_gaps
from spherical_wrist.inspection.drawing import FEW, INK, LAYER, figure, name, note
from spherical_wrist.simulation.run import Run


class Surface(NamedTuple):
    """Line on which a surface is zero.

    Attributes:
        slope: median slope λα [1/s].
        meaning: equation of the line.
    """

    slope: float
    meaning: str


def portrait(panel: Axes, run: Run, axis: int) -> None:
    """Draw the true errors of an axis in the whole run: pale outside of the steady window, with a ring at their start.

    Where the law has a surface: the line on which it is zero at the median slope, and the boundary layer around it.
    """
    steady = run.measurement.in_window(run.time)
    e, rate = _errors(run, axis)
    rows = telling_rows(np.stack([e, rate], axis=1), 1500)
    inside = np.flatnonzero(steady) if steady.any() else np.array([len(e)])
    first, last = (int(np.searchsorted(rows, row)) for row in inside[[0, -1]])
    _path(panel, e, rate, [(rows[: first + 1], 0.5), (rows[first : last + 1], 1.0), (rows[last:], 0.5)], axis)
    panel.plot(e[:1], rate[:1], "o", color=INK, markerfacecolor="white", markersize=5.0, zorder=4)
    _frame(panel, e, rate, np.inf)
    _label(panel, axis)
    shown = _surface(panel, run, axis)
    name(panel, f"Phase portrait, {XYZ[axis]}", *([f"dashed: {shown.meaning}", shown.meaning] if shown else []))


def steady_portrait(panel: Axes, run: Run, axis: int) -> None:
    """Draw the same in the steady window alone, at a scale of its own."""
    steady = run.measurement.in_window(run.time)
    e, rate = (values[steady] for values in _errors(run, axis))
    _label(panel, axis)
    name(panel, "Steady window")
    if not np.isfinite(e + rate).any():
        panel.set(xticks=[], yticks=[])
        note(panel, "no sample in it")
        return
    _path(panel, e, rate, [(telling_rows(np.stack([e, rate], axis=1), 1500), 1.0)], axis)
    cut = _frame(panel, e, rate, 12.0)
    if shown := _surface(panel, run, axis):
        name(panel, "Steady window", f"λα = {figure(shown.slope)} 1/s")
    if cut:
        reach_e, reach_rate = (figure(float(np.nanmax(np.abs(values)))) for values in (e, rate))
        note(panel, f"to |e| = {reach_e} rad, |ė| = {reach_rate} rad/s")


def _errors(run: Run, axis: int) -> tuple[Array, Array]:
    return with_gaps(drawable(run.error))[:, axis], drawable(run.rate_error[:, axis])


def _path(panel: Axes, e: Array, rate: Array, parts: Sequence[tuple[npt.NDArray[np.intp], float]], axis: int) -> None:
    """Draw parts of the path of the errors, each with its rows and its opacity."""
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.0} if len(e) <= FEW else {}
    width = 0.4 if _is_wool(rate[np.concatenate([rows for rows, _ in parts])]) else 0.8
    for rows, alpha in parts:
        panel.plot(e[rows], rate[rows], color=AXES[axis], alpha=alpha, linewidth=width, **marks)


def _label(panel: Axes, axis: int) -> None:
    letter = XYZ[axis]
    panel.set(xlabel=f"$e_{letter}$ [rad]", ylabel=rf"$\dot e_{letter}$ [rad/s]")
    panel.locator_params(axis="x", nbins=4)
    panel.locator_params(axis="y", nbins=6)
    panel.ticklabel_format(scilimits=(-2, 3))


def _is_wool(rate: Array) -> bool:
    """Return True if a curve turns so often that its lines would run into each other, as with chattering."""
    turns = np.diff(np.sign(np.diff(rate))) != 0.0
    return len(turns) > 500 and float(turns.mean()) > 0.2


def _frame(panel: Axes, e: Array, rate: Array, squeezed: float) -> bool:
    """Set the ends of both axes, with zero inside; returns whether something is beyond them.

    Args:
        panel: the panel.
        e: attitude error.
        rate: rate error.
        squeezed: how many times longer than the bulk an axis may be; see :func:`.view`.
    """
    across, upwards = (view(np.append(values, 0.0), squeezed) for values in (e, rate))
    panel.set(xlim=across[:2], ylim=upwards[:2])
    return across[2] or upwards[2]


def _surface(panel: Axes, run: Run, axis: int) -> Surface | None:
    """Draw where the surface is zero at the median slope, and its boundary layer; None for a law without a surface."""
    if "slope" not in run.channels:
        return None
    slopes = run.slope[:, axis][np.isfinite(run.slope[:, axis])]
    if not len(slopes):
        return None
    slope = float(np.median(slopes))
    ends = np.array(panel.get_xlim())
    panel.plot(ends, -slope * ends, color=INK, linestyle="--", linewidth=0.9, zorder=3)
    layer = run.measurement.boundary_layer
    if layer is not None:
        line = -slope * ends
        look: dict[str, Any] = {"color": LAYER, "alpha": 0.2, "linewidth": 0.0}
        panel.fill_between(ends, line - layer[axis], line + layer[axis], zorder=0, **look)
    return Surface(slope, _meaning(run))


def _meaning(run: Run) -> str:
    """``S = 0``, unless the surface is known to have further terms, such as an integral."""
    if "measured_attitude" in run.channels:
        return "S = 0"  # of what was measured: nothing can be said
    rest = np.abs(run.surface - run.slope * run.error - run.rate_error)
    scale = np.abs(run.surface) + np.abs(run.rate_error)
    return "S = 0" if not (rest > 1e-6 * scale + 1e-12).any() else "λαe + ė = 0"
