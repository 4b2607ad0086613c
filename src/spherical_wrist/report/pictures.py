"""Pictures of a page, as inline SVG in the colours and the font of the page, readable in light and dark mode."""

import re
from collections.abc import Mapping, Sequence
from math import isinf, nan
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from spherical_wrist.colours import BLACK
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.picture_file import picture_bytes
from spherical_wrist.picture_style import LawLook, law_looks
from spherical_wrist.plain_text import literal
from spherical_wrist.report.table import FIGURES

INK, LINE = "#010203", "#020304"
"""Placeholders of the page's colours of text and of lines."""
Looks = Mapping[str, LawLook]
WIDTH, HEIGHT = 4.4, 3.0
MOST_BARS = 14
STYLE: Any = {
    "font.size": 9.5,
    "font.family": "sans-serif",
    "svg.fonttype": "none",
    "svg.hashsalt": "spherical-wrist",
    "axes.grid": True,
    "grid.color": LINE,
    "grid.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.5,
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK),
}


class Picture(NamedTuple):
    """A picture.

    Attributes:
        svg: an HTML element.
        caption: a sentence.
    """

    svg: str
    caption: str


def page_looks(statuses: Mapping[str, str]) -> dict[str, LawLook]:
    """Return the looks of laws on a page, by label: as in every picture, with its colour of text in place of black."""
    looks = law_looks(statuses, lines=True, many=True)
    return {law: look._replace(colour=INK) if look.colour == BLACK else look for law, look in looks.items()}


def distribution(
    curves: Mapping[str, Sequence[tuple[float, float]]], looks: Looks, label: str, caption: str
) -> Picture:
    """Draw the shares of episodes up to each value, by law, on a logarithmic axis."""
    drawing, panel = _new()
    for law, points in curves.items():
        shown = [(x, y) for x, y in points if x > 0.0]
        panel.plot(*_columns(shown), drawstyle="steps-post", **_line(looks[law]))
    panel.set(xscale="log", xlabel=label, ylabel="share of episodes up to it", ylim=(-0.02, 1.02))
    _plain_decades(panel)
    return _finished(drawing, caption)


def exceedance(
    curves: Mapping[str, Sequence[tuple[float, float]]], looks: Looks, label: str, bound: float, caption: str
) -> Picture:
    """Draw the shares of episodes above each value, by law, on logarithmic axes, with a bound."""
    drawing, panel = _new()
    for law, points in curves.items():
        shown = [(x, 1.0 - y) for x, y in points if x > 0.0 and y < 1.0]
        panel.plot(*_columns(shown), drawstyle="steps-post", **_line(looks[law]))
    panel.axvline(bound, color=INK, linewidth=1.0, linestyle="--")
    panel.annotate(
        f" {bound:g} mm", (bound, 1.0), xycoords=("data", "axes fraction"), va="top", fontsize=8.5, color=INK
    )
    panel.set(xscale="log", xlabel=label, ylabel="share of episodes above it")
    if any(len(points) > 1 for points in curves.values()):
        panel.set_yscale("log")
    panel.yaxis.set_major_formatter("{x:g}")
    panel.yaxis.set_minor_formatter(NullFormatter())
    _plain_decades(panel)
    return _finished(drawing, caption)


def against_parameter(
    bands: Mapping[str, Sequence[Mapping[str, Any]]],
    middles: Mapping[str, float],
    looks: Looks,
    name: str,
    caption: str,
) -> Picture:
    """Draw the median of the error against a parameter, and the band from 10 % to 90 %.

    Of several laws, draw medians and 90 % as multiples of the overall median of each, which shows the effect of the
    parameter.
    """
    drawing, panel = _new()
    places = _places([each["at"] for rows in bands.values() for each in rows])
    for law, rows in bands.items():
        if law not in middles:
            continue
        line = _line(looks[law])
        xs = [places.get(each["at"], each["at"]) for each in rows]
        size = middles[law] if len(bands) > 1 else 1.0
        low, median, high = ([_drawable(each[key] / size) for each in rows] for key in ("low", "median", "high"))
        if len(bands) == 1:
            panel.fill_between(xs, low, high, color=line["color"], alpha=0.18, linewidth=0.0)
        else:
            panel.plot(xs, high, **{**line, "linewidth": 0.7})
        marker = "o" if len(rows) <= 12 else ""
        panel.plot(xs, median, marker=marker, markersize=3.5, **line)
    panel.xaxis.set_major_locator(MaxNLocator(5))
    panel.xaxis.set_major_formatter("{x:.4g}")
    if not panel.lines:
        return _finished(drawing, caption)
    if places:
        panel.set_xticks(list(places.values()), [literal(_shortened(str(value))) for value in places])
    panel.set(yscale="log", xlabel=literal(name))
    error = METRICS[FIGURES["error"]]
    panel.set_ylabel(error.label_and_unit if len(bands) == 1 else f"{error.label} [× median of the law]")
    _few_ticks(panel.yaxis, panel.get_ylim())
    return _finished(drawing, caption)


