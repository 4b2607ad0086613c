"""Figures 1 and 2 of the paper: trajectory following, and disturbance rejection."""

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from spherical_wrist.control import FuzzySlidingComputedTorque
from spherical_wrist.fuzzy.picture import picture
from spherical_wrist.paper.evaluation.runs import Case, Evaluation
from spherical_wrist.paper.evaluation.setting import BASELINE, MAIN, PLAIN, PROPOSED, SMOOTH
from spherical_wrist.picture_file import picture_bytes
from spherical_wrist.picture_style import STYLE
from spherical_wrist.simulation.run import Run

LOOK: dict[str, dict[str, Any]] = {
    PLAIN: {"color": "#7f7f7f", "linestyle": ":", "label": "computed torque"},
    BASELINE: {"color": "#d55e00", "linestyle": "-", "label": "baseline (fixed slope)"},
    PROPOSED: {"color": "#0072b2", "linestyle": "-", "label": "proposed (fuzzy slope)"},
}
KINDS = ("png", "svg")
ANGLES = ("α", "β", "γ")
ZOOM = (3.0, 3.05)
"""Interval [s] in which figure 2 shows the torque."""


def figure_1(found: Evaluation) -> Figure:
    """Draw trajectory following without disturbance: the angles, and the error below them on its own scale."""
    runs = {method: found.runs[Case(method, MAIN, 0.0)] for method in (BASELINE, PROPOSED)}
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(7.0, 6.4), layout="constrained")
        axes = drawing.subplots(4, 1, sharex=True, gridspec_kw={"height_ratios": [1, 1, 1, 1.3]})
        desired = _angles(runs[BASELINE].desired_attitude)
        for i, axis in enumerate(axes[:3]):
            axis.plot(runs[BASELINE].time, desired[:, i], color="black", linewidth=3.0, alpha=0.25, label="desired")
            for offset, (method, run) in enumerate(runs.items()):
                # alternating dashes, so that both methods are visible although their curves coincide
                axis.plot(run.time, _angles(run.attitude)[:, i], **{**LOOK[method], "linestyle": (6 * offset, (6, 6))})
            axis.set_ylabel(f"{ANGLES[i]} [rad]")
        for method, run in runs.items():
            axes[3].semilogy(run.time, _size(run), **{**LOOK[method], "linewidth": 0.8})
        axes[3].set(xlabel="time [s]", ylabel="|e| [rad]", ylim=(1e-7, 1e-2))
        drawing.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return drawing


def figure_2(found: Evaluation) -> Figure:
    """Draw rejection of the 25 % disturbance: the error, and a twentieth of a second of the torque below it."""
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(7.0, 5.6), layout="constrained")
        axes = drawing.subplots(2, 2, sharex="row", sharey="row")
        for column, (variant, title) in enumerate(((MAIN, "sign, as written"), (SMOOTH, "tanh boundary layer"))):
            above, below = axes[:, column]
            for method in (PLAIN, BASELINE, PROPOSED):
                run = found.runs[Case(method, "" if method == PLAIN else variant, 0.25)]
                shown = (run.time >= ZOOM[0]) & (run.time < ZOOM[1])
                above.semilogy(run.time, _size(run), **{**LOOK[method], "linewidth": 0.9})
                below.plot(
                    run.time[shown], run.torque[shown, 0], **{**LOOK[method], "linewidth": 1.0}, drawstyle="steps-post"
                )
            above.set(title=title, xlabel="time [s]", ylim=(1e-5, 0.2))
            below.set(xlabel="time [s]", xlim=ZOOM, xticks=np.linspace(*ZOOM, 6)[:-1])
        axes[0, 0].set_ylabel("|e| [rad]")
        axes[1, 0].set_ylabel("τ about x [N·m]")
        drawing.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return drawing


def files(found: Evaluation) -> dict[str, bytes]:
    """Draw both figures and a picture of the rule base as PNG and SVG, keyed by file name."""
    drawings = {"figure-1": figure_1(found), "figure-2": figure_2(found)}
    contents = {
        f"{name}.{kind}": picture_bytes(drawing, kind, STYLE) for name, drawing in drawings.items() for kind in KINDS
    }
    rules = picture(FuzzySlidingComputedTorque().tuner.system())
    return contents | {f"rules.{kind}": rules.content(kind) for kind in KINDS}


def _angles(attitude: np.ndarray) -> np.ndarray:
    return np.asarray(Rotation.from_quat(attitude, scalar_first=True).as_euler("XYZ"))


def _size(run: Run) -> np.ndarray:
    return np.asarray(np.linalg.norm(run.error, axis=1))
