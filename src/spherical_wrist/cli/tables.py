"""Tables that fit the terminal: figures are never cut, names are where there is no room."""

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

Entry = Text | str


def fitted(title: str, headings: Sequence[str], rows: Sequence[Sequence[Entry]], width: int, names: int = 0) -> Table:
    """A table without lines, its figures to the right.

    Args:
        title: above the table; empty for none.
        headings: of the columns, in one line or more.
        rows: the entries.
        width: of the terminal.
        names: the column of names, which goes to the left and is cut where there is no room.
    """
    widths = [
        max(cell_width(entry) for entry in [*heading.split("\n"), *(row[column] for row in rows)])
        for column, heading in enumerate(headings)
    ]
    gap = 2 if sum(widths) + 2 * len(widths) <= width else 1
    rest = sum(widths) - widths[names] + gap * len(widths)
    table = Table(
        title=Text(title) if title else None,
        title_justify="left",
        title_style="bold",
        box=None,
        padding=(0, gap, 0, 0),
        header_style="dim",
    )
    for column, heading in enumerate(headings):
        if column == names:
            table.add_column(Text(heading), no_wrap=True, overflow="ellipsis", max_width=max(width - rest, 10))
        else:
            table.add_column(Text(heading), justify="right", no_wrap=True, min_width=widths[column])
    for row in rows:
        table.add_row(*(Text(entry) if isinstance(entry, str) else entry for entry in row))
    return table


def cell_width(entry: Entry) -> int:
    """Columns of the terminal that an entry takes."""
    return (Text(entry) if isinstance(entry, str) else entry).cell_len


def short(value: float | None) -> str:
    """Three digits; a dash for none."""
    if value is None:
        return "—"
    if abs(value) >= 1e5 or 0.0 < abs(value) < 1e-3:
        return f"{value:.2e}"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
