"""Figures 1 and 2 of the paper: trajectory following, and disturbance rejection.

What switches is drawn as the envelope that it fills, from the smallest to the largest value of every ``WINDOW``, since
its edges would run into each other.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spherical_wrist.arrays import Array
from spherical_wrist.colours import GREY, INK, ORANGE, PALE, PAPER
from spherical_wrist.control import FuzzySlidingComputedTorque
from spherical_wrist.fuzzy.picture import picture
from spherical_wrist.paper.angle_chart import angles_of_attitude, wrapped
from spherical_wrist.paper.evaluation.runs import Evaluation, PaperCase
from spherical_wrist.paper.evaluation.setting import (
    BASELINE,
    DURATION,
    MAIN,
    PLAIN,
    PROPOSED,
    SMOOTH,
    STEADY_FROM,
    VARIANTS,
)
from spherical_wrist.picture_file import IN_FOLDER, folder_pictures
from spherical_wrist.picture_style import STYLE, WIDTHS
from spherical_wrist.simulation.run import Run

LOOK: dict[str, dict[str, Any]] = {
    PLAIN: {"color": GREY, "linestyle": (0, (1, 1)), "label": "computed torque", "zorder": 2},
    BASELINE: {"color": ORANGE, "linestyle": "-", "label": "baseline (fixed slope)", "zorder": 3},
    PROPOSED: {"color": PAPER, "linestyle": "-", "label": "proposed (fuzzy slope)", "zorder": 4},
}
BEHIND: Any = {"color": PALE, "linewidth": 4.0, "solid_capstyle": "butt", "label": "desired", "zorder": 1}
ANGLES = ("α", "β", "γ")
WINDOW = 0.02
"""Time [s] of one point of an envelope."""
ZOOM, TINY = (3.0, 3.03), 1e-9
"""Interval [s] in which figure 2 shows every switch of the torque, and the rounding of times."""
ENDS = (0.0, DURATION)


class Envelope(NamedTuple):
    """Values of consecutive windows: middle of their time [s]; smallest, largest and mean value."""

    time: Array
    low: Array
    high: Array
    mean: Array


def envelope(run: Run, values: Array) -> Envelope:
    """Reduce a series of a run to its envelope.

    Args:
        run: the run.
        values: series at its control instants, (n,). The last ones, which fill no window, are left out.
    """
    size = max(1, round(WINDOW / run.experiment.control_period))
    time, cut = (each[: len(each) // size * size].reshape(-1, size) for each in (run.time, values))
    return Envelope(time.mean(axis=1), cut.min(axis=1), cut.max(axis=1), cut.mean(axis=1))


def figure_1(found: Evaluation) -> Figure:
    """Draw trajectory following without disturbance: the angles, how far each is off, and the attitude error."""
    runs = {method: found.runs[PaperCase(method, MAIN, 0.0)] for method in (BASELINE, PROPOSED)}
    desired = angles_of_attitude(runs[BASELINE].desired_attitude)
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(WIDTHS["two-column"], 5.2), layout="constrained")
        panels = drawing.subplot_mosaic([["followed"] * 3, list(ANGLES), ["size"] * 3])
        _followed(panels["followed"], runs, desired)
        for i, angle in enumerate(ANGLES):
            _deviation(panels[angle], runs, desired[:, i], i)
            panels[angle].set_title(f"{angle}: desired − actual")
            panels[angle].set_xlabel("time [s]")
        reach = max(panels[angle].get_ylim()[1] for angle in ANGLES)
        for angle in ANGLES:
            panels[angle].set_ylim(-reach, reach)
            panels[angle].tick_params(labelleft=angle == ANGLES[0])
        panels[ANGLES[0]].set_ylabel("error [µrad]")
        for method, run in runs.items():
            _shade(panels["size"], _size(run), method, edges=False)
        panels["size"].set(xlabel="time [s]", ylabel="|e| [rad]", yscale="log", ylim=(1e-7, 2e-3), xlim=ENDS)
        panels["size"].set_title(f"Attitude error: mean (line) and envelope (shade) of every {1e3 * WINDOW:.0f} ms")
        _legend(drawing, BEHIND, *(LOOK[method] for method in runs))
    return drawing


def figure_2(found: Evaluation) -> Figure:
    """Draw rejection of the 25 % disturbance: error, envelope of the torque, and its switches in a short interval."""
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(WIDTHS["two-column"], 5.8), layout="constrained")
        axes = drawing.subplots(3, 2, sharex="row", sharey="row")
        for column, variant in enumerate((MAIN, SMOOTH)):
            size, torque, switches = axes[:, column]
            runs = {method: found.runs[PaperCase(method, "" if method == PLAIN else variant, 0.25)] for method in LOOK}
            for method, run in runs.items():
                _shade(size, _size(run), method, edges=False)
                # both methods fill the same envelope: one of them is its edges alone
                _shade(torque, envelope(run, run.torque[:, 0]), method, fill=method != PROPOSED)
                shown = (run.time >= ZOOM[0] - TINY) & (run.time <= ZOOM[1] + TINY)
                time = 1e3 * (run.time[shown] - ZOOM[0])
                switches.plot(time, run.torque[shown, 0], **LOOK[method], drawstyle="steps-post")
            size.set(title=VARIANTS[variant].title, xlabel="time [s]", yscale="log", ylim=(2e-5, 0.2), xlim=ENDS)
            torque.set(xlabel="time [s]", xlim=ENDS)
            switches.set(xlabel=f"time after {ZOOM[0]:g} s [ms]", xlim=(0.0, 1e3 * (ZOOM[1] - ZOOM[0])))
        axes[0, 0].set_ylabel("|e| [rad]")
        for row in (1, 2):
            axes[row, 0].set_ylabel("torque about x [N·m]")
        _legend(drawing, *LOOK.values())
    return drawing


def files(found: Evaluation) -> dict[str, bytes]:
    """Draw both figures and a picture of the rule base in the formats of a folder, keyed by file name."""
    contents = folder_pictures(figure_1(found), "figure-1") | folder_pictures(figure_2(found), "figure-2")
    rules = picture(FuzzySlidingComputedTorque().tuner.system())
    return contents | {f"rules.{kind}": rules.content(kind) for kind in IN_FOLDER}


def _followed(panel: Axes, runs: Mapping[str, Run], desired: Array) -> None:
    """Draw the angles: the desired ones behind, and the methods in dashes that take turns, since they coincide."""
    for i, angle in enumerate(ANGLES):
        for offset, (method, run) in enumerate(runs.items()):
            thin = slice(None, None, 10)
            look = {**LOOK[method], "linestyle": (8 * offset, (8, 8)), "linewidth": 1.2}
            panel.plot(run.time[thin], angles_of_attitude(run.attitude)[thin, i], **look)
        panel.plot(run.time[thin], desired[thin, i], **BEHIND)
        panel.annotate(
            angle, (run.time[-1], desired[-1, i]), (4, 0), textcoords="offset points", va="center", color=INK
        )
    panel.set(xlabel="time [s]", ylabel="angle [rad]", xlim=ENDS)


def _deviation(panel: Axes, runs: Mapping[str, Run], desired: Array, i: int) -> None:
    """Draw how far one angle is off, scaled to the steady window; the start is in the panel of the attitude error."""
    reach = 0.0
    for method, run in runs.items():
        off = 1e6 * wrapped(desired - angles_of_attitude(run.attitude)[:, i])
        _shade(panel, envelope(run, off), method)
        reach = max(reach, float(np.abs(off[run.time >= STEADY_FROM]).max()))
    panel.set(ylim=(-1.3 * reach, 1.3 * reach), xlim=ENDS)


def _shade(panel: Axes, shown: Envelope, method: str, *, edges: bool = True, fill: bool = True) -> None:
    """Draw an envelope: shaded, with its edges or the mean as lines in front of all shades."""
    look = LOOK[method]
    if fill:
        panel.fill_between(shown.time, shown.low, shown.high, color=look["color"], alpha=0.3, linewidth=0.0, zorder=1)
    for line in (shown.low, shown.high) if edges else (shown.mean,):
        panel.plot(shown.time, line, **look)


def _legend(drawing: Figure, *looks: Mapping[str, Any]) -> None:
    drawing.legend(handles=[Line2D([], [], **look) for look in looks], loc="outside upper center", ncols=len(looks))


def _size(run: Run) -> Envelope:
    """Return the envelope of the attitude error without its first window, at whose start it is zero."""
    whole = envelope(run, np.linalg.norm(run.error, axis=1))
    return Envelope(*(values[1:] for values in whole))
