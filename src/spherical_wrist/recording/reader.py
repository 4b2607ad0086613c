"""Reading recordings of this format and of older ones."""

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
from rerun.chunk import RrdReader

from spherical_wrist.arrays import Array
from spherical_wrist.channels import CHANNELS, Channel, Condition, channel_of
from spherical_wrist.errors import RecordingError, one_line
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.layout import ABOUT, APPLICATION, ARCHIVE, FORMAT, SERIES, TIMELINE, ZIP, plot_entity
from spherical_wrist.recording.seal import check_seal

Table = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Recording:
    """Contents of a recording.

    Attributes:
        series: the channels of the run, bit for bit.
        properties: groups of entries, as they were given.
        every: the series has every ``every``-th control instant.
        archive: archive of the files that the run depends on; empty if there is none.
        format: number of its format; see :data:`spherical_wrist.recording.layout.FORMAT`.
    """

    series: Series
    properties: dict[str, dict[str, Any]]
    every: int
    archive: bytes = b""
    format: int = FORMAT


def read_recording(path: Path) -> Recording:
    """Read a recording that :func:`.write_recording` of this or an older version wrote.

    Raises:
        RecordingError: the file is missing, truncated, damaged, of a newer format, or not a recording of this package.
    """
    check_seal(path)
    try:
        tables = _Tables(path)
        about = tables.components(_path_of_properties(ABOUT))
        number = int(about["format"][0])
        if not 1 <= number <= FORMAT:
            raise RecordingError(
                f"recording {str(path)!r} has format {number}; this version reads formats 1 to {FORMAT}: "
                "take the version of spherical-wrist that wrote it, or a newer one"
            )
        properties = _groups(json.loads(str(about["properties"][0])))
        if number == 1:
            series = _series_of_format_1(tables, properties["experiment"]["law"]["name"])
        else:
            series = _series(tables, json.loads(str(about["channels"][0])), number)
        if len(series) != about["rows"][0]:
            raise RecordingError(f"recording {str(path)!r} lacks rows; record the run again")
        archive = tables.components(_path_of_properties(ARCHIVE)).get(ZIP)
        packed = b"" if archive is None else np.asarray(archive[0], dtype=np.uint8).tobytes()
        return Recording(series, properties, _interval(about), packed, number)
    except UnicodeEncodeError:
        raise RecordingError(f"recording {str(path)!r}: Rerun cannot open a file of such a name; rename it") from None
    except KeyError as error:
        raise RecordingError(f"recording {str(path)!r} cannot be read: it lacks {one_line(error, 100)}") from None
    except (IndexError, TypeError, ValueError, AttributeError, OverflowError, RuntimeError) as error:
        raise RecordingError(f"recording {str(path)!r} cannot be read: {one_line(error, 100)}") from None
    except MemoryError:
        raise RecordingError(f"recording {str(path)!r} cannot be read: there is too little memory") from None


def _groups(properties: Any) -> dict[str, dict[str, Any]]:
    if not isinstance(properties, dict) or not all(isinstance(group, dict) for group in properties.values()):
        raise ValueError("its properties are no groups")
    return properties


def _interval(about: Table) -> int:
    every = int(about["every"][0])
    if every < 1:
        raise ValueError(f"it has every {every}th instant")
    return every


def _series(tables: "_Tables", entries: Mapping[str, Mapping[str, Any]], number: int) -> Series:
    """Read the channels that a recording of format ``number`` describes."""
    described = {name: channel_of(entry, name) for name, entry in entries.items()}
    shared = tables.components(f"/{SERIES}")
    rows = len(shared["time"])
    channels = {}
    for name, channel in described.items():
        entities = entries[name]["entities"]
        own = [tables.components(f"/{entity}")[_SCALARS] for entity in entities if entity != SERIES]
        flat = own[0] if len(own) == 1 else np.hstack([each.reshape(rows, -1) for each in own]) if own else shared[name]
        channels[name] = _shaped(channel, flat, rows)
    for name, known in CHANNELS.items():
        if name not in channels and known.when is Condition.ALWAYS and known.since <= number:
            raise KeyError(name)
        if name in channels and known.axes is not None and channels[name].shape[1:] != known.shape:
            raise ValueError(f"its channel {name!r} has rows of shape {channels[name].shape[1:]}")
    differing = {name: channel for name, channel in described.items() if channel != CHANNELS.get(name)}
    return Series(channels=channels, described=differing)


