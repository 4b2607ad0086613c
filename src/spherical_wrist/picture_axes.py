"""Axes and text of pictures: logarithmic axes with plain numbers, and text that is measured and wrapped."""

from functools import cache
from math import floor, log10
from typing import Any

from spherical_wrist.picture_style import SMALL, STYLE
from spherical_wrist.plain_text import broken, literal

FINER = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Digits of the numbers at an axis of less than a decade."""
APART = 0.07
"""Smallest space between the numbers at an axis [in]."""


def logarithmic(axis: Any, low: float, high: float, length: float) -> None:
    """Make an axis logarithmic, with as many plain numbers at it as fit.

    Args:
        axis: ``panel.xaxis`` or ``panel.yaxis``.
        low: lower end, greater than 0.
        high: upper end.
        length: length of the axis [in].
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

    panel = axis.axes
    scale, limits = (panel.set_xscale, panel.set_xlim) if axis is panel.xaxis else (panel.set_yscale, panel.set_ylim)
    scale("log")
    limits(low, high)
    upright = axis is not panel.xaxis
    axis.set_major_locator(FixedLocator(log_ticks(low, high, length, upright=upright)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    axis.set_minor_locator(LogLocator(subs=range(2, 10) if high < 1e4 * low else (1.0,), numticks=99))
    axis.set_minor_formatter(NullFormatter())


def log_ticks(low: float, high: float, length: float, *, upright: bool = False) -> list[float]:
    """Return round numbers between the ends of a logarithmic axis: as many as have room.

    Args:
        low: lower end, greater than 0.
        high: upper end.
        length: length of the axis [in].
        upright: True for a vertical axis, where numbers need their height only.
    """
    first, last = floor(log10(low)) - 1, floor(log10(high)) + 1
    steps: list[tuple[tuple[float, ...], int]] = [
        ((1.0, 2.0, 5.0), 1), ((1.0, 3.0), 1),
        *(((1.0,), step) for step in range(1, last - first + 1)), (FINER, 1),
    ]  # fmt: skip

    def fits(ticks: list[float]) -> bool:
        sizes = [SMALL / 72.0 if upright else _number_width(value) for value in ticks]
        places = [length * log10(value / low) / log10(high / low) for value in ticks]
        return all(
            b - a >= 0.5 * (size_a + size_b) + APART
            for a, b, size_a, size_b in zip(places, places[1:], sizes, sizes[1:], strict=False)
        )

    choices = [
        [
            value
            for exponent in range(first, last + 1)
            if exponent % step == 0
            for digit in digits
            if low * (1.0 - 1e-9) <= (value := float(f"{digit}e{exponent}")) <= high * (1.0 + 1e-9)
        ]
        for digits, step in steps
    ]
    fitting = [ticks for ticks in choices if fits(ticks)]
    return next((ticks for ticks in fitting if len(ticks) > 2), max(fitting, key=len, default=[]))


def _number_width(value: float) -> float:
    text = plain_number(value)
    raised = len(text) > 1 and text[0] == "$"
    return text_width("10⁻⁵", SMALL) if raised else text_width(text, SMALL)


def plain_number(value: float) -> str:
    """Write a number at an axis: plain where it is short, else as a power of ten."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:g}".replace("-", "−")
    digits, _, exponent = f"{value:.0e}".partition("e")
    factor = "" if digits == "1" else rf"{digits}\cdot"
    return rf"$\mathdefault{{{factor}10^{{{int(exponent)}}}}}$"


@cache
def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a line of text in the font of pictures [in].

    Args:
        text: the line, shown as it is.
        size: size of the font [pt].
        bold: True for bold type.
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family=STYLE["font.family"], size=size, weight="bold" if bold else "normal")
    width, _, _ = text_to_path.get_text_width_height_descent(literal(text).replace(r"\$", "$"), font, False)
    return float(width) / 72.0


def wrapped(text: str, size: float, room: float, *, bold: bool = False) -> list[str]:
    """Break a text into lines that are not wider than a room; see :func:`.broken`. Breaks of its own are blanks.

    Args:
        text: the text.
        size: size of the font [pt].
        room: width of the lines [in].
        bold: True for bold type.
    """
    return broken(" ".join(text.split()), lambda line: text_width(line, size, bold=bold) <= room)
