"""What a run did over time, one panel a quantity; those that it has nothing for are left out."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from spherical_wrist.experiment.run import Run
from spherical_wrist.inspection.curves import BINS, drawable, rotation_vectors, with_gaps
from spherical_wrist.inspection.drawing import AXES, INK, LAYER, figure, fit, fit_decades, line, lines, name
from spherical_wrist.recording.hardware import hardware_curves
from spherical_wrist.recording.layout import HARDWARE

Array = npt.NDArray[np.float64]
Panel = Callable[[Axes], None]
WIDE: dict[str, Any] = {"linewidth": 3.2, "alpha": 0.28, "marker": "", "solid_capstyle": "butt"}
"""Of a curve that lies behind another one."""

_FAULTS = {
    "sensed_attitude": "Sensors: from true to measured attitude",
    "sensed_rate": "Sensors: measured − true rate",
    "made_torque": "Motors: delivered − commanded torque",
    "current": "Currents of the coils",
    "condition": "Condition number of the torque map",
}


def motion_panels(run: Run) -> Iterator[Panel]:
    """Panels of the closed loop itself."""
    yield lambda panel: _attitude(panel, run)
    yield lambda panel: _error(panel, run)
    yield lambda panel: _size(panel, run, "|e| [rad]", run.error, "rad")
    yield lambda panel: _size(panel, run, "|Δp| [mm]", 1e3 * (run.tip - run.desired_tip), "mm")
    yield lambda panel: _torque(panel, run)
    if np.isfinite(run.surface).any():
        yield lambda panel: _surface(panel, run)
    slope = run.slope[np.isfinite(run.slope)]
    if len(slope) and np.ptp(slope) > 1e-9 * np.abs(slope).max():
        yield lambda panel: _slope(panel, run)


def hardware_panels(run: Run) -> Iterator[Panel]:
    """Panels of what sensors and motors that are not ideal do; none of ideal ones."""
    for kind, curves in hardware_curves(run.arrays()).items():
        yield partial(_fault, time=run.time, kind=kind, curves=curves)


def _attitude(panel: Axes, run: Run) -> None:
    desired, actual = rotation_vectors(run.desired_attitude), rotation_vectors(run.attitude)
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


def _size(panel: Axes, run: Run, label: str, vectors: Array, unit: str) -> None:
    size = np.linalg.norm(drawable(vectors), axis=1)
    line(panel, run.time, size, color=INK)
    title, figures = ("Attitude error", "error") if unit == "rad" else ("Tool tip error", "tip_error")
    rms, largest = (getattr(run.metrics, f"{which}_{figures}_{unit}") for which in ("rms", "max"))
    fit_decades(panel, size)
    for value, dash in ((rms, "-"), (largest, ":")):
        if value:
            start = min(max(run.measurement.window_start, run.time[0]), run.time[-1])
            panel.hlines(value, start, run.time[-1], color=AXES[0], linestyle=dash, linewidth=1.1, zorder=3)
    panel.set_ylabel(label)
    text = f"RMS {figure(rms)} (line) · largest {figure(largest)} {unit} (dots)" if rms is not None else ""
    name(panel, f"{title}, size", text or "no sample in the steady window")


def _torque(panel: Axes, run: Run) -> None:
    shown = [run.torque]
    words = []
    if run.commanded_torque.size and np.nanmax(np.abs(run.commanded_torque - run.torque)) > 0.0:
        lines(panel, run.time, run.commanded_torque, **WIDE)
        shown.append(run.commanded_torque)
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
    slope = run.slope[np.isfinite(run.slope)]
    if len(slope) and np.ptp(slope) <= 1e-9 * np.abs(slope).max():
        text = f"slope λ = {figure(float(slope[0]))} 1/s" + (f" · {text}" if text else "")
    name(panel, "Sliding surface", text)


def _vector(values: tuple[float, ...]) -> str:
    return figure(values[0]) if len(set(values)) == 1 else f"({', '.join(map(figure, values))})"


def _slope(panel: Axes, run: Run) -> None:
    lines(panel, run.time, run.slope)
    fit(panel, run.slope)
    panel.set_ylabel("λα [1/s]")
    slope = run.slope[np.isfinite(run.slope)]
    name(panel, "Slope of the surface", f"{slope.min():.4g} … {slope.max():.4g} 1/s")


def _fault(panel: Axes, time: Array, kind: str, curves: Array) -> None:
    _, symbol, unit = HARDWARE[kind]
    curves = drawable(curves)
    if curves.shape[1] == 3:
        lines(panel, time, curves)
    else:
        bins = max(BINS // curves.shape[1], 100)
        for values in curves.T:
            line(panel, time, values, bins, color=INK, linewidth=0.6, alpha=1.0 if curves.shape[1] == 1 else 0.35)
    fit(panel, curves)
    panel.set_ylabel(f"{symbol} [{unit}]" if unit else symbol)
    rms = float(np.sqrt(np.nanmean(np.square(curves).sum(axis=1)))) if np.isfinite(curves).any() else None
    name(panel, _FAULTS[kind], "" if kind == "condition" else f"RMS {figure(rms, unit)}")
