"""Recorded motions from files, distinguished by their contents.

CSV and other tables in text, Parquet, the trajectories of TUM, EuRoC and KITTI, and the kinematics text of JIGSAWS.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.files import note_input
from spherical_wrist.reference import jigsaws
from spherical_wrist.reference.jigsaws import Arm, is_jigsaws, read_jigsaws
from spherical_wrist.reference.recorded_columns import (
    Columns,
    TimeUnit,
    chosen_columns,
    columns_by_width,
    columns_of,
)
from spherical_wrist.reference.recorded_rows import (
    LAST_ROW,
    UNIT_NAMES,
    RowError,
    Stamps,
    Track,
    attitudes_of,
    refuse,
    too_long,
    track_of,
)
from spherical_wrist.reference.recorded_text import LARGEST, dialect_of, read_table

HEAD = 1 << 16
"""Bytes in which the first line must end."""
LONGEST_TIME = 64
"""Most characters of a time in Parquet."""
EXACT = 10**9
"""Decimal numbers are kept exactly as so many parts of their unit."""
MOST_SECONDS = 9e9
"""Seconds of which the nanoseconds still have room in 64 bits."""


class Reading(NamedTuple):
    """Choices of a person about how a file is read.

    Attributes:
        arm: of a JIGSAWS file, the arm.
        columns: roles and columns, as :func:`.read_columns` writes them; None for those that are recognised.
        time_unit: of the times; None for what the file says.
        rate: rows in a second [Hz]; None for the times of the file.
        times: file with a time a row, for a file without; None where there is none.
        largest_gap: longest time between rows [s] that is accepted.
    """

    arm: Arm
    columns: str | None
    time_unit: TimeUnit | None
    rate: float | None
    times: Path | None
    largest_gap: float


class Recording(NamedTuple):
    """Contents of a file.

    Attributes:
        track: the motion.
        said: what was recognised, in words.
        notes: what was left out, in words.
        smoothing: of files of this kind, where none is given [s].
        decimals: of the numbers of its attitudes; None where they are more than six.
        entry: change of the angle [rad] for a change of such a number by 1.
        stamped: whether its times are stamps of its rows.
    """

    track: Track
    said: str
    notes: tuple[str, ...]
    smoothing: float
    decimals: int | None
    entry: float
    stamped: bool


class _Table(NamedTuple):
    """Table as it was read: times if it has them, attitudes, and the recognised columns."""

    stamps: Stamps | None
    values: Array
    columns: Columns


def read_recorded(path: Path, reading: Reading) -> Recording:
    """Read a recorded motion.

    Args:
        path: text with a table, Parquet, or JIGSAWS kinematics.

            A table has a column of times (``time``, ``t``, ``timestamp`` or ``stamp``; in seconds, or with a unit in
            its name, as ``time [ms]``; in Parquet also of the type of a time; or in two, ``sec`` and ``nanosec``) and
            the columns of a quaternion (``qw``, ``qx``, ``qy``, ``qz``; ``w``, ``x``, ``y``, ``z``; or these letters
            at the end of any other name) or a rotation matrix (``r11``, ``r12`` … ``r33``), body → world; further
            columns do not matter. Others are named in ``reading.columns``.
        reading: choices about how it is read.

    Raises:
        ParameterError: in one line, where the file cannot be read or is not a motion.
    """
    try:
        note_input(path)
        with path.open("rb") as file:
            head = file.read(HEAD)
            file.seek(0)
            first = next((line for line in head.splitlines() if line.strip()), b"")
            if is_jigsaws(first) and reading.columns is None:
                rate = reading.rate or jigsaws.RATE
                values = read_jigsaws(file, reading.arm)
                columns = Columns(None, (), "rotation matrix", None, f"JIGSAWS kinematics, {reading.arm}")
                return _recording(_Table(None, values, columns), reading._replace(rate=rate), jigsaws.SMOOTHING)
        table = _parquet(path, reading) if head.startswith(b"PAR1") else _text(path, reading)
        if reading.rate is None and reading.times is not None:
            table = table._replace(stamps=_times(reading.times, len(table.values)))
        return _recording(table, reading, 0.0)
    except FileNotFoundError:
        raise ParameterError(f"reference file {str(path)!r}: no such file") from None
    except RowError as error:
        raise ParameterError(f"reference file {str(path)!r}: {one_line(error)}") from None
    except OSError as error:
        raise ParameterError(
            f"reference file {str(path)!r} cannot be read: {error.strerror or one_line(error)}"
        ) from None


def _recording(table: _Table, reading: Reading, smoothing: float) -> Recording:
    attitude = attitudes_of(table.columns.kind, table.values)
    said, stamps = table.columns.said, table.stamps
    if reading.rate is not None:
        track, notes = track_of(reading.rate, attitude, reading.largest_gap)
        said += f", {reading.rate:g} rows a second"
    elif stamps is None:
        raise RowError(
            "it has no times (time, t or timestamp): give reference.rate [Hz], rows in a second, or reference.times, a "
            "file with a time a row"
        )
    else:
        track, notes = track_of(stamps, attitude, reading.largest_gap, reading.time_unit)
        said += f", times in {UNIT_NAMES[reading.time_unit or stamps.unit or 's']}"
    kind = table.columns.kind
    entry = 2.0 if kind == "quaternion" else np.pi / 180.0 if kind.endswith("[deg]") else 1.0
    return Recording(track, said, notes, smoothing, _decimals(table.values), entry, stamps is not None)


def _text(path: Path, reading: Reading) -> _Table:
    dialect = dialect_of(path)
    names = dialect.names
    if reading.columns is not None:
        columns = chosen_columns(reading.columns, names)
    elif dialect.named:
        columns = columns_of(names)
    else:
        columns = columns_by_width(len(names), spaced=dialect.spaced)
    with_time = columns.time is not None and reading.rate is None and reading.times is None
    stamped = [each for each in (columns.time, columns.nanoseconds) if each is not None and with_time]
    times, values = read_table(path, dialect, stamped, columns.attitude)
    parts = [_stamps(each, columns.unit, dialect.decimal) for each in times]
    stamps = _one_stamp(*parts) if len(parts) > 1 else parts[0] if parts else None
    return _Table(stamps, values, columns._replace(said=f"{columns.said}, {dialect.said}"))


def _times(path: Path, rows: int) -> Stamps:
    """Read the times of a file that has one a row."""
    try:
        dialect = dialect_of(path)
        column, unit = 0, None
        if dialect.named and len(dialect.names) > 1:
            raise RowError(f"it has {len(dialect.names)} columns: one of times is needed")
        times, _ = read_table(path, dialect, [column], [])
        if len(times[0]) != rows:
            raise RowError(f"it has {len(times[0])} times, and the motion {rows} rows")
        return _stamps(times[0], unit, dialect.decimal)
    except RowError as error:
        raise RowError(f"reference.times {str(path)!r}: {one_line(error)}") from None
    except OSError as error:
        raise RowError(f"reference.times {str(path)!r}: {(error.strerror or 'no such file').lower()}") from None


def _stamps(texts: Any, unit: str | None, decimal: str) -> Stamps:
    """Return times that are written as integers, decimal numbers or dates, exactly where that is possible."""
    import pyarrow
    from pyarrow import compute

    texts = compute.utf8_trim_whitespace(texts)
    if decimal == ",":
        texts = compute.replace_substring(texts, ",", ".")
    try:
        return Stamps(np.asarray(compute.cast(texts, pyarrow.int64()).to_numpy()), 1.0, unit)
    except pyarrow.ArrowException:
        pass
    try:
        since = compute.subtract(numbers := compute.cast(texts, pyarrow.decimal128(26, 9)), numbers[0])
        billion = pyarrow.scalar(EXACT).cast(pyarrow.decimal128(19, 0)).cast(pyarrow.decimal128(10, 0))
        return Stamps(np.asarray(compute.multiply(since, billion).cast(pyarrow.int64()).to_numpy()), EXACT, unit)
    except pyarrow.ArrowException:
        pass
    try:
        return Stamps(np.asarray(compute.cast(texts, pyarrow.float64()).to_numpy()), 1.0, unit)
    except pyarrow.ArrowException:
        pass
    for kind in (pyarrow.timestamp("ns"), pyarrow.timestamp("ns", tz="UTC")):
        try:
            return Stamps(np.asarray(compute.cast(texts, kind).cast(pyarrow.int64()).to_numpy()), 1.0, "ns")
        except pyarrow.ArrowException:
            continue
    for row, text in enumerate(texts.to_pylist(), start=1):
        try:
            float(text)
        except ValueError:
            raise RowError(f"data row {row} has the time {one_line(repr(text), 40)}, which is no number") from None
    raise RowError("its times are no numbers")


def _one_stamp(seconds: Stamps, nanoseconds: Stamps) -> Stamps:
    """Return the times of two columns, exactly: seconds, and the nanoseconds since each of them.

    Raises:
        RowError: they are no such numbers.
    """
    whole, rest = (np.asarray(each.ticks) for each in (seconds, nanoseconds))
    row = np.arange(1, len(whole) + 1)
    refuse(~(np.abs(whole / seconds.per_unit) < MOST_SECONDS), "has no number of seconds", row)
    rest = rest / nanoseconds.per_unit if nanoseconds.per_unit != 1.0 else rest
    refuse(~((rest >= 0) & (rest < EXACT)), f"has no nanoseconds from 0 to {EXACT - 1:,}", row)
    return Stamps(whole * (EXACT // round(seconds.per_unit)) + rest, 1.0, "ns")


def _parquet(path: Path, reading: Reading) -> _Table:
    import pyarrow
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path) as file:
            schema = file.schema_arrow
            names, chosen = schema.names, reading.columns
            columns = columns_of(names) if chosen is None else chosen_columns(chosen, names)
            if columns.time is None:  # as of an index of pandas, whose name may be anything
                dated = [number for number, kind in enumerate(schema.types) if pyarrow.types.is_timestamp(kind)]
                columns = columns._replace(time=dated[0] if len(dated) == 1 else None)
            stamped = [each for each in (columns.time, columns.nanoseconds) if each is not None]
            wanted = [*columns.attitude, *stamped]
            _check_columns(file, wanted, stamped)
            texts = [names[number] for number in wanted if _is_text(schema.types[number])]
        with parquet.ParquetFile(path, read_dictionary=texts) as file:  # a text that stands often is read once
            table = file.read(columns=[names[number] for number in wanted])
            attitude = [table.column(names[number]).cast(pyarrow.float64()) for number in columns.attitude]
            values = np.stack([np.asarray(column.to_numpy()) for column in attitude], axis=1)
            parts = [_arrow_stamps(table.column(names[number]), columns.unit) for number in stamped]
            stamps = _one_stamp(*parts) if len(parts) > 1 else parts[0] if parts else None
            return _Table(stamps, values, columns._replace(said=f"Parquet, {columns.said}"))
    except (pyarrow.ArrowException, OSError, ValueError, KeyError) as error:
        raise RowError(f"it is damaged, or has no numbers in its columns ({one_line(error, limit=160)})") from None


def _check_columns(file: Any, wanted: Sequence[int], times: Sequence[int]) -> None:
    """Refuse columns that are no numbers or times, or too large, before memory is taken for them."""
    from pyarrow import types

    for number in wanted:
        field = file.schema_arrow.field(number)
        kind = field.type
        is_number = types.is_integer(kind) or types.is_floating(kind) or types.is_decimal(kind)
        is_time = number in times and (types.is_timestamp(kind) or types.is_duration(kind) or _is_text(kind))
        if not (is_number or is_time):
            raise RowError(f"its column {field.name!r} has values of type {one_line(field.type, 60)}, not numbers")
    if file.metadata.num_rows > LAST_ROW:
        raise too_long()
    groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
    paths = {file.schema_arrow.names[number] for number in wanted}
    columns = (group.column(k) for group in groups for k in range(group.num_columns))
    if sum(column.total_uncompressed_size for column in columns if column.path_in_schema in paths) > LARGEST:
        raise too_long()


def _is_text(kind: Any) -> bool:
    from pyarrow import types

    return any(is_text(kind) for is_text in (types.is_string, types.is_large_string))


def _arrow_stamps(column: Any, unit: str | None) -> Stamps:
    import pyarrow

    kind = column.type
    if pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind):
        column, unit = column.cast(pyarrow.int64()), kind.unit
    elif pyarrow.types.is_integer(kind):
        column = column.cast(pyarrow.int64())
    elif pyarrow.types.is_dictionary(kind):
        for chunk in column.chunks:
            if max((len(text or "") for text in chunk.dictionary.to_pylist()), default=0) > LONGEST_TIME:
                raise RowError(f"it has a time of more than {LONGEST_TIME} characters")
        return _stamps(column.cast(pyarrow.string()), unit, ".")
    else:
        column = column.cast(pyarrow.float64())
    ticks = np.asarray(column.to_numpy())  # of float64 where cells are empty
    return Stamps(ticks, 1.0, unit)


def _decimals(values: Array) -> int | None:
    """Return the decimals with which numbers are written, up to six."""
    numbers = values[np.isfinite(values).all(axis=1)]
    for decimals in range(7):
        if np.array_equal(np.round(numbers, decimals), numbers):
            return decimals
    return None