def bars(rows: Sequence[Mapping[str, Any]], colour: str, caption: str) -> Picture:
    """Draw the first-order indices of a law as bars with intervals, and the rank correlations as numbers."""
    shown = list(rows)[:MOST_BARS]
    drawing, panel = _new(0.85 + 0.27 * len(shown))
    for place, row in enumerate(shown):
        sobol = row["sobol"]
        if sobol["value"] is not None:
            panel.barh(place, sobol["value"], height=0.62, color=colour, alpha=0.85)
            if sobol["low"] is not None:
                panel.plot((sobol["low"], sobol["high"]), (place, place), color=INK, linewidth=1.2)
        text = "" if row["spearman"] is None else f"{round(row['spearman']['value'], 2) + 0.0:+.2f}".replace("-", "−")
        panel.text(1.19, place, text, va="center", ha="right", fontsize=8.5, color=INK)
    panel.text(1.19, -0.75, "ρ", va="center", ha="right", fontsize=8.5, color=INK)
    panel.set_yticks(range(len(shown)), [literal(row["parameter"]) for row in shown])
    panel.set(xlim=(0.0, 1.2), ylim=(len(shown) - 0.4, -1.1), xlabel="share of the variance of log error")
    panel.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "100 %"])
    panel.spines["bottom"].set_bounds(0.0, 1.0)
    panel.grid(axis="y", visible=False)
    panel.set_axisbelow(True)
    panel.tick_params(axis="y", length=0)
    return _finished(drawing, caption)


def _line(look: LawLook) -> dict[str, Any]:
    """Return the arguments of Matplotlib for a line of a law; pages have room for wider ones than papers."""
    return {**look.line, "linewidth": 1.3 * look.weight}


def _plain_decades(panel: Axes) -> None:
    """Label a logarithmic axis at 1, 2 and 5 if it spans few decades: the labels of matplotlib would overlap."""
    low, high = panel.get_xlim()
    if high < 100.0 * low:
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:.3g}")
    panel.xaxis.set_minor_formatter(NullFormatter())


def _few_ticks(axis: Axis, ends: tuple[float, float]) -> None:
    """Plain numbers on a logarithmic axis that is too short for powers of ten."""
    if ends[1] < 30.0 * ends[0]:
        axis.set_major_locator(
            LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)) if ends[1] > 3.0 * ends[0] else MaxNLocator(5)
        )
        axis.set_major_formatter("{x:.4g}")
    axis.set_minor_formatter(NullFormatter())


def _new(height: float = HEIGHT) -> tuple[Figure, Axes]:
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(WIDTH, height), layout="constrained")
        return drawing, drawing.subplots()


def _finished(drawing: Figure, caption: str) -> Picture:
    return Picture(inline(picture_bytes(drawing, "svg", STYLE, transparent=True).decode(), caption), caption)


def inline(text: str, label: str) -> str:
    """Turn an SVG file into an element of a page: no declarations or unused ids, the colours and font of the page."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    used = set(re.findall(r"#([\w-]+)\"|url\(#([\w-]+)\)", text))
    kept = {first or second for first, second in used}
    text = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in kept else "", text)
    text = text.replace("xlink:href", "href").replace(INK, "currentColor").replace(LINE, "var(--line)")
    text = re.sub(r' xmlns(:\w+)?="[^"]*"| version="[^"]*"', "", text, count=3)
    text = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font-size: \1", text)
    text = re.sub(r"; font-family: [^;\"]*", "", text)
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s+", " ", text).replace("> <", "><")
    text = re.sub(r"<[^>]+>", lambda tag: re.sub(r"(\d\.\d\d)\d+", r"\1", tag[0]), text)  # a hundredth of a point
    quoted = label.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return text.replace("<svg", f'<svg role="img" aria-label="{quoted}"', 1).strip()


def _columns(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in points], [y for _, y in points]


def _drawable(value: float) -> float:
    return nan if isinf(value) or value <= 0.0 else value


def _places(values: Sequence[Any]) -> dict[Any, float]:
    """Return the positions of values that are no numbers, in sorted order; empty for numbers."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return {}
    return {value: float(place) for place, value in enumerate(dict.fromkeys(sorted(values, key=str)))}


def _shortened(text: str) -> str:
    return text if len(text) <= 14 else text[:13] + "…"
