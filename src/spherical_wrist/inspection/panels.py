"""Panels of a run over time, one a quantity; those of channels that it does not have are left out."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from spherical_wrist.arrays import Array
from spherical_wrist.channels import XYZ, Place, Source
from spherical_wrist.colours import AXES, GREY, ORANGE, of_components
from spherical_wrist.inspection.curves import BINS, drawable, with_gaps
from spherical_wrist.inspection.drawing import INK, LAYER, figure, fit, fit_decades, line, lines, name
from spherical_wrist.measure.series import Plot, in_place
from spherical_wrist.simulation.run import Run
from spherical_wrist.so3 import rotation_vectors

Panel = Callable[[Axes], None]
WIDE: dict[str, Any] = {"linewidth": 3.2, "alpha": 0.28, "marker": "", "solid_capstyle": "butt"}
"""Of a curve that lies behind another one."""


class MotionPanel(NamedTuple):
    """Panel of the closed loop itself.

    Attributes:
        shows: channels that it shows, beside those of the phase portraits.
        draw: draws it.
    """

    shows: frozenset[str]
    draw: Callable[..., None]


PORTRAYED = frozenset({"error", "rate_error"})
"""Channels of the phase portraits."""


def motion_panels(run: Run) -> Iterator[Panel]:
    """Return the panels of the closed loop itself."""
    for motion in _motions(run):
        yield partial(motion.draw, run=run)


def other_panels(run: Run, *places: Place) -> list[Panel]:
    """Return a panel for each plot of some places whose channel neither motion panels nor phase portraits show."""
    shown = PORTRAYED.union(*(motion.shows for motion in _MOTIONS))
    plots = [plot for plot in in_place(list(run.plots()), *places) if plot.channel.name not in shown]
    return [partial(_plot, time=run.time, plot=plot) for plot in plots]


def _motions(run: Run) -> Iterator[MotionPanel]:
    """Return the panels that a run has something to draw for; the slope has one only if it varies."""
    for motion in _MOTIONS:
        if "slope" in motion.shows and (("slope" not in run.channels) or _slope_is_constant(run)):
            continue
        if "surface" in motion.shows and "surface" not in run.channels:
            continue
        yield motion


def _attitude(panel: Axes, run: Run) -> None:
    desired, actual = (with_gaps(rotation_vectors(each)) for each in (run.desired_attitude, run.attitude))
    lines(panel, run.time, desired, **WIDE)
    lines(panel, run.time, actual)
    fit(panel, desired, actual)
    panel.set_ylabel("log q [rad]")
    name(panel, "Attitude as rotation vector", "line: actual · wide: desired")


def _error(panel: Axes, run: Run) -> None:
    lines(panel, run.time, with_gaps(drawable(run.error)))
    fit(panel, run.error)
    panel.set_ylabel("e [rad]")
    name(panel, "Attitude error", "body frame, desired − actual")


def _size(panel: Axes, run: Run, label: str, unit: str) -> None:
    vectors = run.error if unit == "rad" else 1e3 * (run.tip - run.desired_tip)
    size = np.linalg.norm(drawable(vectors), axis=1)
    line(panel, run.time, size, color=INK)
    title, figures = ("Attitude error", "error") if unit == "rad" else ("Tip error", "tip_error")
    rms, largest = (getattr(run.metrics, f"{which}_{figures}_{unit}") for which in ("rms", "max"))
    bound = [run.measurement.bound] if unit == "mm" else []
    fit_decades(panel, np.append(size, bound))
    for value, dash in ((rms, "-"), (largest, ":")):
        if value:
            start = min(max(run.measurement.window_start, run.time[0]), run.time[-1])
            stop = max(min(run.measurement.window_end, run.time[-1]), start)
            panel.hlines(value, start, stop, color=ORANGE, linestyle=dash, linewidth=1.3, zorder=3)
    panel.set_ylabel(label)
    words = ["no sample in the steady window"]
    if rms is not None:
        words = [f"RMS {figure(rms, unit)} (line)", f"largest {figure(largest, unit)} (dots)"]
    for limit in bound:
        panel.axhline(limit, color=GREY, linestyle="--", linewidth=1.3, zorder=3)
        words.append(f"bound {figure(limit, unit)} (dashed)")
    name(panel, f"{title}, size", " · ".join(words))


def _torque(panel: Axes, run: Run) -> None:
    shown = [run.torque]
    words = []
    if "commanded_torque" in run.channels and np.nanmax(np.abs(run.command - run.torque)) > 0.0:
        lines(panel, run.time, run.command, **WIDE)
        shown.append(run.command)
        words.append("wide: commanded")
    lines(panel, run.time, run.torque)
    if np.any(run.disturbance):
        shown.append(run.disturbance)
        words.append("dashed: disturbance")
        alike = (run.disturbance == run.disturbance[:, :1]).all()
        draw: dict[str, Any] = {"linestyle": (0, (5, 3)), "marker": "", "linewidth": 0.9}
        if alike:
            line(panel, run.time, run.disturbance[:, 0], color=INK, **draw)
        else:
            lines(panel, run.time, run.disturbance, **draw)
    fit(panel, *shown)
    panel.set_ylabel("τ [N·m]")
    peak, chattering = run.metrics.peak_torque_Nm, run.metrics.chattering_Nm_per_s
    if peak is not None:
        words.append(f"peak {figure(peak, 'N·m')}, chattering {figure(chattering, 'N·m/s')}")
    name(panel, "Torque", " · ".join(words))


def _surface(panel: Axes, run: Run) -> None:
    lines(panel, run.time, run.surface)
    fit(panel, run.surface)
    low, high = panel.get_ylim()
    layer, text = run.measurement.boundary_layer, ""
    if layer is not None:
        text = f"boundary layer ±{_vector(layer)} rad/s"
        for colour, width in dict(zip(AXES, layer, strict=True)).items():
            panel.axhspan(-width, width, color=LAYER, alpha=0.1, linewidth=0.0, zorder=0)
            panel.hlines((-width, width), *run.time[[0, -1]], color=colour, linestyle=":", linewidth=0.8)
        if max(abs(low), abs(high)) < min(layer):
            text = f"all within the {text}"
    panel.set_ylim(low, high)
    panel.set_ylabel("S [rad/s]")
    if "slope" in run.channels and _slope_is_constant(run):
        slope = run.slope[np.isfinite(run.slope)]
        text = " · ".join(filter(None, [f"slope λ = {figure(float(slope[0]))} 1/s" if len(slope) else "", text]))
    name(panel, "Sliding surface", text)


def _vector(values: tuple[float, ...]) -> str:
    return figure(values[0]) if len(set(values)) == 1 else f"({', '.join(map(figure, values))})"


def _slope(panel: Axes, run: Run) -> None:
    lines(panel, run.time, run.slope)
    fit(panel, run.slope)
    panel.set_ylabel("λα [1/s]")
    slope = run.slope[np.isfinite(run.slope)]
    name(panel, "Slope of the surface", f"{slope.min():.4g} … {slope.max():.4g} 1/s")


def _slope_is_constant(run: Run) -> bool:
    slope = run.slope[np.isfinite(run.slope)]
    return not len(slope) or bool(np.ptp(slope) <= 1e-9 * np.abs(slope).max())


def _plot(panel: Axes, time: Array, plot: Plot) -> None:
    curves = drawable(plot.curves)
    if plot.axes == list(XYZ):
        lines(panel, time, curves)
    elif len(plot.axes) > 1 and (colours := of_components(plot.axes)):
        for values, axis, colour in zip(curves.T, plot.axes, colours, strict=True):
            line(panel, time, values, color=colour, label=axis)
        if len(set(colours)) == len(colours):  # else they are those of x, y and z
            panel.legend(loc="upper right", ncols=len(colours), fontsize=7.0, handlelength=1.0, columnspacing=1.0)
    else:
        bins = max(BINS // len(plot.axes), 100)
        for values in curves.T:
            line(panel, time, values, bins, color=INK, linewidth=0.6, alpha=1.0 if len(plot.axes) == 1 else 0.35)
    fit(panel, curves)
    is_state = plot.channel.source is Source.STATE
    symbol = "" if is_state else plot.symbol
    panel.set_ylabel(f"{symbol} [{plot.unit}]".strip() if plot.unit else symbol)
    panel.locator_params(axis="y", nbins=3)
    rms = float(np.sqrt(np.nanmean(np.square(curves).sum(axis=1)))) if np.isfinite(curves).any() else None
    figures = f"RMS {figure(rms, plot.unit)}" if plot.unit and not is_state else ""
    name(panel, plot.heading, figures, bold=False)


_MOTIONS = (
    MotionPanel(frozenset({"attitude", "desired_attitude"}), _attitude),
    MotionPanel(frozenset({"error"}), _error),
    MotionPanel(frozenset({"error"}), partial(_size, label="|e| [rad]", unit="rad")),
    MotionPanel(frozenset({"tip", "desired_tip"}), partial(_size, label="|Δp| [mm]", unit="mm")),
    MotionPanel(frozenset({"torque", "disturbance"}), _torque),
    MotionPanel(frozenset({"surface"}), _surface),
    MotionPanel(frozenset({"slope"}), _slope),
)
