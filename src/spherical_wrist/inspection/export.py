"""The series of a run for other programs: as CSV, Parquet, or NumPy's archive, every float64 bit for bit."""

import io
import json
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet

from spherical_wrist.inspection.columns import Column, columns
from spherical_wrist.inspection.formats import EXPORTS
from spherical_wrist.picture_file import check_ending
from spherical_wrist.simulation.run import Run

ROWS = 1 << 16
"""Rows that are brought into a format at a time, which bounds the memory that takes."""


def exported(run: Run, path: Path) -> Iterator[bytes]:
    """A run as the content of a file, piece by piece, in the format that the end of the file's name stands for.

    - ``.csv``: a header and one line a row. Every number has the digits that it takes to read the same bits back, 17 at
      most; what is not a number is ``nan``.
    - ``.parquet``: the same columns. Fields carry ``unit`` and ``meaning``; the schema carries ``experiment``,
      ``outcome``, ``metrics``, ``measurement``, ``versions`` and ``record_every`` as JSON.
    - ``.npz``: every array by its name, in its shape, and the same JSON as texts; ``units`` is one more.

    Raises:
        ParameterError: the name ends in something else.
    """
    check_ending(path, "export", EXPORTS)
    return _FORMATS[path.suffix.lower()](run)


def about(run: Run) -> dict[str, str]:
    """Return all of a run but its series, as JSON by name."""
    outcome = run.outcome
    properties: Mapping[str, Any] = {
        "experiment": run.description,
        "outcome": {"status": str(outcome.status), "time_s": outcome.time, "reason": outcome.reason},
        "warnings": list(run.warnings),
        "metrics": dict(run.metrics),
        "measurement": run.measurement._asdict(),
        "versions": run.versions,
        "record_every": run.every,
    }
    return {name: json.dumps(value, ensure_ascii=False) for name, value in properties.items()}


def _as_csv(run: Run) -> Iterator[bytes]:
    found = list(columns(run))
    yield (",".join(column.name for column in found) + "\n").encode()
    schema = pa.schema([(column.name, pa.float64()) for column in found])
    for batch in _batches(found, schema):
        lines = io.BytesIO()
        csv.write_csv(batch, lines, csv.WriteOptions(include_header=False))
        yield lines.getvalue()


def _as_parquet(run: Run) -> Iterator[bytes]:
    found = list(columns(run))
    fields = [
        pa.field(each.name, pa.float64(), metadata={"unit": each.unit, "meaning": each.meaning}) for each in found
    ]
    sink = _Pieces()
    # dictionaries are of no use to measurements, of which hardly any two are the same
    with parquet.ParquetWriter(sink, pa.schema(fields, about(run)), compression="zstd", use_dictionary=False) as writer:
        for batch in _batches(found, writer.schema):
            writer.write_batch(batch)
            yield sink.taken()
    yield sink.taken()


def _as_npz(run: Run) -> Iterator[bytes]:
    units = json.dumps({name: run.channel(name).unit for name in run.channels}, ensure_ascii=False)
    texts = {name: np.array(text) for name, text in {**about(run), "units": units}.items()}
    sink = _Pieces()
    with zipfile.ZipFile(sink, "w") as archive:
        for name, array in {**run.channels, **texts}.items():
            # a name without a date, so that the same run makes the same file
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)
            yield sink.taken()
    yield sink.taken()


def _batches(found: list[Column], schema: pa.Schema) -> Iterator[pa.RecordBatch]:
    for first in range(0, len(found[0].values), ROWS):
        pieces = [pa.array(np.ascontiguousarray(column.values[first : first + ROWS])) for column in found]
        yield pa.record_batch(pieces, schema=schema)


class _Pieces(io.RawIOBase):
    """Write-only file that hands out its content piece by piece."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, content: Any) -> int:
        self._pieces.append(bytes(content))
        return len(self._pieces[-1])

    def taken(self) -> bytes:
        """Return the bytes written since the last call."""
        content = b"".join(self._pieces)
        self._pieces.clear()
        return content


_FORMATS: Mapping[str, Callable[[Run], Iterator[bytes]]] = dict(
    zip(EXPORTS, (_as_csv, _as_parquet, _as_npz), strict=True)
)
