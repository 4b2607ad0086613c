"""Figures and texts as HTML. Markup escapes all that is put into it; an element of a figure carries its full value."""

from collections.abc import Callable, Mapping
from typing import Any

from markupsafe import Markup, escape

from spherical_wrist.picture_style import LawLook
from spherical_wrist.report.pictures import INK

NOT_COMPLETED = "did not complete"


def number(value: float | None, none: str = NOT_COMPLETED, unit: str = "") -> Markup:
    """Format a figure with three digits.

    Args:
        value: the figure.
        none: text for None.
        unit: text behind the figure.
    """
    if value is None:
        return Markup('<span class="none">{}</span>').format(none)
    return Markup('<data value="{!r}">{}{}</data>').format(value, written(value), unit)


def ratio(value: float | None) -> Markup:
    """Format the ratio of two errors; None is infinite."""
    return number(value, "∞")


def written(value: float, *, short: bool = False) -> Markup:
    """Format a number with three digits: 0.0120, 1.23·10⁻⁴; a short one with up to four, without trailing zeros."""
    if short and (value == 0.0 or 1e-3 <= abs(value) < 1e4):
        return _with_minus(f"{value:.4g}")
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return _with_minus("0" if value == 0.0 else f"{value:#.3g}".rstrip(".") if abs(value) < 1e3 else f"{value:.0f}")
    mantissa, _, exponent = f"{value:.2e}".partition("e")
    return Markup("{}·10<sup>{}</sup>").format(_with_minus(mantissa), _with_minus(f"{int(exponent)}"))


def percent(value: float | None) -> Markup:
    """Format a share in percent with three digits."""
    if value is None:
        return number(None, "—")
    digits = 3 if value < 0.9995 else 5
    shown = f"{100.0 * value:.0f}" if value in (0.0, 1.0) else f"{100.0 * value:#.{digits}g}".rstrip(".")
    return Markup('<data value="{!r}">{} %</data>').format(value, shown)


def interval(low: float | None, high: float | None, write: Callable[[float | None], Markup] = number) -> Markup:
    """Format the ends of an interval in small type; empty if both ends are open."""
    if low is None and high is None:
        return Markup("")
    if high is None:
        return Markup("<small>from {}</small>").format(write(low))
    if low is None:
        return Markup("<small>to {}</small>").format(write(high))
    return Markup("<small>{} to {}</small>").format(write(low), write(high))


def breakable(text: str) -> Markup:
    """Allow line breaks behind underscores, dots and colons."""
    return Markup("").join(escape(sign) + Markup("<wbr>") if sign in "_.:" else escape(sign) for sign in text)


def law(name: str) -> Markup:
    """Write the name of a law, which is broken only where there is no room for it."""
    return Markup('<span class="law">{}</span>').format(breakable(name))


def setting(value: Any) -> Markup:
    """Format the value of a parameter."""
    return written(value, short=True) if isinstance(value, float) else escape(str(value))


def drawn(given: Any) -> Markup:
    """Format a distribution of a campaign file: ``uniform [0.5, 1.5]``."""
    if isinstance(given, Mapping):
        parts = (Markup("{} {}").format(kind.replace("_", " "), drawn(values)) for kind, values in given.items())
        return Markup(", ").join(parts)
    if isinstance(given, list | tuple):
        return Markup("[{}]").format(Markup(", ").join(map(drawn, given)))
    return setting(given)


def with_unit(name: str, units: Mapping[str, str]) -> str:
    """Append the unit of a parameter in brackets, if it has one."""
    return f"{name} [{units[name]}]" if units.get(name) else name


def grouped(count: int) -> str:
    """Format a count with commas between thousands."""
    return f"{count:,}"


def mark(look: LawLook) -> Markup:
    """Draw a short line in the style of a law."""
    dashes = "" if look.dash == "-" else " ".join(f"{2.0 * length:g}" for length in look.dash[1])
    colour = look.colour.replace(INK, "currentColor")
    return Markup(
        '<svg class="mark" viewBox="0 0 28 12" aria-hidden="true">'
        '<line x1="0" y1="6" x2="28" y2="6" stroke="{}" stroke-width="4" stroke-dasharray="{}"/></svg>'
    ).format(colour, dashes)


def _with_minus(text: str) -> Markup:
    """Replace hyphens by minus signs."""
    return escape(text.replace("-", "−"))
