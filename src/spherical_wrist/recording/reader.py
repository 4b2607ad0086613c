"""Reading recordings."""

import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rerun.chunk import RrdReader

from spherical_wrist.errors import RecordingError, one_line
from spherical_wrist.recording.layout import (
    ABOUT,
    APPLICATION,
    ARCHIVE,
    FORMAT,
    HARDWARE,
    PLOTTED,
    SERIES,
    TIMELINE,
    ZIP,
    plot_entity,
)
from spherical_wrist.recording.seal import check_seal
from spherical_wrist.simulation.series import COLUMNS, EXTRAS, WIDTHS, Series

_PLOTS = [*PLOTTED, *(name for name in HARDWARE if name in EXTRAS)]
"""Arrays that may have an entity of their own."""


@dataclass(frozen=True)
class Recording:
    """What was recorded.

    Attributes:
        series: the arrays of the run, bit for bit.
        properties: groups of entries, as they were given.
        every: the series has every ``every``-th control instant.
        archive: of the files that the run depends on; empty where there is none.
    """

    series: Series
    properties: dict[str, dict[str, Any]]
    every: int
    archive: bytes = b""


def read_recording(path: Path) -> Recording:
    """Reads a recording that :func:`.write_recording` made.

    Raises:
        RecordingError: the file is missing, truncated, damaged, or not a recording of this package.
    """
    check_seal(path)
    try:
        tables = _tables(path)
        about = tables[_path_of_properties(ABOUT)]
        if about["format"].tolist() != [FORMAT]:
            raise RecordingError(f"recording {str(path)!r} was written by another version; record the run again")
        series, properties = Series(**_arrays(tables)), json.loads(str(about["properties"][0]))
        if len(series) != about["rows"][0]:
            raise RecordingError(f"recording {str(path)!r} lacks rows; record the run again")
        archive = tables.get(_path_of_properties(ARCHIVE), {}).get(ZIP)
        packed = b"" if archive is None else np.asarray(archive[0], dtype=np.uint8).tobytes()
        return Recording(series, properties, int(about["every"][0]), packed)
    except UnicodeEncodeError:
        raise RecordingError(f"recording {str(path)!r}: Rerun cannot open a file of such a name; rename it") from None
    except (KeyError, IndexError, ValueError, RuntimeError) as error:
        raise RecordingError(f"recording {str(path)!r} cannot be read: {one_line(error, 100)}") from None


Table = dict[str, npt.NDArray[Any]]


def _tables(path: Path) -> dict[str, Table]:
    """Of every entity that counts, its components, flat."""
    reader = RrdReader(path)
    recordings = reader.recordings()
    if [entry.application_id for entry in recordings] != [APPLICATION]:
        names = ", ".join(sorted({entry.application_id for entry in recordings})) or "none"
        raise RecordingError(f"recording {str(path)!r} was not made by spherical-wrist (applications in it: {names})")
    content = [
        f"/{SERIES}",
        *(f"/{plot_entity(name)}" for name in _PLOTS),
        _path_of_properties(ABOUT),
        _path_of_properties(ARCHIVE),
    ]
    parts: dict[str, list[Any]] = defaultdict(list)
    for chunk in reader.stream(store=recordings[0]).filter(content=content):
        parts[chunk.entity_path].append(chunk.to_record_batch())
    return {entity: _components(batches) for entity, batches in parts.items()}


def _components(batches: list[Any]) -> Table:
    """The components of one entity, flat, with the parts of an entity that was split in the order of time."""
    parts = defaultdict(list)
    for batch in sorted(batches, key=_first_time):
        for field, column in zip(batch.schema, batch.columns, strict=True):
            if (field.metadata or {}).get(b"rerun:kind") == b"data":
                component = field.metadata[b"rerun:component"].decode()
                parts[component].append(column.flatten().to_numpy(zero_copy_only=False))
    return {component: np.concatenate(pieces) for component, pieces in parts.items()}


def _first_time(batch: Any) -> int:
    index = batch.schema.get_field_index(TIMELINE)
    return int(batch.column(index)[0].value) if index >= 0 and batch.num_rows else 0


def _path_of_properties(group: str) -> str:
    return f"/__properties/{group}"


def _arrays(tables: dict[str, Table]) -> dict[str, npt.NDArray[np.float64]]:
    """The arrays of the series, in their shapes."""
    flat = dict(tables[f"/{SERIES}"])
    flat |= {name: tables[own]["Scalars:scalars"] for name in _PLOTS if (own := f"/{plot_entity(name)}") in tables}
    arrays = {name: flat[name].reshape(-1, WIDTHS[name]) if WIDTHS[name] else flat[name] for name in COLUMNS}
    for name in EXTRAS:
        extra = flat.get(name, np.empty(0))
        arrays[name] = extra.reshape(len(arrays["time"]), -1 if extra.size else 0)
    return arrays
