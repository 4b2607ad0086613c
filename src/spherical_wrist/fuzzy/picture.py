"""Picture of a rule base: fuzzy sets, output over the inputs, slices of it, and the results of its analysis.

Only this file of the room imports matplotlib, and only when a picture is drawn. Figures are made without pyplot:
nothing global is changed, and no screen is needed.
"""

from collections.abc import Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.colours import PALE, VERMILION
from spherical_wrist.errors import ParameterError
from spherical_wrist.files import write_whole
from spherical_wrist.fuzzy.analysis import Report, report
from spherical_wrist.fuzzy.mamdani import Mamdani
from spherical_wrist.fuzzy.rules import Inference
from spherical_wrist.fuzzy.takagi_sugeno import Sugeno
from spherical_wrist.fuzzy.variable import Variable
from spherical_wrist.picture_file import IN_FOLDER, check_ending, picture_bytes
from spherical_wrist.picture_style import SMALL, STYLE, WIDTHS

FORMATS = tuple(f".{kind}" for kind in IN_FOLDER)
"""Endings of pictures: not PGF, which cannot hold the shaded surface."""
_GAP, _REFUSED = PALE, VERMILION
"""Colours of gaps, and of values that are not positive."""
_WIDTH, _HEIGHT, _LINE, _LETTERS = WIDTHS["two-column"], 4.6, 0.17, 105
"""Width of the picture, its height without the text below, and the height of a line of that [in]; letters in a line."""


class Picture(NamedTuple):
    """Drawn rule base.

    Attributes:
        figure: a ``matplotlib.figure.Figure``.
        report: analysis on the grid that is drawn.
    """

    figure: Any
    report: Report

    def content(self, kind: str) -> bytes:
        """Return the drawing as a file of a kind, such as ``"svg"``; the same rule base makes the same bytes."""
        return picture_bytes(self.figure, kind)


def picture(
    inference: Inference,
    path: str | Path | None = None,
    *,
    title: str = "",
    points: int = 241,
    threshold: float = 0.01,
    held: Mapping[str, float] | None = None,
) -> Picture:
    """Draw a rule base with its inference, and save the drawing if a path is given.

    Args:
        inference: a ``Sugeno`` or a ``Mamdani``; of the law, ``law.tuner.system()``.
        path: file to write, PNG, SVG or PDF.
        title: title above the drawing.
        points: see :func:`spherical_wrist.fuzzy.analysis.report`.
        threshold: likewise.
        held: likewise.

    Raises:
        ParameterError: the path has another ending, or its folder does not exist.
        RecordingError: the file cannot be written.
    """
    file = None if path is None else Path(path)
    if file is not None:
        check_ending(file, "picture", FORMATS)
        if not file.parent.is_dir():
            raise ParameterError(f"picture {str(file)!r}: its folder does not exist; create it, or choose another")
    import matplotlib as mpl
    from matplotlib.figure import Figure

    found = report(inference, points, threshold, held)
    with mpl.rc_context(STYLE):
        words = [part for text in found.lines() for part in wrap(text, _LETTERS)]
        foot = _LINE * (1 + len(words))
        figure: Any = Figure(figsize=(_WIDTH, _HEIGHT + foot))
        share = foot / (_HEIGHT + foot)
        figure.set_layout_engine("constrained", rect=(0.0, share, 1.0, 1.0 - share))
        top, bottom = figure.add_gridspec(2, 1, height_ratios=(0.35, 0.65))
        variables = inference.rules.variables
        panels = top.subgridspec(1, len(variables) + 1).subplots(sharey=True)
        for panel, variable in zip(panels, variables, strict=False):
            _draw_sets(panel, variable)
        panels[0].set_ylabel("degree")
        _draw_outputs(panels[-1], inference, found)
        if len(variables) > 1:
            surface, slices = bottom.subgridspec(1, 2, width_ratios=(1.25, 1.0)).subplots()
            _draw_surface(surface, found)
        else:
            slices = figure.add_subplot(bottom)
        _draw_slices(slices, found)
        if title:
            figure.suptitle(title, weight="bold")
        figure.text(0.012, 0.5 * share, "\n".join(words), va="center", linespacing=1.5)
    drawn = Picture(figure, found)
    if file is not None:
        write_whole(file, drawn.content(file.suffix[1:].lower()), "picture")
    return drawn


def _colours(count: int) -> Any:
    import matplotlib as mpl

    return mpl.colormaps["viridis"](np.linspace(0.0, 0.88, count))


def _label(variable: Variable) -> str:
    return f"{variable.name} / {variable.unit}" if variable.unit else variable.name


