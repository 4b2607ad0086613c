"""Rows of laws: a picture whose laws stand below each other, names at the left, and panels of figures beside them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spherical_wrist.colours import INK
from spherical_wrist.picture_axes import text_width, wrapped
from spherical_wrist.picture_style import FOR_ONE_COLUMN, SMALL, TEXT, LawLook, law_looks
from spherical_wrist.plain_text import literal

ROW, LINE = 0.155, 0.115
"""Height of a row, and of each further line of its name [in]."""
LOW_ROW, TINY = 0.085, 5.5
"""Height of a row with a number in place of the law's name [in], and size of the numbers and of their key [pt]."""
KEY_LINE = 0.1
"""Height of a line of the key of numbers [in]."""
EDGE, BESIDE = 0.08, 0.06
"""Space at the edges of the picture, and between a name and its row [in]."""
GAP = 0.16
"""Space between panels [in]."""
BELOW, ABOVE = 0.36, 0.1
"""Space of a panel's axis, and above it without its title [in]."""
TITLE_LINE = 0.135
SHARE = 0.42
"""Largest share of the width that names may take."""


class LawRows(NamedTuple):
    """Rows of a picture.

    Attributes:
        looks: look of each law by label.
        names: names as they are drawn, in lines, by label.
        places: centre of each row, downwards from the top of the panels [in].
        height: height of all rows [in].
        width: width of the names [in].
        row: height of a row with a name of one line [in].
        size: size of the names [pt].
    """

    looks: Mapping[str, LawLook]
    names: Mapping[str, Sequence[str]]
    places: Mapping[str, float]
    height: float
    width: float
    row: float
    size: float


def law_rows(statuses: Mapping[str, str], width: float, *, lines: bool = False, numbered: bool = False) -> LawRows:
    """Find rows for laws, in their order.

    Args:
        statuses: status of each law, keyed by label.
        width: width of the picture [in].
        lines: True if their lines have to be told apart.
        numbered: True for low rows with numbers in place of names; :func:`draw_key` draws what they stand for.
    """
    room, row, size = (width, LOW_ROW, TINY) if numbered else (SHARE * width, ROW, SMALL)
    looks = law_looks(statuses, lines=lines)
    shown = {label: str(place) if numbered else label for place, label in enumerate(statuses, start=1)}
    names = {label: wrapped(text, size, room, bold=looks[label].accented) for label, text in shown.items()}
    places, top = {}, 0.0
    for label, name in names.items():
        height = row + LINE * (len(name) - 1)
        places[label], top = top + 0.5 * height, top + height
    widest = max((_width(names[label], looks[label], size) for label in names), default=0.0)
    return LawRows(looks, names, places, top, widest, row, size)


def _width(name: Sequence[str], look: LawLook, size: float) -> float:
    return max(text_width(line, size, bold=look.accented) for line in name)


class Key(NamedTuple):
    """Column of the key of rows with numbers.

    Attributes:
        left: its left end [in].
        entries: numbers and labels of its laws.
    """

    left: float
    entries: Sequence[tuple[str, str]]


