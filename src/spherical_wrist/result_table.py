"""Tables of results: one description, written as LaTeX (booktabs), Markdown or CSV, or shown on the terminal."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.picture_file import check_ending
from spherical_wrist.plain_text import latex, markdown, visible

TABLES = (".tex", ".md", ".csv")
"""Endings of the names of tables, which say their format."""
Cell = str | float | None


class Column(NamedTuple):
    """Column of a table.

    Attributes:
        heading: heading.
        unit: unit of its figures; empty for none.
        text: True for text, which is aligned to the left.
    """

    heading: str
    unit: str = ""
    text: bool = False

    @property
    def label(self) -> str:
        """Heading with the unit in brackets."""
        return f"{self.heading} [{self.unit}]" if self.unit else self.heading


class ResultTable(NamedTuple):
    """Table of results.

    Attributes:
        title: title in one line.
        columns: columns.
        rows: cells of each row: text, a number, or None where there is nothing.
        best: places (row, column) of the cells to emphasise.
        notes: sentences below the table.
        own: rows of one's own laws.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    best: frozenset[tuple[int, int]] = frozenset()
    notes: Sequence[str] = ()
    own: frozenset[int] = frozenset()


def smallest(rows: Sequence[Sequence[Cell]], columns: Iterable[int]) -> frozenset[tuple[int, int]]:
    """Return the places (row, column) of the smallest numbers of some columns."""
    found = set()
    for column in columns:
        values = {place: value for place, row in enumerate(rows) if isinstance(value := row[column], float)}
        found |= {(place, column) for place, value in values.items() if value == min(values.values())}
    return frozenset(found)


def beside(left: ResultTable, right: ResultTable | None) -> ResultTable:
    """Return a table with the columns of another one, of the same rows, beside its own; names are not repeated."""
    if right is None:
        return left
    shift = len(left.columns) - 1
    return left._replace(
        columns=[*left.columns, *right.columns[1:]],
        rows=[[*row, *others[1:]] for row, others in zip(left.rows, right.rows, strict=True)],
        best=left.best | {(row, column + shift) for row, column in right.best if column},
        notes=[*left.notes, *right.notes],
    )


def short(value: float | None) -> str:
    """Write a figure with three digits; a dash for None."""
    if value is None:
        return "—"
    if abs(value) >= 1e5 or 0.0 < abs(value) < 1e-3:
        return f"{value:.2e}"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def cell_text(cell: Cell) -> str:
    """Write a cell: text as it is, a number with three digits, a dash for None."""
    return cell if isinstance(cell, str) else short(cell)


def table_content(table: ResultTable, path: Path) -> bytes:
    """Return a table as the content of a file, in the format that its name says.

    Raises:
        ParameterError: the name has another ending.
    """
    check_ending(path, "table", TABLES)
    write = {".tex": as_latex, ".md": as_markdown, ".csv": as_csv}[path.suffix.lower()]
    return write(table).encode()


def as_latex(table: ResultTable) -> str:
    r"""Return the environment ``tabular`` for ``\input`` into a table; its title and notes are comments.

    It needs the package booktabs. The best figure of a column and the names of one's own laws are bold.
    """
    lines = [f"% {_one_line(text)}" for text in (table.title, *table.notes)]
    lines += [r"% In the preamble: \usepackage{booktabs}"]
    lines += [rf"\begin{{tabular}}{{{''.join('l' if column.text else 'r' for column in table.columns)}}}", r"\toprule"]
    lines.append(_latex_row([latex(column.heading) for column in table.columns]))
    if any(column.unit for column in table.columns):
        lines.append(_latex_row([f"[{latex(column.unit)}]" if column.unit else "" for column in table.columns]))
    lines.append(r"\midrule")
    for place, row in enumerate(table.rows):
        cells = [_latex_cell(cell) for cell in row]
        lines.append(_latex_row([rf"\textbf{{{text}}}" if _bold(table, place, n) else text for n, text in
                                 enumerate(cells)]))  # fmt: skip
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def as_markdown(table: ResultTable) -> str:
    """Return a Markdown table with its title and notes."""
    lines = [f"**{markdown(table.title)}**", ""]
    lines.append(_markdown_row([markdown(column.label) for column in table.columns]))
    lines.append(_markdown_row(["---" if column.text else "---:" for column in table.columns]))
    for place, row in enumerate(table.rows):
        cells = [markdown(cell_text(cell)) for cell in row]
        bold = [f"**{text}**" if text and _bold(table, place, n) else text for n, text in enumerate(cells)]
        lines.append(_markdown_row(bold))
    for note in table.notes:
        lines += ["", markdown(note)]
    return "\n".join([*lines, ""])


def as_csv(table: ResultTable) -> str:
    """Return a CSV table, with every digit of its numbers."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column.label for column in table.columns])
    writer.writerows([["" if cell is None else cell for cell in row] for row in table.rows])
    return text.getvalue()


def _bold(table: ResultTable, row: int, column: int) -> bool:
    return (row, column) in table.best or (row in table.own and column == 0)


def _latex_cell(cell: Cell) -> str:
    text = cell_text(cell)
    found = re.fullmatch(r"([^\d]*)(\d+(?:\.\d+)?)e([+-]\d+)", text)
    if found is None:
        return latex(re.sub(r"^-(?=\d)", "−", text))
    return rf"{latex(found[1])}${found[2]}\times10^{{{int(found[3])}}}$"


def _latex_row(cells: Sequence[str]) -> str:
    return rf"{' & '.join(cells)} \\"


def _markdown_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _one_line(text: str) -> str:
    return visible(" ".join(text.split()))