def _draw_sets(panel: Any, variable: Variable) -> None:
    """Draw the membership functions of one variable, with the names of its values above their highest points."""
    x = variable.grid(1001)
    degrees = variable.degrees(x)
    peaks = {value: float(x[mu >= mu.max() - 1e-12].mean()) for value, mu in degrees.items()}
    for (value, mu), colour in zip(degrees.items(), _colours(len(degrees)), strict=True):
        panel.plot(x, np.where(mu > 0.0, mu, np.nan), color=colour, lw=1.2)
        share = (peaks[value] - variable.low) / (variable.high - variable.low)
        side = "left" if share < 0.02 else "right" if share > 0.98 else "center"
        shift = {"left": 3, "center": 0, "right": -3}[side]
        panel.annotate(value, (peaks[value], mu.max()), (shift, 4), textcoords="offset points", ha=side, color=colour)
    panel.set(xlabel=_label(variable), xlim=(variable.low, variable.high), ylim=(0.0, 1.18), yticks=(0.0, 0.5, 1.0))
    panel.locator_params(axis="x", nbins=5)


def _draw_outputs(panel: Any, inference: Inference, found: Report) -> None:
    """Draw the then-parts: sets, or numbers as singletons."""
    if isinstance(inference, Mamdani):
        _draw_sets(panel, inference.output)
        panel.set_title("then-sets")
        return
    panel.set(xlabel=inference.name, ylim=(0.0, 1.18))
    if isinstance(inference, Sugeno):
        grid = np.meshgrid(found.first, found.second, indexing="ij")[: len(found.variables)]
        inputs: tuple[npt.ArrayLike, ...] = (*(x.ravel() for x in grid), *found.held.values())
        strongest = inference.rules.strengths(*inputs).argmax(axis=1)
        consequents = inference.consequents(*inputs)
        values, counts = np.unique(consequents[np.arange(len(strongest)), strongest].round(9), return_counts=True)
        panel.vlines(values, 0.0, 1.0, colors=_colours(len(values)), lw=1.6)
        for value, count in zip(values, counts, strict=True):
            panel.annotate(f"×{count}", (value, 1.0), (0, 4), textcoords="offset points", ha="center")
        where = " where their rules fire most" if inference.order else ""
        panel.set_title(f"then-parts{where}, × number of rules")


def _draw_surface(panel: Any, found: Report) -> None:
    """Draw the output over both inputs as colours with contours; gaps hatched, values that are not positive red."""
    from matplotlib.ticker import MaxNLocator

    first, second = found.variables
    # rounded, or a contour at the height of a plateau would trace the rounding errors on it
    shown = np.ma.masked_invalid(found.output.T.round(9))
    panel.set_facecolor(_GAP)
    if shown.count():
        mesh = panel.pcolormesh(found.first, found.second, shown, cmap="viridis", shading="gouraud", rasterized=True)
        panel.figure.colorbar(mesh, ax=panel, pad=0.02)
        if found.highest - found.lowest > 1e-9 * abs(found.highest):
            round_numbers = np.asarray(MaxNLocator(10).tick_values(found.lowest, found.highest))
            # not the very ends, where a contour would be a corner of the panel
            margin = 0.01 * (found.highest - found.lowest)
            inside = (found.lowest + margin < round_numbers) & (round_numbers < found.highest - margin)
            levels = round_numbers[inside]
            lines = panel.contour(found.first, found.second, shown, levels=levels, colors="white", linewidths=0.6)
            panel.clabel(lines, fontsize=SMALL, fmt=lambda height: f"{height:.3g}".replace("-", "−"))
        if not found.positive and found.lowest <= 0.0:
            panel.contourf(
                found.first, found.second, shown, levels=[found.lowest - 1.0, 0.0], colors=_REFUSED, alpha=0.5
            )
    if found.gaps.any():
        panel.contourf(
            found.first, found.second, found.gaps.T.astype(float), levels=[0.5, 1.5], colors="none", hatches=["////"]
        )
    title = f"{found.inference.name}({first.name}, {second.name})"
    title += "   hatched: no rule fires" if found.gaps.any() else ""
    title += "   red: not positive" if found.lowest <= 0.0 else ""
    panel.set_title(title)
    panel.locator_params(nbins=5)
    panel.set(xlabel=_label(first), ylabel=_label(second))


def _draw_slices(panel: Any, found: Report) -> None:
    """Draw the output over the first input, at five values of the second."""
    name = found.inference.name
    if len(found.variables) == 1:
        panel.plot(found.first, found.output[:, 0], color=_colours(1)[0], lw=1.2)
        panel.fill_between(found.first, 0, 1, found.gaps[:, 0], color=_GAP, transform=panel.get_xaxis_transform())
    else:
        second = found.variables[1].name
        columns = np.linspace(0, len(found.second) - 1, 5).round().astype(int)
        for column, colour in zip(columns, _colours(len(columns)), strict=True):
            label = f"{second} = {found.second[column]:.3g}".replace("-", "−")
            # dashes for the lower half: slices at opposite values often coincide, and both are to be seen
            style: dict[str, Any] = {"ls": (0, (4, 3)), "zorder": 3} if 2 * column < len(found.second) - 1 else {}
            panel.plot(found.first, found.output[:, column], color=colour, lw=1.2, label=label, **style)
        panel.legend()
    if found.lowest <= 0.0:
        panel.axhline(0.0, color=_REFUSED, lw=0.8)
    panel.locator_params(axis="x", nbins=5)
    panel.set(xlabel=_label(found.variables[0]), ylabel=name, xlim=(found.first[0], found.first[-1]))
