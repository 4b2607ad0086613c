"""Recorded motions from files: CSV, Parquet, or the kinematics text of JIGSAWS, distinguished by their contents."""

import csv
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.reference.jigsaws import Arm, is_jigsaws, read_jigsaws
from spherical_wrist.reference.recorded_rows import LAST_ROW, Array, RowError, Track, columns_of, too_long, track_of

HEAD = 1 << 16
"""Bytes in which the first line must end."""


class Recording(NamedTuple):
    """Contents of a file.

    Attributes:
        track: the motion.
        jigsaws: whether it is a kinematics file of JIGSAWS.
    """

    track: Track
    jigsaws: bool


def read_recorded(path: Path, arm: Arm, largest_gap: float) -> Recording:
    """Read a recorded motion.

    Args:
        path: CSV with a header, separated by commas, semicolons or tabs; Parquet; or JIGSAWS kinematics. A CSV or
            Parquet file has a column of times (``time``, ``t`` or ``timestamp``, in seconds; in Parquet also of the
            type of a time) and the columns of a quaternion (``qw``, ``qx``, ``qy``, ``qz`` or ``w``, ``x``, ``y``,
            ``z``) or a rotation matrix (``r11``, ``r12`` … ``r33``), body → world; further columns do not matter.
        arm: of a JIGSAWS file, the arm.
        largest_gap: longest time between rows [s] that is accepted.

    Raises:
        ParameterError: in one line, where the file cannot be read or is not a motion.
    """
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
            file.seek(0)
            first = next((line for line in head.splitlines() if line.strip()), b"")
            if is_jigsaws(first):
                return Recording(track_of(*read_jigsaws(file, arm), largest_gap), jigsaws=True)
        time, values = _parquet(path) if head.startswith(b"PAR1") else _csv(path, head)
        return Recording(track_of(time, values, largest_gap), jigsaws=False)
    except FileNotFoundError:
        raise ParameterError(f"reference file {str(path)!r}: no such file") from None
    except RowError as error:
        raise ParameterError(f"reference file {str(path)!r}: {one_line(error)}") from None
    except OSError as error:
        raise ParameterError(
            f"reference file {str(path)!r} cannot be read: {error.strerror or one_line(error)}"
        ) from None


def _csv(path: Path, head: bytes) -> tuple[Array, Array]:
    """Read times (n,) and attitudes (n, 4) or (n, 9); a header may begin with ``#``, as NumPy writes it."""
    import pyarrow
    from pyarrow import csv as arrow

    lines = head.splitlines()
    if not lines:
        raise RowError("it is empty")
    try:
        header = lines[0].decode("utf-8-sig").strip().removeprefix("#")
    except UnicodeDecodeError:
        raise RowError("it is neither CSV with a header, nor Parquet, nor a kinematics file of JIGSAWS") from None
    delimiter = max(",;\t", key=header.count)
    names = next(csv.reader([header], delimiter=delimiter), [])
    wanted = [str(number) for number in columns_of(names)]
    if len(head) < HEAD and not any(line.strip() for line in lines[1:]):
        raise RowError("it has a header and no rows")
    read = arrow.ReadOptions(column_names=[str(number) for number in range(len(names))], skip_rows=1, use_threads=False)
    convert = arrow.ConvertOptions(include_columns=wanted, column_types=dict.fromkeys(wanted, pyarrow.float64()))
    try:
        reader = arrow.open_csv(
            path, read_options=read, parse_options=arrow.ParseOptions(delimiter=delimiter), convert_options=convert
        )
        table = pyarrow.Table.from_batches(_few(reader), schema=reader.schema)
    except (pyarrow.ArrowException, ValueError, StopIteration) as error:
        reason = re.sub(
            r"CSV column #(\d+)", lambda found: f"column {names[int(found[1])]!r}", one_line(error, limit=160)
        )
        raise RowError(f"it is not CSV with numbers in its columns ({reason})") from None
    return _arrays([table.column(name) for name in wanted])


def _few(batches: Any) -> Iterator[Any]:
    """Yield record batches, up to the largest number of rows."""
    rows = 0
    for batch in batches:
        rows += batch.num_rows
        if rows > LAST_ROW:
            raise too_long()
        yield batch


def _parquet(path: Path) -> tuple[Array, Array]:
    """Read times (n,) and attitudes (n, 4) or (n, 9)."""
    import pyarrow
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path) as file:
            names = file.schema_arrow.names
            wanted = [names[number] for number in columns_of(names)]
            if file.metadata.num_rows > LAST_ROW:
                raise too_long()
            table = file.read(columns=wanted)
            kind = table.schema.types[0]
            time = table.column(0)
            if not (pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind)):
                time = time.cast(pyarrow.float64())
            return _arrays([time, *(column.cast(pyarrow.float64()) for column in table.columns[1:])])
    except (pyarrow.ArrowException, OSError, ValueError, KeyError) as error:
        raise RowError(f"it is damaged, or has no numbers in its columns ({one_line(error, limit=160)})") from None


def _arrays(columns: list[Any]) -> tuple[Array, Array]:
    """Return columns as float64 arrays: dates as seconds since the first, empty cells as not-a-number."""
    time, *values = (np.asarray(column.to_numpy()) for column in columns)
    if time.dtype.kind in "mM":
        time = (time - time[:1]) / np.timedelta64(1, "s") if len(time) else time
    return time.astype(np.float64), np.stack(values, axis=1)
