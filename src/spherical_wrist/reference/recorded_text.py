"""Tables of numbers in text, as programs and people write them.

Separated by commas, semicolons, tabs or spaces; with decimal points or commas, lines of comment (``#`` or ``%``), a
line of names or none, in UTF-8 or UTF-16, with any end of line.
"""

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from spherical_wrist.errors import one_line
from spherical_wrist.reference.recorded_rows import LAST_ROW, RowError, too_long

HEAD = 1 << 16
"""Characters from which the dialect is recognised."""
BLOCK = 1 << 22
"""Characters that are read at a time."""
LONGEST = 1 << 20
"""Most characters of a line."""
LARGEST = 1 << 28
"""Most bytes of the columns that are read: four times what the most rows of plain numbers take."""
COMMENT = re.compile(r"(?m)^[ \t]*(?:[#%].*|sep=.)?(?:\n|\Z)")
"""A line that is no row: empty, a comment, or a spreadsheet's own statement of its separator."""
SPACES = re.compile(r"[ \t]+")
EDGES = re.compile(r"(?m)^ | $")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
NO_TABLE = "it is neither a table in text, nor Parquet, nor a kinematics file of JIGSAWS"


class Dialect(NamedTuple):
    """Form of a table in text.

    Attributes:
        encoding: of the characters.
        delimiter: between columns; a space stands for any number of spaces and tabs.
        decimal: decimal point or comma.
        header: whether the first line that is no comment has names.
        names: of the columns, from that line or from the comment before the rows; empty ones where there are none.
        spaced: whether columns are separated by spaces.
    """

    encoding: str
    delimiter: str
    decimal: str
    header: bool
    names: tuple[str, ...]
    spaced: bool

    @property
    def named(self) -> bool:
        """True if the columns have names."""
        return any(self.names)

    @property
    def said(self) -> str:
        """In words."""
        by = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces"}[self.delimiter]
        return f"separated by {by}" + (", decimal commas" if self.decimal == "," else "")


def dialect_of(path: Path) -> Dialect:
    """Recognise the form of a table.

    Raises:
        RowError: the file is empty, or no text.
    """
    with path.open("rb") as file:
        start = file.read(HEAD)
    encoding = "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    elif b"\0" in start:
        raise RowError(NO_TABLE)
    with _opened(path, encoding) as file:
        text = file.read(HEAD)
    if not text:
        raise RowError("it is empty")
    lines = [line.strip() for line in text.split("\n")]
    if len(text) == HEAD and len(lines) > 1:
        lines.pop()  # not read to its end
    rows = [line for line in lines if not COMMENT.fullmatch(line)]
    comments = [line for line in lines if line.startswith(("#", "%"))]
    if not rows:
        raise RowError("it has no rows")
    delimiter = _delimiter(rows[min(1, len(rows) - 1)])
    split = [_fields(line, delimiter) for line in rows[:1000]]
    decimal = "," if any(DECIMAL_COMMA.fullmatch(field) for line in split[1:] for field in line) else "."
    header = not all(_is_number(field, decimal) for field in split[0])
    if "\ufffd" in rows[0] and len(rows) < 3:
        raise RowError(NO_TABLE)
    width = len(split[min(1, len(split) - 1)])
    names = split[0] if header else _commented(comments, delimiter, width)
    if len(names) < width or not any(names[width:]):
        names = [*names[:width], *[""] * (width - len(names))]
    if len(names) > width:
        raise RowError(f"its header has {len(names)} names, and a row {width} numbers")
    return Dialect(encoding, delimiter, decimal, header, tuple(names), delimiter == " ")


def read_table(path: Path, dialect: Dialect, texts: Sequence[int], numbers: Sequence[int]) -> tuple[list[Any], Any]:
    """Read columns of a table, up to the largest number of rows.

    Args:
        path: file.
        dialect: its form.
        texts: columns to return as text.
        numbers: columns to return as numbers, not-a-number where a cell is empty.

    Returns:
        The columns of text as arrays of pyarrow, and the numbers (n, columns).

    Raises:
        RowError: rows have too few or too many columns, or no numbers in them, or there are too many rows.
    """
    import numpy as np
    import pyarrow
    from pyarrow import csv as arrow

    width = len(dialect.names)
    types = {str(column): pyarrow.float64() for column in numbers} | {str(column): pyarrow.string() for column in texts}
    read = arrow.ReadOptions(
        column_names=[str(number) for number in range(width)], use_threads=False, block_size=2 * (BLOCK + LONGEST)
    )
    convert = arrow.ConvertOptions(include_columns=list(types), column_types=types, decimal_point=dialect.decimal)
    parse = arrow.ParseOptions(delimiter=dialect.delimiter)
    tables, rows, size = [], 0, 0
    try:
        for block in _blocks(path, dialect):
            table = arrow.read_csv(io.BytesIO(block), read, parse, convert)
            rows, size = rows + table.num_rows, size + table.nbytes
            if rows > LAST_ROW or size > LARGEST:
                raise too_long()
            tables.append(table)
        if not tables:
            raise RowError("it has a header and no rows")
        table = pyarrow.concat_tables(tables)
    except RowError:
        raise
    except (pyarrow.ArrowException, ValueError) as error:

        def named(found: re.Match[str]) -> str:
            number = int(found[1])
            return f"column {dialect.names[number].strip()!r}" if dialect.named else f"column {number + 1}"

        reason = re.sub(r"CSV column #(\d+)", named, one_line(error, limit=160))
        raise RowError(f"it is not a table with numbers in its columns ({reason})") from None
    found = [np.asarray(table.column(str(column)).to_numpy()) for column in numbers]
    return [table.column(str(column)) for column in texts], np.stack(found, axis=1) if found else np.empty((rows, 0))


def _opened(path: Path, encoding: str) -> TextIO:
    return path.open(encoding=encoding, errors="replace")


def _blocks(path: Path, dialect: Dialect) -> Iterator[bytes]:
    """Yield the rows in blocks of whole lines, without names and comments, and with single spaces."""
    first = dialect.header
    with _opened(path, dialect.encoding) as file:
        while text := file.read(BLOCK):
            end = file.readline(LONGEST)
            if len(end) == LONGEST and not end.endswith("\n"):
                raise RowError(f"it has a line of more than {LONGEST} characters")
            text = COMMENT.sub("", text + end)
            if dialect.spaced:
                text = EDGES.sub("", SPACES.sub(" ", text))  # in this order, long runs of spaces take no long time
            if first and text:
                text, first = text.partition("\n")[2], False
            if text:
                yield text.encode()


def _delimiter(row: str) -> str:
    for sign in ";\t":
        if sign in row:
            return sign
    words = row.split()
    spaced = len(words) > 1 and all(_is_number(word, ",") for word in words)
    return "," if "," in row and not spaced else " "


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        line = SPACES.sub(" ", line)
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
    except csv.Error as error:
        raise RowError(f"{NO_TABLE} ({one_line(error)})") from None


def _is_number(field: str, decimal: str) -> bool:
    try:
        float(field.replace(",", ".") if decimal == "," else field)
    except ValueError:
        return not field
    return True


def _commented(comments: Sequence[str], delimiter: str, width: int) -> list[str]:
    """Return the names in the last line of comment that has as many as there are columns."""
    for line in reversed(comments):
        for sign in (delimiter, ",", " "):
            names = _fields(line.lstrip("#% "), sign)
            if len(names) == width > 1:
                return names
    return [""] * width