def key_columns(rows: LawRows, width: float) -> list[Key]:
    """Return the key of rows with numbers, in as many columns as fit."""
    entries = [(name[0], label) for label, name in rows.names.items()]
    found: list[Key] = []
    for count in range(1, len(entries) + 1):
        each = -(-len(entries) // count)
        columns, left = [], EDGE
        for first in range(0, len(entries), each):
            own = entries[first : first + each]
            columns.append(Key(left, own))
            left += max(text_width(f"{number}  {label}", TINY, bold=True) for number, label in own) + GAP
        if found and left - GAP + EDGE > width:
            break
        found = columns
    return found


def key_height(rows: LawRows, width: float) -> float:
    """Return the height of the key of rows with numbers [in]."""
    return EDGE + KEY_LINE * max(len(column.entries) for column in key_columns(rows, width))


def draw_key(drawing: Figure, rows: LawRows) -> None:
    """Write the labels of numbered laws at the bottom of the picture."""
    width, height = drawing.get_size_inches()
    top = key_height(rows, width)
    for column in key_columns(rows, width):
        for line, (number, label) in enumerate(column.entries):
            look = rows.looks[label]
            drawing.text(
                column.left / width, (top - KEY_LINE * line) / height, literal(f"{number}  {label}"), va="top",
                fontsize=TINY, weight="bold" if look.accented else "normal", color=look.colour if look.named else INK,
            )  # fmt: skip


def row_panels(
    drawing: Figure, rows: LawRows, titles: Sequence[str], top: float, shares: Sequence[float]
) -> list[Axes]:
    """Add panels that share the rows, side by side, and below each other where there are more than columns.

    Args:
        drawing: the picture.
        rows: its rows.
        titles: title of each panel; broken into lines where it is too long.
        top: distance of the first titles from the top of the picture [in].
        shares: relative widths of the columns.
    """
    width, height = drawing.get_size_inches()
    left = EDGE + rows.width + BESIDE
    sizes = panel_widths(rows, width, shares)
    panels = []
    for first in range(0, len(titles), len(shares)):
        lines = _title_lines(titles[first : first + len(shares)], sizes)
        top += ABOVE + TITLE_LINE * max(map(len, lines)) + rows.height
        at = left
        for place, (words, size) in enumerate(zip(lines, sizes, strict=False)):
            panel = drawing.add_axes((at / width, 1.0 - top / height, size / width, rows.height / height))
            at += size + GAP
            panel.set_title("\n".join(map(literal, words)), pad=4.0, fontsize=TEXT)
            _prepare(panel, rows, named=place == 0)
            panels.append(panel)
        top += BELOW
    return panels


def rows_height(rows: LawRows, titles: Sequence[str], width: float, shares: Sequence[float]) -> float:
    """Return the height of all panels of :func:`row_panels`, with titles and axes [in]."""
    sizes = panel_widths(rows, width, shares)
    count = len(shares)
    groups = [_title_lines(titles[first : first + count], sizes) for first in range(0, len(titles), count)]
    return sum(ABOVE + TITLE_LINE * max(map(len, lines)) + rows.height + BELOW for lines in groups)


def panel_widths(rows: LawRows, width: float, shares: Sequence[float]) -> list[float]:
    """Return the widths of panels side by side [in]."""
    room = width - rows.width - BESIDE - 3.0 * EDGE - GAP * (len(shares) - 1)
    return [room * share / sum(shares) for share in shares]


def columns_that_fit(rows: LawRows, width: float, least: float, most: int) -> int:
    """Return the number of equal panels side by side that are at least so wide [in]; 1 or more."""
    return next((count for count in range(most, 1, -1) if panel_widths(rows, width, [1.0] * count)[0] >= least), 1)


def _title_lines(titles: Sequence[str], sizes: Sequence[float]) -> list[list[str]]:
    return [wrapped(title, TEXT, size + 0.5 * GAP) for title, size in zip(titles, sizes, strict=False)]


def _prepare(panel: Axes, rows: LawRows, *, named: bool) -> None:
    panel.set_ylim(rows.height, 0.0)
    names = ["\n".join(map(literal, name)) for name in rows.names.values()]
    panel.set_yticks(list(rows.places.values()), names if named else [""] * len(names), linespacing=1.05)
    panel.tick_params(axis="y", length=0, pad=72.0 * BESIDE)
    panel.grid(axis="y", visible=False)
    panel.spines["left"].set_visible(False)
    for (label, place), text in zip(rows.places.items(), panel.get_yticklabels(), strict=True):
        look = rows.looks[label]
        text.set_fontsize(rows.size)
        if look.named:
            text.set_color(look.colour)
        if look.accented:
            text.set_fontweight("bold")
            half = 0.5 * (rows.row + LINE * (len(rows.names[label]) - 1))
            panel.axhspan(place - half, place + half, color=look.colour, alpha=0.08, linewidth=0.0, zorder=0)


def one_column(width: float) -> bool:
    """Return True if panels have to stand below each other at this width [in]."""
    return width < FOR_ONE_COLUMN
