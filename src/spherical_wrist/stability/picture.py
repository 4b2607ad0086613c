"""Picture of margins: sensitivity and tip response over the frequency, and the worst tip error, of several laws."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from spherical_wrist.comparison.picture import LABEL_SIZE
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import literal

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f")
"""Colours of Okabe and Ito, which people with colour-blindness tell apart; more laws have other lines."""
LINES = ("-", "--", ":", "-.")
CLAIMED = 2.0
"""Sensitivity that a robust loop stays below (6 dB)."""


def margins_picture(table: Mapping[str, Any]) -> Figure:
    """Draw the margins of the laws that have a linear loop.

    Args:
        table: margins as :func:`spherical_wrist.stability.report.to_dict` returns them.
    """
    laws = sorted((law for law in table["laws"] if law["stable"]), key=lambda law: law["worst_tip_error_mm"])
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(13.2, 4.0 + 0.06 * len(laws)), layout=ConstrainedLayoutEngine(w_pad=0.12))
        sensitivity, tip, worst = drawing.subplots(1, 3, width_ratios=(1.0, 1.0, 0.95))
        for index, law in enumerate(laws):
            look = {"color": COLOURS[index % len(COLOURS)], "linestyle": LINES[index // len(COLOURS) % len(LINES)]}
            response = law["response"]
            sensitivity.plot(response["frequency_hz"], response["sensitivity"], **look)
            tip.plot(response["frequency_hz"], response["tip_mm_per_Nm"], **look)
        _frequencies(sensitivity, "sensitivity at the plant's input", "largest gain from torque to sum of torques")
        sensitivity.axhline(CLAIMED, color="#7f7f7f", linewidth=0.8)
        sensitivity.annotate(
            "Ms = 2", (0.02, CLAIMED), xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points",
            fontsize=LABEL_SIZE, color="#7f7f7f",
        )  # fmt: skip
        sensitivity.set_ylim(bottom=1e-3)
        _frequencies(tip, "tip response to a torque on the joint", "largest displacement [mm/(N·m)]")
        peak = max((max(law["response"]["tip_mm_per_Nm"]) for law in laws), default=1.0)
        tip.set_ylim(1e-4 * peak, 2.0 * peak)
        _worst(worst, laws, table["disturbance"])
    return drawing


def _frequencies(panel: Axes, title: str, label: str) -> None:
    panel.set(xscale="log", yscale="log", xlabel="frequency [Hz]", ylabel=label, title=title)
    panel.xaxis.set_major_formatter("{x:g}")
    panel.margins(x=0.0)


def _worst(panel: Axes, laws: list[Mapping[str, Any]], disturbance: Mapping[str, Any]) -> None:
    """Draw one dot per law, in the look of its lines: the panel is also their legend."""
    errors = np.array([1e3 * law["worst_tip_error_mm"] for law in laws])
    for place, (law, error) in enumerate(zip(laws, errors, strict=True)):
        colour, line = COLOURS[place % len(COLOURS)], LINES[place // len(COLOURS) % len(LINES)]
        panel.plot([1e-9, error], [place, place], color=colour, linestyle=line)
        panel.plot(error, place, "o", color=colour, markersize=5)
        shown = f"{error:.0f}" if error >= 100.0 else f"{error:.3g}"
        text = f"{shown}   (Ms {law['max_sensitivity']:.2f})"
        panel.annotate(
            text, (error, place), xytext=(6, 0), textcoords="offset points", va="center", fontsize=LABEL_SIZE
        )
    panel.set_yticks(range(len(laws)), [literal(law["law"].replace("_", " ")) for law in laws], fontsize=LABEL_SIZE)
    panel.set(xscale="log", xlabel="largest tip error by linear theory [µm]", ylim=(len(laws) - 0.4, -0.6))
    if len(errors) and errors.min() > 0.0:
        panel.set_xlim(0.4 * errors.min(), 30.0 * errors.max())
    panel.xaxis.set_major_formatter("{x:g}")
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    level, size = disturbance["level"], f"{1e3 * disturbance['size_Nm']:.3g} mN·m"
    panel.set_title(f"torques within ±{size}" + ("" if level is None else f" ({100.0 * level:g} %)"))
