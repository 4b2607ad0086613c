"""Output on the terminal: tables that fit its width, figures, and JSON."""

import json
from collections.abc import Iterable, Sequence
from typing import Any, Literal

from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.streams import speaks_unicode
from spherical_wrist.cli.verbosity import is_quiet
from spherical_wrist.plain_text import broken, escaped, visible
from spherical_wrist.result_table import ResultTable, cell_text, short

__all__ = ["short"]

Entry = Text | str

HEADING = 11
"""Width up to which the words of a heading share a line [columns]."""
NARROWEST = 60
"""Smallest width of tables [columns]; the lines of a narrower terminal wrap."""


class Terminal(Console):
    """Console that shows text as it is: no markup, no codes of emoji, and signs in place of control characters."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as Rich does, which would drop some control characters from plain text."""
        super().print(*(visible(each) if isinstance(each, str) else each for each in objects), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render text for printing, with control characters made visible; the styles are added later."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


def print_json(value: Any) -> None:
    """Print one JSON object on the standard output."""
    print(escaped(json.dumps(value, indent=2, ensure_ascii=not speaks_unicode(), allow_nan=False)))


def json_bytes(value: Any) -> bytes:
    """Return the content of a JSON file."""
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def printer() -> Console:
    """Return a console as wide as the terminal, but not so narrow that figures would be cut."""
    console = Terminal(quiet=is_quiet())
    console.width = max(console.width, NARROWEST)
    return console


def number(value: float | None, digits: int = 4) -> str:
    """Write a figure with so many significant digits; a dash for None."""
    if value is None:
        return "—"
    return f"{value:.{digits}g}" if value == 0.0 or 1e-3 <= abs(value) < 1e5 else f"{value:.{digits - 1}e}"


def written_to(folder: object, names: str) -> Text:
    """Return a line with the folder and the names of files that were written."""
    return Text.assemble("written to ", (str(folder), "bold"), f": {names}")


def fitted(
    title: str,
    headings: Sequence[str],
    rows: Sequence[Sequence[Entry]],
    width: int,
    names: int = 0,
    words: Sequence[int] = (),
) -> Group:
    """Lay out a table without lines whose figures are never cut, below its title, which may be wider.

    Args:
        title: title above the table; empty for none.
        headings: headings of the columns, in one line or more.
        rows: entries of each row.
        width: width of the terminal [columns].
        names: index of the column of names, which is left-aligned; names that are too long for it have several lines.
        words: indices of other columns that are left-aligned; they are never cut.
    """
    widths = [
        max(cell_width(entry) for entry in [*heading.split("\n"), *(row[column] for row in rows)])
        for column, heading in enumerate(headings)
    ]
    gap = 2 if sum(widths) + 2 * len(widths) <= width else 1
    rest = sum(widths) - widths[names] + gap * len(widths)
    table = Table(box=None, padding=(0, gap, 0, 0), header_style="dim")
    for column, heading in enumerate(headings):
        if column == names:
            table.add_column(Text(heading), no_wrap=True)
        else:
            side: Literal["left", "right"] = "left" if column in words else "right"
            table.add_column(Text(heading), justify=side, no_wrap=True, min_width=widths[column])
    room = max(width - rest, 10)
    for row in rows:
        cells = [Text(entry) if isinstance(entry, str) else entry for entry in row]
        cells[names] = _folded(cells[names], room)
        table.add_row(*cells)
    return Group(*([Text(title, "bold")] if title else []), table)


def _folded(name: Text, room: int) -> Text:
    """Break a name into lines of a width [columns]; nothing of it is left out, so that it can be typed."""
    lines = broken(name.plain, lambda line: Text(line).cell_len <= room)
    return name if len(lines) == 1 else Text("\n".join(lines), name.style)


def heading_lines(heading: str) -> str:
    """Break the heading of a column into short lines; its unit stays in one."""
    name, _, unit = heading.partition(" [")
    lines = broken(name, lambda line: len(line) <= HEADING)
    if unit and len(lines[-1]) + len(unit) + 2 <= HEADING:
        lines[-1] += f" [{unit}"
    elif unit:
        lines.append(f"[{unit}")
    return "\n".join(lines)


def cell_width(entry: Entry) -> int:
    """Return the width of an entry on the terminal [columns]."""
    return (Text(entry) if isinstance(entry, str) else entry).cell_len


def shown(table: ResultTable, width: int) -> Group:
    """Lay out a table of results for the terminal; see :func:`fitted`."""
    headings = [heading_lines(column.label) for column in table.columns]
    rows: list[list[Entry]] = [
        [
            Text(cell_text(cell), "bold green" if (place, column) in table.best else "")
            for column, cell in enumerate(row)
        ]
        for place, row in enumerate(table.rows)
    ]
    return fitted(table.title, headings, rows, width)
