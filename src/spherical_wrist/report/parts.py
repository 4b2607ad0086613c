"""Pieces of HTML: everything that comes from outside is escaped, and figures carry their full value."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from spherical_wrist.report.pictures import Picture, look

NEVER = "did not complete"


def number(value: float | None, none: str = NEVER, unit: str = "") -> str:
    """A figure with three digits; the element has its full value.

    Args:
        value: the figure.
        none: what to say where there is none.
        unit: behind it.
    """
    if value is None:
        return f'<span class="none">{escape(none)}</span>'
    return f'<data value="{value!r}">{written(value)}{escape(unit)}</data>'


def written(value: float, *, short: bool = False) -> str:
    """Three digits, as a person writes them: 0.0120, 1.23·10⁻⁴; where it shall be short, without zeros at the end."""
    if short and (value == 0.0 or 1e-3 <= abs(value) < 1e4):
        return f"{value:.4g}".replace("-", "−")
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        shown = "0" if value == 0.0 else f"{value:#.3g}".rstrip(".") if abs(value) < 1e3 else f"{value:.0f}"
        return shown.replace("-", "−")
    mantissa, _, exponent = f"{value:.2e}".partition("e")
    return f"{mantissa}·10<sup>{int(exponent)}</sup>".replace("-", "−")


def percent(value: float | None) -> str:
    """A share in percent, with three digits."""
    if value is None:
        return number(None, "—")
    digits = 3 if value < 0.9995 else 5
    shown = f"{100.0 * value:.0f}" if value in (0.0, 1.0) else f"{100.0 * value:#.{digits}g}".rstrip(".")
    return f'<data value="{value!r}">{shown} %</data>'


def interval(low: float | None, high: float | None, write: Any = number) -> str:
    """The ends of an interval, small; an open end is told as such, and nothing where both are open."""
    if low is None and high is None:
        return ""
    if high is None:
        return f"<small>from {write(low)}</small>"
    if low is None:
        return f"<small>to {write(high)}</small>"
    return f"<small>{write(low)} to {write(high)}</small>"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], *, kind: str = "cards") -> str:
    """A table whose first column heads its rows; of the kind ``cards``, a narrow page shows each row as a card.

    Args:
        headings: of the columns, as HTML.
        rows: the cells, as HTML.
        kind: its class.
    """
    head = "".join(f'<th scope="col">{each}</th>' for each in headings)
    plain = [_plain(each) for each in headings]
    lines = []
    for first, *rest in rows:
        cells = "".join(
            f'<td data-label="{escape(label, quote=True)}">{cell}</td>'
            for label, cell in zip(plain[1:], rest, strict=True)
        )
        lines.append(f'<tr><th scope="row">{first}</th>{cells}</tr>')
    body = "".join(lines)
    return f'<div class="wide"><table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def definitions(pairs: Mapping[str, str]) -> str:
    """A list of terms and what they are; the latter as HTML."""
    return "<dl>" + "".join(f"<div><dt>{escape(k)}</dt><dd>{v}</dd></div>" for k, v in pairs.items()) + "</dl>"


def breakable(text: str) -> str:
    """Escaped text that may break behind underscores and dots."""
    return escape(text).replace("_", "_<wbr>").replace(".", ".<wbr>")


def folded(title: str, content: str) -> str:
    """Content that a reader opens; printed, it is open."""
    return f"<details><summary>{title}</summary>{content}</details>"


def with_unit(name: str, units: Mapping[str, str]) -> str:
    """A parameter with its unit in brackets, where it has one."""
    return f"{name} [{units[name]}]" if units.get(name) else name


def setting(value: Any) -> str:
    """The value of a parameter."""
    return written(value, short=True) if isinstance(value, float) else escape(str(value))


def mark(position: int) -> str:
    """A short line in the look of a law."""
    colour, dash = look(position)
    dashes = {"-": "", "--": "7 4", ":": "2 3", "-.": "7 3 2 3"}[dash]
    line = f'<line x1="0" y1="6" x2="28" y2="6" stroke="{colour}" stroke-width="4" stroke-dasharray="{dashes}"/>'
    return f'<svg class="mark" viewBox="0 0 28 12" aria-hidden="true">{line}</svg>'


def gallery(pictures: Sequence[Picture], titles: Sequence[str] = ()) -> str:
    """Pictures with their captions; where there are titles, as HTML, these stand above in place of the captions."""
    parts = []
    for position, each in enumerate(pictures):
        above = f"<h4>{titles[position]}</h4>" if titles else ""
        below = "" if titles else f"<figcaption>{breakable(each.caption)}</figcaption>"
        parts.append(f"<figure>{above}{each.svg}{below}</figure>")
    return f'<div class="pictures">{"".join(parts)}</div>'


def _plain(html: str) -> str:
    """Text without elements."""
    out, inside = [], False
    for letter in html:
        inside = letter == "<" or (inside and letter != ">")
        if not inside and letter != ">":
            out.append(letter)
    return "".join(out)