_STATE_OF_FORMAT_1 = {
    "fuzzy_integral_sliding": [
        *(6 + 20 * i + n for i in range(3) for n in range(16)), 1, 0,
        *(3 + 20 * i for i in range(3)), *(4 + 20 * i for i in range(3)), *(5 + 20 * i for i in range(3)),
        *(2 + 20 * i for i in range(3)),
    ]
}  # fmt: skip
"""Columns of the state in format 1, in their present order, of laws whose order has changed."""


def _series_of_format_1(tables: "_Tables", law: str) -> Series:
    """Read the channels of format 1, in which the surface of a law that has none is all not-a-number.

    A channel is an entity of its own among the plots, or a component of the shared entity.
    """
    shared = tables.components(f"/{SERIES}")
    channels = {}
    for name, channel in CHANNELS.items():
        flat = shared.get(name)
        if flat is None:
            flat = tables.components(f"/{plot_entity(name)}").get(_SCALARS)
        if flat is None and channel.when is Condition.ALWAYS and channel.since == 1:
            raise KeyError(name)
        if flat is not None and not (channel.when is Condition.SURFACE and np.isnan(flat).all()):
            channels[name] = _shaped(channel, flat, len(shared["time"]))
    if law in _STATE_OF_FORMAT_1 and "law_state" in channels:
        channels["law_state"] = channels["law_state"][:, _STATE_OF_FORMAT_1[law]]
    return Series(channels=channels)


def _shaped(channel: Channel, flat: Array, rows: int) -> Array:
    if flat.dtype != np.float64:
        raise ValueError(f"its channel {channel.name!r} is of {flat.dtype}")
    if channel.is_scalar:
        return flat.reshape(rows)
    return flat.reshape(rows, len(channel.axes) if channel.axes else -1)


_SCALARS = "Scalars:scalars"


class _Tables:
    """Components of the entities of a recording, flat, converted when they are asked for."""

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        recordings = reader.recordings()
        if [entry.application_id for entry in recordings] != [APPLICATION]:
            names = ", ".join(sorted({entry.application_id for entry in recordings})) or "none"
            raise RecordingError(
                f"recording {str(path)!r} was not made by spherical-wrist (applications in it: {names})"
            )
        content = [f"/{SERIES}", f"/{plot_entity('**')}", _path_of_properties(ABOUT), _path_of_properties(ARCHIVE)]
        self._chunks: dict[str, list[Any]] = defaultdict(list)
        for chunk in reader.stream(store=recordings[0]).filter(content=content):
            self._chunks[chunk.entity_path].append(chunk)

    def components(self, entity: str) -> Table:
        """Return the components of one entity by name, with the parts of a split entity in the order of time."""
        parts = defaultdict(list)
        for batch in sorted((chunk.to_record_batch() for chunk in self._chunks.get(entity, ())), key=_first_time):
            for field, column in zip(batch.schema, batch.columns, strict=True):
                if (field.metadata or {}).get(b"rerun:kind") == b"data":
                    component = field.metadata[b"rerun:component"].decode()
                    parts[component].append(_values(column))
        return {component: np.concatenate(pieces) for component, pieces in parts.items()}


_BYTES = pa.list_(pa.field("item", pa.uint8(), nullable=False))
_TYPES = [
    pa.list_(kind) for kind in (pa.float64(), pa.float32(), pa.int64(), pa.uint32(), pa.uint8(), pa.string(), _BYTES)
]
"""Types of the columns that the package writes to the entities that it reads."""


def _values(column: pa.Array) -> npt.NDArray[Any]:
    """Return the values of a column of lists.

    Raises:
        ValueError: it has others, such as those that take memory without being stored.
    """
    if column.type not in _TYPES:
        raise ValueError(f"it has a component of type {column.type}")
    values: npt.NDArray[Any] = column.flatten().to_numpy(zero_copy_only=False)
    return values


def _first_time(batch: Any) -> int:
    index = batch.schema.get_field_index(TIMELINE)
    return int(batch.column(index)[0].value) if index >= 0 and batch.num_rows else 0


def _path_of_properties(group: str) -> str:
    return f"/__properties/{group}"
